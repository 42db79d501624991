"""The histogram of a metric as a chart: areas are shares of the pixels."""

from __future__ import annotations

import math
from typing import Any

from comparisons.comparison import ComparisonRecord
from comparisons.departure.histogram import Histogram
from comparisons.departure.metrics import METRICS
from comparisons.departure.statistics import Summary
from reports.charts import vega
from reports.terminal.printing import number, percent

#: Widths of the chart in pixels; the page scales it.
WIDTH, HEIGHT = 300, 130

#: Colour of the area (readable on light and dark grounds).
AREA = "#7d8fb3"

#: What is marked: key, word and dash.
MARKS = (("mean", "mean", [1, 0]), ("p95", "95 %", [5, 3]), ("noise_floor", "noise floor", [1, 3]))


def figures(record: ComparisonRecord) -> list[vega.Figure]:
    """The histograms of a record, where it has them and any pixel counts."""
    counted = record.pixels.counted
    if not counted:
        return []
    return [
        vega.figure(
            METRICS[name].label,
            spec(name, histogram, record.metrics[name], counted),
            note(histogram, counted),
        )
        for name, histogram in record.histograms.items()
    ]


def spec(name: str, histogram: Histogram, summary: Summary, counted: int) -> dict[str, Any]:
    """The Vega-Lite specification of a histogram of `comparison.json`.

    The axis is logarithmic and the height is the share of pixels a decade, so that equal areas
    are equal shares of pixels.

    name
        One of `comparisons.departure.metrics.METRICS`.
    counted
        Pixels in all.
    """
    bins = _densities(histogram, counted)
    top = max((row["density"] for row in bins), default=1.0) or 1.0
    shown = (histogram.low, 4 * histogram.high)  # room for the last label
    axis = {"type": "log", "domain": list(shown), "nice": False, "clamp": True}
    place = {
        "field": "value",
        "type": "quantitative",
        "scale": axis,
        "title": METRICS[name].label,
        "axis": {"values": [0.01, 0.1, 1, 10, 100, 1000], "format": "~g", "grid": False},
    }
    height = {
        "field": "density",
        "type": "quantitative",
        "scale": {"domain": [0, 1.45 * top], "nice": False},
        "title": "pixels a decade",
        "axis": {"format": ".0%", "tickCount": 3},
    }
    area = {
        "data": {"values": bins},
        "mark": {"type": "area", "interpolate": "step-after", "color": AREA, "tooltip": True},
        "encoding": {"x": place, "y": height},
    }
    return {
        "width": WIDTH,
        "height": HEIGHT,
        "layer": [area, *_marks(summary, place, shown[0], top)],
    }


def note(histogram: Histogram, counted: int) -> str:
    """What the chart leaves out, in words; empty where that is nothing."""
    parts = [
        f"{percent(count / counted)} of the pixels {side} {limit:g}"
        for count, side, limit in (
            (histogram.below, "under", histogram.low),
            (histogram.above, "at least", histogram.high),
        )
        if count
    ]
    return "Not shown: " + ", ".join(parts) + "." if parts else ""


def _densities(histogram, counted):
    """Lower edge and share of pixels a decade of each bin, and a closing zero."""
    low, counts = histogram.low, histogram.counts
    decades = math.log10(histogram.high / low) / len(counts)
    return [
        {"value": low * 10.0 ** (place * decades), "density": count / max(counted, 1) / decades}
        for place, count in enumerate([*counts, 0])
    ]


def _marks(summary, place, low, top):
    """A line and a label for each mark, in a row of its own: the further right, the lower.

    A line ends at its label's row and the label is to its right, so that nothing crosses.
    """
    marks = [(getattr(summary, name), word, dash) for name, word, dash in MARKS]
    marks = sorted(mark for mark in marks if mark[0] >= low)
    layers = []
    for row, (value, word, dash) in enumerate(marks):
        height = {"datum": (1.45 - 0.14 * row) * top, "type": "quantitative"}
        data = {"values": [{"value": value, "label": f"{word} {number(value)}"}]}
        line = {"type": "rule", "strokeDash": dash, "strokeWidth": 1.2}
        text = {"type": "text", "align": "left", "dx": 4, "baseline": "top"}
        layers += [
            {
                "data": data,
                "mark": line,
                "encoding": {"x": place, "y": {"datum": 0, "type": "quantitative"}, "y2": height},
            },
            {
                "data": data,
                "mark": text,
                "encoding": {"x": place, "y": height, "text": {"field": "label"}},
            },
        ]
    return layers
