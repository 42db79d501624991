"""The histogram of a metric as a chart: areas are shares of the pixels."""

from __future__ import annotations

import math
from typing import Any

from comparisons.comparison import ComparisonRecord
from comparisons.departure.metrics import METRICS
from comparisons.departure.statistics import Histogram, Summary
from reports.charts.theme import Spec
from reports.terminal.words import number

#: Size of the chart in pixels; the page scales it.
WIDTH, HEIGHT = 300, 130

#: Colour of the area, visible on light and dark grounds.
AREA = "#7d8fb3"

#: The marks: word, and dash of the line.
MARKS = {
    "mean": ("mean", [1, 0]),
    "p95": ("95 %", [5, 3]),
    "noise_floor": ("noise floor", [1, 3]),
}

#: A mark's line from the axis to its row, and the text to its right.
LINE: Spec = {
    "mark": {"type": "rule", "strokeWidth": 1.2},
    "encoding": {
        "y2": {"datum": 0},
        "strokeDash": {"field": "dash", "type": "nominal", "scale": None},
    },
}
TEXT: Spec = {
    "mark": {"type": "text", "align": "left", "dx": 4, "baseline": "top"},
    "encoding": {"text": {"field": "label"}},
}


def specs(record: ComparisonRecord) -> dict[str, Spec]:
    """The specifications of a record's histograms, by metric; empty if no pixel counts."""
    counted = record.pixels.counted
    return {
        name: spec(name, histogram, record.metrics[name], counted)
        for name, histogram in record.histograms.items()
        if counted
    }


def spec(name: str, histogram: Histogram, summary: Summary, counted: int) -> Spec:
    """The Vega-Lite specification of a histogram of `comparison.json`.

    The axis is logarithmic, the bins have equal ratios, and the height is the share of the pixels
    in each: equal areas are equal shares.
    """
    bins = _shares(histogram, counted)
    top = max(row["share"] for row in bins) or 1.0
    domain = [histogram.low, 4 * histogram.high]  # room for the last label
    x: Spec = {"field": "value", "type": "quantitative", "title": METRICS[name].label}
    x["scale"] = {"type": "log", "domain": domain, "nice": False, "clamp": True}
    x["axis"] = {"values": [0.01, 0.1, 1, 10, 100, 1000], "format": "~g", "grid": False}
    y: Spec = {"field": "share", "type": "quantitative", "title": "share of pixels"}
    y["scale"] = {"domain": [0, 1.45 * top], "nice": False}
    y["axis"] = {"format": ".0%", "tickCount": 3}
    area = {"type": "area", "interpolate": "step-after", "color": AREA, "tooltip": True}
    layer: list[Spec] = [{"data": {"values": bins}, "mark": area}]
    if marks := _marks(summary, histogram.low, top):
        layer.append({"data": {"values": marks}, "layer": [LINE, TEXT]})
    return {"width": WIDTH, "height": HEIGHT, "encoding": {"x": x, "y": y}, "layer": layer}


def _shares(histogram: Histogram, counted: int) -> list[dict[str, float]]:
    """Each bin's lower edge and share of the pixels, and a closing zero."""
    low, counts = histogram.low, histogram.counts
    decades = math.log10(histogram.high / low) / len(counts)
    return [
        {"value": _short(low * 10.0 ** (place * decades)), "share": _short(count / max(counted, 1))}
        for place, count in enumerate([*counts, 0])
    ]


def _marks(summary: Summary, low: float, top: float) -> list[dict[str, Any]]:
    """A line and a label for each mark, each in its own row: the further right, the lower.

    A line ends at its label's row, and the label is to its right, so nothing crosses.
    """
    marks = sorted((getattr(summary, name), *style) for name, style in MARKS.items())
    return [
        {"value": value, "label": f"{word} {number(value)}", "dash": dash}
        | {"share": (1.45 - 0.14 * row) * top}
        for row, (value, word, dash) in enumerate(mark for mark in marks if mark[0] >= low)
    ]


def _short(value: float) -> float:
    """A number with more digits than a chart shows, and no more."""
    return float(f"{value:.5g}")
