"""Charts of a study of cost: error against time, its prediction, and what each effect removes."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from math import log10
from typing import Any, TypeAlias

import altair as alt
import numpy as np
from scipy.optimize import isotonic_regression

from comparisons.cost.cost_record import Cost, Measured, Method, Prediction, Seconds
from reports.charts.theme import EFFECT_COLOURS, FAINT, Spec
from reports.charts.vega import specification

WIDTH, HEIGHT = 560, 380
"""Pixels of the plot, without the names to its right."""

LABEL_GAP = 15
"""Least distance of two names, in pixels."""

LEAST_ERROR = 1e-3
"""ΔE2000; smaller errors are drawn at the lower border, since a logarithmic axis has no 0."""

MARKS = {
    "kernel": ("#c8601d", "square"),
    "phong BSDF": ("#8a74c9", "triangle-up"),
    "physical": ("#2f7fc1", "circle"),
}
"""Colour and shape of each family; shapes tell families apart without colour.
Both are visible on light and dark grounds."""

Rows: TypeAlias = Sequence[dict[str, Any]]
Ends: TypeAlias = tuple[float, float]
"""Of an axis."""


def titled(record: Cost) -> Spec:
    """Return the chart of error against time with a title, on white."""
    width, height = record.resolution
    subtitle = [f"{width} × {height} pixels, {record.rounds} rounds, {_machine(record)}"]
    title = {"text": f"{record.scene}: error against time", "subtitle": subtitle + reading(record)}
    description = f"Error against time of the methods on {record.scene}"
    return error_over_time(record, "white") | {"title": title, "description": description}


def _machine(record: Cost) -> str:
    return f"{record.machine.cores} cores, {record.machine.processor}"


def error_over_time(record: Cost, ground: str = "transparent") -> Spec:
    """Return the chart of mean ΔE2000 over seconds, both logarithmic, on a ground of any colour.

    Points of the Pareto front are filled. Lines join the sample counts of one method. The dashed
    line is the slope −1/2 of plain Monte Carlo. The dotted line is the reference's own noise, below
    which errors are not resolved.
    """
    methods = {method.name: method for method in record.methods}
    rows = [_row(point, methods[point.method]) for point in record.points]
    floor = record.reference.noise_floor
    times = _domain([row[bound] for row in rows for bound in ("fastest", "slowest")])
    errors = _domain([row["error"] for row in rows] + ([floor] if floor > 0 else []))
    for row in rows:
        row["shown"] = max(row["error"], errors[0])
    colour = _by_family(alt.Color, 0)
    chart = _charted(rows, times, errors).encode(color=colour)
    layers = [
        *_slope(rows, times, errors),
        *([_guide([floor, floor], times, errors, [1, 3])] if floor > errors[0] else []),
        chart.mark_line(strokeWidth=1.2, opacity=0.75).encode(detail="method:N"),
        chart.mark_rule(strokeWidth=1.2, opacity=0.8).encode(
            x=_time("fastest", times), x2="slowest"
        ),
        chart.mark_point(size=55, strokeWidth=1.6, opacity=1).encode(
            shape=_by_family(alt.Shape, 1),
            fill=alt.condition("datum.front", colour, alt.value(ground)),
        ),
    ]
    return _layered(layers, rows, times, errors)


def prediction_chart(record: Cost, prediction: Prediction) -> Spec:
    """Return the chart of a prediction with a title, on white: curves, bands, measured points."""
    width, height = prediction.resolution
    fitted = ", ".join("x".join(map(str, size)) for size in prediction.fitted)
    says = (
        f"bands and strokes: {prediction.level:.0%} intervals of error and time; points: powers of"
        " 2 samples"
    )
    families = {method.name: method.family for method in record.methods}
    rows: list[dict[str, Any]] = []
    measured: list[dict[str, Any]] = []
    for one in prediction.forecasts:
        own = {"method": one.method, "family": families[one.method]}
        error = {"error": one.error.mean, "low": one.error.low, "high": one.error.high}
        rows.append(own | _milliseconds(one.seconds) | error)
        if point := one.measured:
            measured.append(own | _milliseconds(point.seconds) | {"error": point.error.mean})
    x = _domain([row[end] for row in rows for end in ("fastest", "slowest")])
    # An interval down to 0 would take all the room of a logarithmic axis.
    y = _domain([each for row in rows for each in (max(row["low"], row["error"] / 4), row["high"])])
    for row in (*rows, *measured):
        row["shown"] = max(row["error"], y[0])
    for row in rows:
        row["low"] = max(row["low"], y[0])
    colour = _by_family(alt.Color, 0)
    curves = _charted(rows, x, y).encode(color=colour)
    layers = [
        curves.mark_area(opacity=0.18).encode(y="low:Q", y2="high:Q", detail="method:N"),
        curves.mark_line(strokeWidth=1.4).encode(detail="method:N"),
        curves.mark_rule(strokeWidth=1, opacity=0.35).encode(x="fastest:Q", x2="slowest:Q"),
        curves.mark_point(size=18, filled=True, opacity=0.9),
    ]
    if measured:
        says += "; crosses: measured"
        crosses = _charted(measured, x, y).encode(color=colour)
        layers.append(crosses.mark_point(shape="cross", size=90, fill="white", strokeWidth=1.5))
    title = {
        "text": f"{record.scene}: predicted at {width} × {height} pixels",
        "subtitle": [f"fitted to {fitted}; {_machine(record)}", says],
    }
    return _layered(layers, rows, x, y) | {"title": title}


def attribution_chart(record: Cost) -> Spec:
    """Return the chart of the attribution: ΔE2000 removed by each effect, as bars.

    Rules are 95 % intervals. The circle and the stroke show the ΔE2000 removed if the effect is
    added first and last.
    """
    rows = [
        {
            "effect": one.effect,
            "removes": one.removes.value,
            "low": one.removes.low,
            "high": one.removes.high,
            "alone": one.alone,
            "last": one.last,
        }
        for one in record.attribution.effects
    ]
    names = [one.effect for one in record.attribution.effects]
    colours = alt.Scale(domain=names, range=[EFFECT_COLOURS[name] for name in names])
    chart = alt.Chart(alt.Data(values=rows)).encode(
        y=alt.Y("effect:N", sort=None, title=None).axis(labelLimit=200, ticks=False, domain=False)
    )

    def x(name: str) -> alt.X:
        return alt.X(f"{name}:Q", title="mean ΔE2000 that it removes")

    removed = alt.Color("effect:N", legend=None, scale=colours)
    layers = alt.layer(
        chart.mark_bar(size=13).encode(x=x("removes"), color=removed),
        chart.mark_rule(strokeWidth=1.5).encode(x=x("low"), x2="high"),
        chart.mark_point(filled=False, size=45, shape="circle").encode(x=x("alone")),
        chart.mark_point(filled=False, size=160, shape="stroke", angle=90).encode(x=x("last")),
    )
    padding = {"left": 30, "right": 5, "top": 5, "bottom": 5}
    return specification(layers.properties(width=340, height=alt.Step(30), padding=padding))


def reading(record: Cost) -> list[str]:
    """Return how to read the chart of error against time, in lines."""
    sampled = any(method.monte_carlo for method in record.methods)
    slope = "dashed: slope −1/2, plain Monte Carlo; " if sampled else ""
    return [
        "filled: Pareto front (nothing else is as fast and as good); bars: interval of the median",
        f"{slope}dotted: noise of the reference itself",
    ]


def _row(point: Measured, method: Method) -> dict[str, Any]:
    return {
        "method": point.method,
        "family": method.family,
        "sampled": method.monte_carlo,
        "spp": point.spp,
        **_milliseconds(point.seconds),
        "error": point.error.mean,
        "front": point.pareto,
    }


def _milliseconds(seconds: Seconds) -> dict[str, Any]:
    ends = {"time": seconds.value, "fastest": seconds.low, "slowest": seconds.high}
    return {name: 1e3 * each for name, each in ends.items()}


def _layered(layers: Iterable[alt.Chart], rows: Rows, times: Ends, errors: Ends) -> Spec:
    """Return the specification of layers over the two axes, with the methods' names beside them."""
    # Names may be wider in the reader's font than in the font of the picture.
    padding = {"left": 5, "right": 30, "top": 5, "bottom": 5}
    whole = alt.layer(*layers, *_names_beside(rows, times, errors))
    return specification(whole.properties(width=WIDTH, height=HEIGHT, padding=padding))


