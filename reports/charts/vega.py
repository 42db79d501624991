"""Charts: Vega-Lite specifications, drawn as SVG.

In a page the SVG takes the colour of the surrounding text, so it fits a light and a dark one.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from fotismos.heuristic.errors import OutputError
from fotismos.reports.charts import theme
from fotismos.reports.charts.theme import Figure, Spec

if TYPE_CHECKING:
    import altair

IDLE = re.compile(
    r' (?:aria-hidden|aria-roledescription|role|pointer-events|class)="[^"]*"'
    r'| (?:opacity|stroke-width)="1"'
)
"""Attributes that change nothing in a picture: a quarter of its bytes."""


def figure(title: str, spec: Mapping[str, Any], note: str = "") -> Figure:
    """Make a figure of a Vega-Lite specification, whose text may come from users' files."""
    return Figure(title, note, _drawn(json.dumps({**spec, "config": theme.PAGE})))


def paper(spec: Mapping[str, Any]) -> bytes:
    """Return the SVG file of a specification for print."""
    return _svg(json.dumps({**spec, "config": theme.PAPER})).encode()


def _svg(spec: str) -> str:
    """Draw a specification; vl_convert panics if files or memory run out."""
    import vl_convert

    try:
        return vl_convert.vegalite_to_svg(spec)
    except BaseException as error:
        # A panic of Rust is no Exception, and its type cannot be imported.
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


@lru_cache(maxsize=1024)
def _drawn(spec: str) -> str:
    """The picture for the page, which is written many times while it grows.

    It has unique ids, since several share one page; its figure describes it.
    """
    # Only within tags: the text of a chart may look like an attribute.
    svg = re.sub(r"<[^>]*>", lambda tag: IDLE.sub("", tag[0]), _svg(spec))
    prefix = "v" + hashlib.sha256(svg.encode()).hexdigest()[:8]
    owned = re.sub(r'(\bid="|url\(#|href="#)', rf"\g<1>{prefix}-", svg)
    return owned.replace("<svg ", '<svg aria-hidden="true" ', 1)
