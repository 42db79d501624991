"""Charts as Vega-Lite specifications: plain dictionaries, which a page shows and vl-convert draws.

A specification carries its data and names no address, so that nothing is loaded.
"""

from math import log10

from reports.charts.labels import LABEL_GAP, label, rule, spread

SCHEMA = "https://vega.github.io/schema/vega-lite/v5.json"

WIDTH, HEIGHT = 560, 380
"""Pixels of the plot itself; names stand to its right."""

LEAST_ERROR = 1e-3
"""ΔE2000: smaller ones are drawn at the lower border, since a logarithmic axis has no 0."""

MARKS = {
    "kernel": ("#c8601d", "square"),
    "phong BSDF": ("#8a74c9", "triangle-up"),
    "physical": ("#2f7fc1", "circle"),
}
"""Colour and shape of each family; the shape tells them apart without colour.
Each is seen on white and on a dark ground."""

FAINT = "#8a8a8a"


def error_over_time(record):
    """Return the chart of a ``Cost``: mean ΔE2000 over seconds, both logarithmic.

    It stands alone, with a title and a white ground; :func:`plot` is what a page shows.
    """
    return plot(record, ground="white") | {
        "$schema": SCHEMA,
        "description": f"Error against time of the methods on {record.scene}",
        "title": {
            "text": f"{record.scene}: error against time",
            "subtitle": [f"{size(record)}, {machine(record)}", *reading(record)],
            "anchor": "start",
        },
        "config": {
            "font": "sans-serif",
            "background": "white",
            "axis": {"labelFontSize": 12, "titleFontSize": 13, "gridColor": "#e4e4e4"},
            "title": {"fontSize": 15, "subtitleFontSize": 12, "subtitleColor": "#555555"},
            "view": {"stroke": "#bbbbbb"},
        },
    }


def plot(record, ground="transparent"):
    """Return the plot of a record without a title, on a ground of any colour.

    Points of the Pareto front are filled. Lines join the sample counts of one rung. The dashed line
    is the slope −1/2 of plain Monte Carlo; the dotted one the reference's own noise, below which
    nothing can be told.
    """
    families = {rung.name: rung.family for rung in record.rungs}
    points = [_row(point, families[point.rung]) for point in record.points]
    floor = record.reference.noise_floor
    times = [point[bound] for point in points for bound in ("low", "high")]
    errors = [point["error"] for point in points] + ([floor] if floor > 0 else [])
    x = _Axis(min(times), max(times), WIDTH)
    lowest = max(min(errors), LEAST_ERROR)
    y = _Axis(lowest, max(lowest, *errors), HEIGHT, flipped=True)
    for point in points:
        point["shown"] = max(point["error"], y.low)
    layers = [
        *_slope(points, x, y),
        *_floor(floor, y),
        _lines(points, x, y),
        _symbols(points, x, y, ground),
        *_names(points, x, y),
    ]
    # Names may be wider in the reader's font than where the picture is drawn.
    padding = {"left": 5, "right": 30, "top": 5, "bottom": 5}
    return {"width": WIDTH, "height": HEIGHT, "padding": padding, "layer": layers}


def size(record):
    """Say how large the images were, and how often each was rendered."""
    width, height = record.resolution
    return f"{width} × {height} pixels, {record.rounds} rounds"


def machine(record):
    """Say what machine the times are of."""
    return f"{record.machine.cores} cores, {record.machine.processor}"


def reading(record):
    """Return how to read the chart, in lines."""
    sampled = _sampled([point.rung for point in record.points])
    slope = "dashed: slope −1/2, plain Monte Carlo; " if sampled else ""
    return [
        "filled: Pareto front (nothing else is as fast and as good); bars: interval of the median",
        f"{slope}dotted: noise of the reference itself",
    ]


class _Axis:
    """A logarithmic axis with room at both ends: its domain, and the pixels of its values."""

    def __init__(self, low, high, length, flipped=False):
        room = max(0.06 * log10(high / low), 0.05)
        self.low, self.high = low * 10**-room, high * 10**room
        self.length, self.flipped = length, flipped

    def pixel(self, value):
        share = log10(value / self.low) / log10(self.high / self.low)
        return self.length * (1 - share if self.flipped else share)

    def scale(self):
        return {"type": "log", "domain": [self.low, self.high], "nice": False}


