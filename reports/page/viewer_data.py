"""The viewer's data besides images: legends, how maps are drawn, and where regions are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from comparisons.departure.colour import BT709, rgb_to_xyz
from comparisons.departure.metrics import LOG2_EPSILON, RATIO, drawn
from comparisons.departure.regions import Region
from comparisons.departure.statistics import Summary
from reports.charts import theme
from reports.files import images

#: Approximate screen pixels of a region that is opened from its link.
REGION_SIZE = 420


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


def drawing() -> dict[str, Any]:
    """Maps, their colours, and the matrix from linear RGB to XYZ, under the script's names."""
    keys = ("name", "title", "kind", "top")
    maps = [{key: getattr(item, key) for key in keys} for item in legends()]
    effects = {"name": "effects", "title": theme.EFFECTS_TITLE, "kind": "effects", "top": 1}
    return {
        "maps": [*maps, effects],
        "noEffect": theme.NO_EFFECT,
        "colours": {
            "error": images.colour_table(images.ERROR_COLOURS),
            "signed": images.colour_table(images.SIGNED_COLOURS),
            "value": images.colour_table(images.VALUE_COLOURS),
        },
        "mask": [images.MARKED, images.UNMARKED, images.UNCOUNTED, images.UNDETERMINED],
        "xyz": rgb_to_xyz(BT709).tolist(),
        "epsilon": LOG2_EPSILON,
    }


def best_exposures(metrics: dict[str, Summary]) -> dict[str, dict[str, float]]:
    """By metric: the factor on the textbook's image that lowers the mean most, and both means."""
    return {
        name: {
            "factor": found.after_exposure.exposure,
            "mean": found.mean,
            "after": found.after_exposure.mean,
        }
        for name, found in metrics.items()
    }


def region_view(region: Region) -> str:
    """The part of the address that shows and selects a region."""
    zoom = round(min(16.0, REGION_SIZE / max(region.width, region.height)), 2)
    x, y = region.x + region.width // 2, region.y + region.height // 2
    box = f"{region.x},{region.y},{region.width},{region.height}"
    return f"mode=error&zoom={zoom}&x={x}&y={y}&box={box}"