def _by_family(channel: Callable[..., Any], place: int) -> Any:
    """Return a channel that tells families apart, by the colours (0) or shapes (1) of MARKS."""
    styles = [style[place] for style in MARKS.values()]
    return channel("family:N", legend=None, scale=alt.Scale(domain=list(MARKS), range=styles))


def _domain(values: Sequence[float]) -> Ends:
    """Return the ends of a logarithmic axis: room on both sides of the values."""
    low, high = max(min(values), LEAST_ERROR), max(*values, LEAST_ERROR)
    room = 10 ** max(0.06 * log10(high / low), 0.05)
    return low / room, high * room


def _time(field: str, times: Ends) -> Any:
    return _logarithmic(alt.X(f"{field}:Q"), times, "time for one image (ms, logarithmic)")


def _error(field: str, errors: Ends) -> Any:
    return _logarithmic(alt.Y(f"{field}:Q"), errors, "mean ΔE2000 to the reference (logarithmic)")


def _logarithmic(channel: Any, domain: Ends, title: str) -> Any:
    scaled = channel.scale(type="log", domain=domain, nice=False)
    return scaled.axis(format="~g", tickCount=6).title(title)


def _charted(rows: Sequence[Mapping[str, Any]], times: Ends, errors: Ends) -> alt.Chart:
    """Return a chart of rows over the two axes, without marks."""
    data = alt.Data(values=rows)
    return alt.Chart(data).encode(x=_time("time", times), y=_error("shown", errors))