def _row(point, family):
    return {
        "rung": point.rung,
        "family": family,
        "spp": point.spp,
        "time": point.seconds.median * 1e3,
        "low": point.seconds.low * 1e3,
        "high": point.seconds.high * 1e3,
        "error": point.error,
        "front": point.pareto,
    }


def _lines(points, x, y):
    return {
        "data": {"values": points},
        "mark": {"type": "line", "strokeWidth": 1.2, "opacity": 0.75},
        "encoding": _encoding(x, y) | {"detail": {"field": "rung"}, "color": _colour()},
    }


def _symbols(points, x, y, ground):
    symbol = {
        "mark": {"type": "point", "size": 55, "strokeWidth": 1.6, "opacity": 1},
        "encoding": _encoding(x, y)
        | {
            "color": _colour(),
            "shape": {
                "field": "family",
                "legend": None,
                "scale": {"domain": list(MARKS), "range": [shape for _, shape in MARKS.values()]},
            },
            "fill": {
                "condition": {"test": "datum.front", **_colour()},
                "value": ground,
            },
            "tooltip": [
                {"field": "rung", "title": "method"},
                {"field": "spp", "title": "samples a pixel"},
                {"field": "time", "title": "time (ms)", "format": ".3~g"},
                {"field": "error", "title": "mean ΔE2000", "format": ".3~g"},
            ],
        },
    }
    interval = {
        "mark": {"type": "rule", "strokeWidth": 1.2, "opacity": 0.8},
        "encoding": {
            "x": {"field": "low", "type": "quantitative", "scale": x.scale()},
            "x2": {"field": "high"},
            "y": _encoding(x, y)["y"],
            "color": _colour(),
        },
    }
    return {"data": {"values": points}, "layer": [interval, symbol]}


def _encoding(x, y):
    return {
        "x": {
            "field": "time",
            "type": "quantitative",
            "scale": x.scale(),
            "title": "time for one image (ms, logarithmic)",
            "axis": {"format": "~g", "tickCount": 6},
        },
        "y": {
            "field": "shown",
            "type": "quantitative",
            "scale": y.scale(),
            "title": "mean ΔE2000 to the reference (logarithmic)",
            "axis": {"format": "~g", "tickCount": 6},
        },
    }


def _colour():
    return {
        "field": "family",
        "type": "nominal",
        "legend": None,
        "scale": {"domain": list(MARKS), "range": [colour for colour, _ in MARKS.values()]},
    }


def _slope(points, x, y):
    """Return the line of slope −1/2 through the best point of any Monte Carlo rung."""
    names = _sampled([point["rung"] for point in points])
    sampled = [point for point in points if point["rung"] in names]
    if not sampled:
        return []
    last = min(sampled, key=lambda point: point["error"])

    def at(error):
        return last["time"] * (last["error"] / error) ** 2

    begin, end = max(x.low, at(y.high)), min(x.high, at(y.low))
    a, b = (
        (x.pixel(time), y.pixel(last["error"] * (time / last["time"]) ** -0.5))
        for time in (begin, end)
    )
    return [rule(a, b, color=FAINT, strokeWidth=1.2, strokeDash=[6, 4])]


def _sampled(rungs):
    """Return the rungs that have points at several sample counts."""
    return {rung for rung in rungs if rungs.count(rung) > 1}


def _floor(floor, y):
    if floor <= y.low:
        return []
    place = y.pixel(floor)
    return [rule((0, place), (WIDTH, place), color=FAINT, strokeWidth=1.2, strokeDash=[1, 3])]


def _names(points, x, y):
    """Return the rungs' names beside the plot, apart from each other, with lines to their points.

    Each name belongs to its rung's slowest point.
    """
    last = {}
    for point in sorted(points, key=lambda p: p["time"]):
        last[point["rung"]] = point
    ordered = sorted(last.values(), key=lambda p: y.pixel(p["shown"]))
    places = spread([y.pixel(p["shown"]) for p in ordered], LABEL_GAP, HEIGHT)
    layers = []
    for point, place in zip(ordered, places, strict=True):
        start = x.pixel(point["time"]) + 6, y.pixel(point["shown"])
        layers += [
            rule(start, (WIDTH + 10, place), color="#9a9a9a", strokeWidth=0.7, opacity=0.6),
            label(point["rung"], WIDTH + 14, place),
        ]
    return layers
