"""Charts: Vega-Lite specifications as plain dicts, drawn as SVG here and live in the page.

The SVG is what paper and browsers without JavaScript show; it takes the colour of the text around
it, so that it fits a light and a dark page. The page replaces it by a live chart with the same
specification, drawn by the Vega bundle that the page holds once.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

#: How all charts look; `currentColor` is the text's. Charts are described by their page, not in
#: themselves.
CONFIG: Mapping[str, Any] = {
    "aria": False,
    "background": "transparent",
    "font": "system-ui, sans-serif",
    "view": {"stroke": None},
    "axis": {
        "labelColor": "currentColor",
        "titleColor": "currentColor",
        "titleFontWeight": "normal",
        "labelFontSize": 11,
        "titleFontSize": 11,
        "domainColor": "currentColor",
        "domainOpacity": 0.5,
        "tickColor": "currentColor",
        "tickOpacity": 0.5,
        "gridColor": "currentColor",
        "gridOpacity": 0.1,
    },
    "legend": {"labelColor": "currentColor", "titleColor": "currentColor"},
    "header": {"labelColor": "currentColor", "titleColor": "currentColor"},
    "title": {"color": "currentColor", "fontWeight": 600, "anchor": "start"},
    "text": {"color": "currentColor"},
    "rule": {"color": "currentColor"},
}


@dataclass(frozen=True)
class Figure:
    """A chart for the page: its title, a sentence, the specification and a picture of it."""

    title: str
    note: str
    spec: Mapping[str, Any]
    svg: str


def figure(title: str, spec: Mapping[str, Any], note: str = "") -> Figure:
    """Make a figure of a Vega-Lite specification; the specification's own config has the last word.

    Its text may come from users' files: it is escaped in the picture, and is data in the page.
    """
    import vl_convert

    own = spec.get("config", {})
    merged = {key: _merged(CONFIG.get(key), own.get(key)) for key in {**CONFIG, **own}}
    spec = {**spec, "config": merged}
    return Figure(title, note, spec, _inline(vl_convert.vegalite_to_svg(spec)))


@lru_cache(maxsize=1)
def bundle() -> str:
    """Vega, Vega-Lite and vega-embed as one JavaScript module that leaves `window.vegaEmbed`."""
    import vl_convert

    return vl_convert.javascript_bundle("window.vegaEmbed = vegaEmbed;")


def _merged(default, own):
    if isinstance(default, Mapping) and isinstance(own, Mapping):
        return {**default, **own}
    return default if own is None else own


def _inline(svg: str) -> str:
    """The SVG with ids of its own, since several share one page; described by its figure."""
    prefix = "v" + hashlib.sha256(svg.encode()).hexdigest()[:8]
    owned = re.sub(r'(\bid="|url\(#|href="#)', rf"\g<1>{prefix}-", svg)
    return owned.replace("<svg ", '<svg aria-hidden="true" ', 1)
