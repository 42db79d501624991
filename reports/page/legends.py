"""What the colours of each map mean: its bar, its labels and a sentence."""

from __future__ import annotations

from dataclasses import dataclass

from comparisons.departure.metrics import LOG2_EPSILON, LOG2_RANGE, METRICS
from reports.files import images


@dataclass(frozen=True)
class Legend:
    """A map's colour bar: title, CSS background, labels from low to high, and a sentence."""

    name: str
    title: str
    bar: str
    labels: tuple[str, ...]
    note: str


def legends() -> tuple[Legend, ...]:
    """The maps in the order of the page."""
    maps = [
        Legend(
            metric.name,
            metric.label,
            images.colour_bar(images.ERROR_COLOURS),
            _labels(*metric.map_range),
            metric.unit,
        )
        for metric in METRICS.values()
    ]
    return (
        *maps,
        Legend(
            "log2_luminance",
            "Luminance ratio",
            images.colour_bar(images.SIGNED_COLOURS),
            (f"≤ −{LOG2_RANGE:g}", "0", f"≥ +{LOG2_RANGE:g} stops"),
            f"log2 of heuristic over reference, red where the heuristic is brighter; "
            f"ε = {LOG2_EPSILON:g}",
        ),
        Legend(
            "significant",
            "Significant difference",
            "",
            (),
            "more than the reference's noise",
        ),
    )


def _labels(low: float, high: float) -> tuple[str, ...]:
    return f"{low:g}", f"{(low + high) / 2:g}", f"≥ {high:g}"
