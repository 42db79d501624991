"""The legend of each map: its bar, labels and a sentence."""

from __future__ import annotations

from dataclasses import dataclass

from comparisons.departure.metrics import RATIO, drawn
from reports.files import images


@dataclass(frozen=True)
class Legend:
    """A map: its kind, colour bar, labels from low to high, and a sentence.

    ``kind`` is ``error``, ``ratio`` or ``mask``; ``top`` is the end of the bar.
    """

    name: str
    title: str
    kind: str
    top: float = 1.0
    bar: str = ""
    labels: tuple[str, ...] = ()
    note: str = ""


def legends() -> tuple[Legend, ...]:
    """The maps in the order of the page."""
    bar, signed = map(images.colour_bar, (images.ERROR_COLOURS, images.SIGNED_COLOURS))
    stops = f"≤ −{RATIO.limit:g}", "0", f"≥ +{RATIO.limit:g} {RATIO.unit}"
    errors = (
        Legend(m.name, m.label, "error", m.map_range[1], bar, _labels(*m.map_range), m.unit)
        for m in drawn().values()
    )
    return (
        *errors,
        Legend(RATIO.name, RATIO.label, "ratio", RATIO.limit, signed, stops, RATIO.definition),
        Legend("significant", "Shown to differ", "mask", note="shown to differ, however little"),
    )


def _labels(low: float, high: float) -> tuple[str, ...]:
    return f"{low:g}", f"{(low + high) / 2:g}", f"≥ {high:g}"
