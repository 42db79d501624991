"""How charts look: one theme, in the text's colour on a page and in black on paper."""

from collections.abc import Mapping
from typing import Any

from reference.effects import EFFECTS

EFFECT_COLOURS = {effect.label: effect.colour for effect in EFFECTS if effect.colour}
"""Of the effects that have a price: the seven of Okabe and Ito for what often comes together, and
three of Tol's muted scheme. Both are made to be told apart with the common colour deficiencies."""

EFFECTS_TITLE = "Effects"
"""Of the map of what dominates where."""

NO_EFFECT = "#dee2e6"
"""Where no effect removes enough to be seen."""

FAINT = "#8a8a8a"
"""Lines that help to read others, on a light and on a dark ground."""


def themed(spec: Mapping[str, Any], theme: Mapping[str, Any]) -> dict[str, Any]:
    """Return a specification in a theme; its own config has the last word."""
    return {**spec, "config": _merged(theme, spec.get("config", {}))}


def _merged(theme, own):
    if not isinstance(theme, Mapping):
        return own
    return {**theme, **{key: _merged(theme.get(key), value) for key, value in own.items()}}


def _theme(ink, **own):
    texts = {"labelColor": ink, "titleColor": ink, "titleFontWeight": "normal"}
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
        **own,
    }


#: Charts are described by their page, not in themselves.
PAGE = _theme("currentColor", aria=False, background="transparent", font="system-ui, sans-serif")

#: The font is Matplotlib's, whose figures stand beside these.
PAPER = _theme("black", background="white", font="DejaVu Sans, sans-serif")
