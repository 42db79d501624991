"""The first screen: the verdict, and a bar for each scene, worst first."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from reports import verdict
from reports.charts.theme import EFFECT_COLOURS

ROOM = 1.04
"""Width of the bars, relative to the longest."""


def context(scenes: Sequence[Any]) -> dict[str, Any]:
    """Return the template's data of scenes, each with ``record`` and ``cost``."""
    found = [verdict.finding(s.record, s.cost.record if s.cost else None) for s in scenes]
    rows = sorted(zip(scenes, found, strict=True), key=lambda row: -row[1].mean)
    names = verdict.ranked(found)
    return {
        "sentences": verdict.sentences(found),
        "rows": rows,
        "about": {s.id: verdict.about(f) for s, f in zip(scenes, found, strict=True)},
        "tolerances": verdict.TOLERANCES,
        "usual": verdict.USUAL,
        "share": verdict.SHARE,
        "top": ROOM * max((f.mean for f in found), default=1.0) or 1.0,
        "effects": {name: EFFECT_COLOURS[name] for name in names},
        "with_causes": verdict.WITH_CAUSES,
        "has_remedies": any(f.remedies for f in found),
        "has_causes": any(f.remedies or f.nearest for f in found),
    }
