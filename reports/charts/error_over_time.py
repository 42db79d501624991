"""Error against time of the methods of a study of cost, as a chart."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from math import log10
from typing import Any, TypeAlias

import altair as alt
import numpy as np
from scipy.optimize import isotonic_regression

from comparisons.cost.cost_record import Cost, Measured, Rung
from reports.charts.theme import FAINT, Spec
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

Rows: TypeAlias = Sequence[Mapping[str, Any]]
Ends: TypeAlias = tuple[float, float]
"""Of an axis."""


def error_over_time(record: Cost) -> Spec:
    """Return the specification of the chart: mean ΔE2000 over seconds, both logarithmic.

    It has a title and a white ground; a page shows :func:`plot`.
    """
    (width, height), machine = record.resolution, record.machine
    subtitle = [
        f"{width} × {height} pixels, {record.rounds} rounds, {machine.cores} cores,"
        f" {machine.processor}",
        *reading(record),
    ]
    title = {"text": f"{record.scene}: error against time", "subtitle": subtitle}
    description = f"Error against time of the methods on {record.scene}"
    return plot(record, "white") | {"title": title, "description": description}


def plot(record: Cost, ground: str = "transparent") -> Spec:
    """Return the specification of the plot without a title, on a ground of any colour.

    Points of the Pareto front are filled. Lines join the sample counts of one rung. The dashed line
    is the slope −1/2 of plain Monte Carlo. The dotted line is the reference's own noise, below
    which errors are not resolved.
    """
    rungs = {rung.name: rung for rung in record.rungs}
    rows = [_row(point, rungs[point.rung]) for point in record.points]
    floor = record.reference.noise_floor
    times = domain([row[bound] for row in rows for bound in ("low", "high")])
    told = [row["error"] for row in rows] + ([floor] if floor > 0 else [])
    errors = domain([max(error, LEAST_ERROR) for error in told])
    for row in rows:
        row["shown"] = max(row["error"], errors[0])
    layers = [
        *_slope(rows, times, errors),
        *_floor(floor, times, errors),
        *_points(rows, times, errors, ground),
        *names_beside(rows, times, errors),
    ]
    return layered(layers)


def layered(layers: Iterable[alt.Chart]) -> Spec:
    """Return the specification of a chart of layers over the two axes."""
    # Names may be wider in the reader's font than in the font of the picture.
    padding = {"left": 5, "right": 30, "top": 5, "bottom": 5}
    return specification(alt.layer(*layers).properties(width=WIDTH, height=HEIGHT, padding=padding))


def by_family(channel: Callable[..., Any], place: int) -> Any:
    """Return a channel that tells families apart, by the colours (0) or shapes (1) of MARKS."""
    styles = [style[place] for style in MARKS.values()]
    return channel("family:N", legend=None, scale=alt.Scale(domain=list(MARKS), range=styles))


def tooltips() -> list[alt.Tooltip]:
    """Return the tooltip of a point."""
    return [
        alt.Tooltip("rung:N", title="method"),
        alt.Tooltip("spp:Q", title="samples per pixel"),
        alt.Tooltip("time:Q", title="time (ms)", format=".3~g"),
        alt.Tooltip("error:Q", title="mean ΔE2000", format=".3~g"),
    ]


def reading(record: Cost) -> list[str]:
    """Return how to read the chart, in lines."""
    sampled = any(rung.monte_carlo for rung in record.rungs)
    slope = "dashed: slope −1/2, plain Monte Carlo; " if sampled else ""
    return [
        "filled: Pareto front (nothing else is as fast and as good); bars: interval of the median",
        f"{slope}dotted: noise of the reference itself",
    ]


def _row(point: Measured, rung: Rung) -> dict[str, Any]:
    return {
        "rung": point.rung,
        "family": rung.family,
        "sampled": rung.monte_carlo,
        "spp": point.spp,
        "time": point.seconds.median * 1e3,
        "low": point.seconds.low * 1e3,
        "high": point.seconds.high * 1e3,
        "error": point.error,
        "front": point.pareto,
    }


def domain(values: Sequence[float]) -> Ends:
    """Return the ends of a logarithmic axis: room on both sides of the values."""
    low, high = min(values), max(values)
    room = 10 ** max(0.06 * log10(high / low), 0.05)
    return low / room, high * room


def _time(field: str, times: Ends) -> Any:
    return _logarithmic(alt.X(f"{field}:Q"), times, "time for one image (ms, logarithmic)")


def _error(field: str, errors: Ends) -> Any:
    return _logarithmic(alt.Y(f"{field}:Q"), errors, "mean ΔE2000 to the reference (logarithmic)")


def _logarithmic(channel: Any, domain: Ends, title: str) -> Any:
    scaled = channel.scale(type="log", domain=domain, nice=False)
    return scaled.axis(format="~g", tickCount=6).title(title)


def charted(rows: Rows, times: Ends, errors: Ends) -> alt.Chart:
    """Return a chart of rows over the two axes, without marks."""
    data = alt.Data(values=rows)
    return alt.Chart(data).encode(x=_time("time", times), y=_error("shown", errors))


def _points(rows: Rows, times: Ends, errors: Ends, ground: str) -> list[alt.Chart]:
    """Return the lines of the rungs, and their points with intervals and tooltips."""
    colour = by_family(alt.Color, 0)
    chart = charted(rows, times, errors).encode(color=colour)
    return [
        chart.mark_line(strokeWidth=1.2, opacity=0.75).encode(detail="rung:N"),
        chart.mark_rule(strokeWidth=1.2, opacity=0.8).encode(x=_time("low", times), x2="high"),
        chart.mark_point(size=55, strokeWidth=1.6, opacity=1).encode(
            shape=by_family(alt.Shape, 1),
            fill=alt.condition("datum.front", colour, alt.value(ground)),
            tooltip=tooltips(),
        ),
    ]


def _slope(rows: Rows, times: Ends, errors: Ends) -> list[alt.Chart]:
    """Return the line of slope −1/2 through the best point of any Monte Carlo rung."""
    sampled = [row for row in rows if row["sampled"]]
    if not sampled:
        return []
    best = min(sampled, key=lambda row: row["shown"])
    ends = [best["shown"] * (time / best["time"]) ** -0.5 for time in times]
    return [_guide(ends, times, errors, [6, 4])]


def _floor(floor: float, times: Ends, errors: Ends) -> list[alt.Chart]:
    return [_guide([floor, floor], times, errors, [1, 3])] if floor > errors[0] else []


def _guide(ends: Sequence[float], times: Ends, errors: Ends, dash: list[int]) -> alt.Chart:
    """Return a faint line between errors at both ends of the time axis."""
    rows = [{"time": time, "shown": end} for time, end in zip(times, ends, strict=True)]
    style: Spec = {"color": FAINT, "strokeWidth": 1.2, "strokeDash": dash, "clip": True}
    style["aria"] = False
    return charted(rows, times, errors).mark_line(**style)


def names_beside(rows: Rows, times: Ends, errors: Ends) -> list[alt.Chart]:
    """Return the rungs' names to the right of the plot, with lines to their slowest points."""
    low, high = errors
    last = {row["rung"]: row for row in sorted(rows, key=lambda row: row["time"])}
    ordered = sorted(last.values(), key=lambda row: -row["shown"])
    wanted = [HEIGHT * log10(high / row["shown"]) / log10(high / low) for row in ordered]
    places = spread(wanted, LABEL_GAP, HEIGHT)
    named = [
        {**row, "beside": high * (low / high) ** (place / HEIGHT)}
        for row, place in zip(ordered, places, strict=True)
    ]
    chart, beside = charted(named, times, errors), _error("beside", errors)
    leading: Spec = {"color": "#9a9a9a", "strokeWidth": 0.7, "opacity": 0.6, "xOffset": 6}
    return [
        chart.mark_rule(**leading).encode(x2=alt.value(WIDTH + 10), y2="beside"),
        chart.mark_text(align="left", fontSize=12).encode(
            x=alt.value(WIDTH + 14), y=beside, text="rung:N"
        ),
    ]


def spread(wanted: Sequence[float], gap: float, length: float) -> list[float]:
    """Move places on a line apart: at least ``gap`` between neighbours, in the same order.

    ``wanted`` are pixels in ascending order. Neighbours that would touch become a block around the
    mean of their places; blocks stay within ``[0, length]`` if they fit.
    """
    least = gap * np.arange(len(wanted))  # the room that the places before take
    moved = isotonic_regression(np.asarray(wanted) - least).x
    return (np.clip(moved, 0, max(length - least[-1], 0)) + least).tolist()
