"""How charts look: one theme, in the text's colour on a page and in black on paper."""

from dataclasses import dataclass
from typing import Any, TypeAlias

from fotismos.reference.planning.effects import EFFECTS

Spec: TypeAlias = dict[str, Any]
"""A Vega-Lite specification, or a part of one."""

EFFECT_COLOURS = {effect.label: effect.colour for effect in EFFECTS if effect.colour}
"""Colours of effects in attributions: Okabe and Ito's seven for those that often come together, and
four of Tol's muted scheme. Both suit the common colour deficiencies."""

EFFECTS_TITLE = "Effects"
"""Title of the map of dominant effects."""

NO_EFFECT = "#dee2e6"
"""Colour where no effect removes enough to be seen."""

FAINT = "#8a8a8a"
"""Colour of guide lines, visible on light and dark grounds."""


@dataclass(frozen=True)
class Figure:
    """A chart for the page: its title, a sentence, and its picture."""

    title: str
    note: str
    svg: str


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
