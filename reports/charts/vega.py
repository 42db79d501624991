"""Charts: Vega-Lite specifications, drawn as SVG here and live in the page.

Paper and browsers without JavaScript show the SVG. It takes the colour of the surrounding text, so
it fits a light and a dark page. The page replaces it with a live chart of the same specification,
drawn by the page's one Vega bundle. A specification contains its data, and loads nothing.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from comparisons.store import Entry
from heuristic.errors import OutputError
from reports.charts import theme
from reports.charts.theme import Spec

if TYPE_CHECKING:
    import altair

IDLE = re.compile(
    r' (?:aria-hidden|aria-roledescription|role|pointer-events|class)="[^"]*"'
    r'| (?:opacity|stroke-width)="1"'
)
"""Attributes that change nothing in a picture: a quarter of its bytes."""


@dataclass(frozen=True)
class Figure:
    """A chart for the page: its title, a sentence, the specification and a picture of it."""

    title: str
    note: str
    spec: Mapping[str, Any]
    svg: str


def figure(title: str, spec: Mapping[str, Any], note: str = "") -> Figure:
    """Make a figure of a Vega-Lite specification, whose config overrides the theme.

    Its text may come from users' files: it is escaped in the picture, and is data in the page.
    """
    spec = theme.themed(spec, theme.PAGE)
    return Figure(title, note, spec, _drawn(json.dumps(spec)))


def paper(spec: Mapping[str, Any], kind: str = "svg") -> bytes:
    """Return the file of a specification for print, as ``svg`` or ``pdf``."""
    made = _made(f"vegalite_to_{kind}", theme.themed(spec, theme.PAPER))
    return made.encode() if isinstance(made, str) else made


def _made(function: str, argument: Mapping[str, Any] | str) -> Any:
    """Call a function of vl_convert.

    Raises
    ------
    OutputError
        If files or memory run out; vl_convert then panics, with a ``BaseException``.
    """
    import vl_convert

    try:
        return getattr(vl_convert, function)(argument)
    except BaseException as error:
        if type(error).__name__ != "PanicException":
            raise
        raise OutputError(
            f"the charts cannot be drawn: {error}. Allow more open files (ulimit -n) or memory."
        ) from error


def specification(chart: altair.TopLevelMixin) -> Spec:
    """Return the Vega-Lite specification of an Altair chart, without a theme."""
    spec = chart.to_dict()
    del spec["config"]  # Altair's default theme
    return spec


@lru_cache(maxsize=1)
def bundle() -> str:
    """Vega, Vega-Lite and vega-embed as one JavaScript module that sets `window.vegaEmbed`.

    It takes two seconds to make, and is kept in the user's cache if there is one.
    """
    import vl_convert

    # The home folder may be missing, or read-only.
    with suppress(OSError, RuntimeError, OutputError):
        kept = Entry(_cache() / "vega.json", vl_convert.__version__)  # type: ignore[attr-defined]  # untyped
        script = (kept.load() or {}).get("script")
        if not isinstance(script, str):
            script = _bundled()
            kept.path.parent.mkdir(parents=True, exist_ok=True)
            kept.save({"script": script})
        return script
    return _bundled()


@lru_cache(maxsize=1)
def _bundled() -> str:
    return _made("javascript_bundle", "window.vegaEmbed = vegaEmbed;")


def _cache() -> Path:
    """The cache folder (XDG Base Directory Specification)."""
    given = Path(os.environ.get("XDG_CACHE_HOME", ""))
    return (given if given.is_absolute() else Path.home() / ".cache") / "fotismos"


@lru_cache(maxsize=1024)
def _drawn(spec: str) -> str:
    """The picture for the page, which is written many times while it grows."""
    return _inline(_made("vegalite_to_svg", spec))


def _inline(svg: str) -> str:
    """The SVG with unique ids, since several share one page; its figure describes it."""
    svg = re.sub(r"<[^>]*>", lambda tag: IDLE.sub("", tag[0]), svg)
    prefix = "v" + hashlib.sha256(svg.encode()).hexdigest()[:8]
    owned = re.sub(r'(\bid="|url\(#|href="#)', rf"\g<1>{prefix}-", svg)
    return owned.replace("<svg ", '<svg aria-hidden="true" ', 1)
