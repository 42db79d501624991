"""What the colours of each map mean: its bar, its labels and a sentence."""

from __future__ import annotations

from dataclasses import dataclass

from comparisons.departure.metrics import RATIO, drawn
from reports.files import images


@dataclass(frozen=True)
class Legend:
    """A map: how it is drawn, its colour bar, labels from low to high, and a sentence.

    ``kind`` is ``error``, ``ratio`` or ``mask``; ``top`` the end of the bar.
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
    limit = RATIO.limit
    return (
        *(
            Legend(
                metric.name,
                metric.label,
                "error",
                metric.map_range[1],
                images.colour_bar(images.ERROR_COLOURS),
                _labels(*metric.map_range),
                metric.unit,
            )
            for metric in drawn().values()
        ),
        Legend(
            RATIO.name,
            RATIO.label,
            "ratio",
            limit,
            images.colour_bar(images.SIGNED_COLOURS),
            (f"≤ −{limit:g}", "0", f"≥ +{limit:g} {RATIO.unit}"),
            RATIO.definition,
        ),
        Legend(
            "significant", "Significant difference", "mask", note="more than the reference's noise"
        ),
    )


def _labels(low: float, high: float) -> tuple[str, ...]:
    return f"{low:g}", f"{(low + high) / 2:g}", f"≥ {high:g}"