def _slope(rows: Rows, times: Ends, errors: Ends) -> list[alt.Chart]:
    """Return the line of slope −1/2 through the best point of any Monte Carlo method."""
    sampled = [row for row in rows if row["sampled"]]
    if not sampled:
        return []
    best = min(sampled, key=lambda row: row["shown"])
    ends = [best["shown"] * (time / best["time"]) ** -0.5 for time in times]
    return [_guide(ends, times, errors, [6, 4])]


def _guide(ends: Sequence[float], times: Ends, errors: Ends, dash: list[int]) -> alt.Chart:
    """Return a faint line between errors at both ends of the time axis."""
    rows = [{"time": time, "shown": end} for time, end in zip(times, ends, strict=True)]
    style: Spec = {"color": FAINT, "strokeWidth": 1.2, "strokeDash": dash, "clip": True}
    style["aria"] = False
    return _charted(rows, times, errors).mark_line(**style)


def _names_beside(rows: Rows, times: Ends, errors: Ends) -> list[alt.Chart]:
    """Return the methods' names to the right of the plot, with lines to their slowest points."""
    low, high = errors
    last = {row["method"]: row for row in sorted(rows, key=lambda row: row["time"])}
    ordered = sorted(last.values(), key=lambda row: -row["shown"])
    heights = [HEIGHT * log10(high / row["shown"]) / log10(high / low) for row in ordered]
    named = [
        {**row, "beside": high * (low / high) ** (place / HEIGHT)}
        for row, place in zip(ordered, spread(heights, LABEL_GAP, HEIGHT), strict=True)
    ]
    chart, beside = _charted(named, times, errors), _error("beside", errors)
    leading: Spec = {"color": "#9a9a9a", "strokeWidth": 0.7, "opacity": 0.6, "xOffset": 6}
    return [
        chart.mark_rule(**leading).encode(x2=alt.value(WIDTH + 10), y2="beside"),
        chart.mark_text(align="left", fontSize=12).encode(
            x=alt.value(WIDTH + 14), y=beside, text="method:N"
        ),
    ]


def spread(places: Sequence[float], gap: float, length: float) -> list[float]:
    """Move places on a line apart: at least ``gap`` between neighbours, in the same order.

    ``places`` are pixels in ascending order. Neighbours that would touch become a block around the
    mean of their places; blocks stay within ``[0, length]`` if they fit.
    """
    least = gap * np.arange(len(places))  # the room that the places before take
    moved = isotonic_regression(np.asarray(places) - least).x
    return (np.clip(moved, 0, max(length - least[-1], 0)) + least).tolist()
