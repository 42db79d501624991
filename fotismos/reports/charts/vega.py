"""Charts: Vega-Lite specifications, and how they look as SVG.

There is one theme. On paper it is black; in a page the SVG takes the colour of the surrounding
text, so it fits a light and a dark one.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any, TypeAlias

from fotismos.heuristic.errors import OutputError
from fotismos.reports.page.scene_view import Figure

if TYPE_CHECKING:
    import altair

Spec: TypeAlias = dict[str, Any]
"""A Vega-Lite specification, or a part of one."""

FAINT = "#8a8a8a"
"""Colour of guide lines, visible on light and dark grounds."""

IDLE = re.compile(
    r' (?:aria-hidden|aria-roledescription|role|pointer-events|class)="[^"]*"'
    r'| (?:opacity|stroke-width)="1"'
)
"""Attributes that change nothing in a picture: a quarter of its bytes."""


def _theme(ink: str, **theme: Any) -> Spec:
    texts: Spec = {"labelColor": ink, "titleColor": ink, "titleFontWeight": "normal"}
    sizes = {"labelFontSize": 11, "titleFontSize": 11}
    lines = {f"{line}Color": ink for line in ("domain", "tick", "grid")}
    faint = {"domainOpacity": 0.5, "tickOpacity": 0.5, "gridOpacity": 0.1}
    return {
        "axis": texts | sizes | lines | faint,
        "legend": texts | sizes,
        "title": {"color": ink, "fontWeight": 600, "anchor": "start", "fontSize": 14}
        | {"subtitleColor": ink, "subtitleFontSize": 11},
        "text": {"color": ink},
        "rule": {"color": ink},
        "point": {"color": ink},
        "view": {"stroke": None},
        **theme,
    }


#: The page describes its charts, not the charts themselves.
PAGE = _theme("currentColor", aria=False, background="transparent", font="system-ui, sans-serif")

#: The font is Matplotlib's, since its figures are printed next to these.
PAPER = _theme("black", background="white", font="DejaVu Sans, sans-serif")


def figure(title: str, spec: Mapping[str, Any], note: str = "") -> Figure:
    """Make a figure of a Vega-Lite specification, whose text may come from users' files."""
    return Figure(title, note, _drawn(json.dumps({**spec, "config": PAGE})))


def paper(spec: Mapping[str, Any]) -> bytes:
    """Return the SVG file of a specification for print."""
    return _svg(json.dumps({**spec, "config": PAPER})).encode()


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
