"""The chart of a study of cost: error against time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import log10
from typing import TYPE_CHECKING, Any, TypeAlias

import altair as alt
import numpy as np
from scipy.optimize import isotonic_regression

from fotismos.comparisons.departure.criterion import TOLERANCE
from fotismos.comparisons.records.engine import Engine, EngineCost
from fotismos.reports.charts.vega import FAINT, Spec, specification
from fotismos.reports.sentences import OWN_FRONT, stated
from fotismos.reports.terminal.words import number

if TYPE_CHECKING:  # pictures without a scene need no Mitsuba
    from fotismos.comparisons.records.cost import Cost

WIDTH = 560
HEIGHT = 380
"""Pixels of the plot, without the names to its right."""

LABEL_GAP = 15
LONGEST_NAME = 260
"""Least distance of two names, and the length at which one is cut, in pixels."""

LEAST_ERROR = 1e-3
"""ΔE2000; smaller errors are drawn at the lower border, since a logarithmic axis has no 0."""

MARKS = {
    "kernel": ("#c8601d", "square"),
    "phong BSDF": ("#8a74c9", "triangle-up"),
    "physical": ("#2f7fc1", "circle"),
    "given": ("#2c9a6a", "diamond"),
}
"""Colour and shape of each family; shapes tell families apart without colour.
Both are visible on light and dark grounds."""

Rows: TypeAlias = Sequence[dict[str, Any]]
Ends: TypeAlias = tuple[float, float]
"""Of an axis."""


def titled(record: Cost | EngineCost) -> Spec:
    """Return the chart of error against time with a title, on white."""
    size = f"{record.resolution[0]} × {record.resolution[1]} pixels"
    if isinstance(record, EngineCost):
        measured = size
    else:
        busy = ", busy" if record.is_busy else ""
        machine = f"{record.threads} threads, {record.machine.processor}{busy}"
        times = f", times at {record.at[0]} × {record.at[1]}" if record.at else ""
        measured = f"measured at {size}{times}, {record.rounds} rounds, {machine}"
    title = {
        "text": f"{record.scene}: error against time",
        "subtitle": [measured, *reading(record)],
    }
    chart = error_over_time(record, "white")
    return chart | {"title": title, "description": f"{title['text']}, of all methods"}


def error_over_time(record: Cost | EngineCost, ground: str = "transparent") -> Spec:
    """Return the chart of mean ΔE2000 over seconds, both logarithmic, on a ground of any colour.

    Points of the front are filled. Lines join the sample counts of one method. The dashed line is
    the slope −1/2 of plain Monte Carlo. The dotted line is the reference's own noise, below which
    errors are not resolved.
    """
    if isinstance(record, EngineCost):
        floor = record.noise_floor or 0.0
        rows = _given(record.engine)
    else:
        floor = record.reference.noise_floor
        rows = [*_measured(record), *(_given(record.engine) if record.engine else ())]
    times = _domain([row[end] for row in rows for end in ("fastest", "slowest")])
    errors = _domain([row["error"] for row in rows] + ([floor] if floor > 0 else []))
    colour = _by_family(alt.Color, 0)
    chart = _charted(rows, times, errors).encode(color=colour)
    layers = [
        *_slope(rows, times, errors),
        *([_guide([floor, floor], times, errors=errors, dash=[1, 3])] if floor > errors[0] else []),
        chart.mark_line(strokeWidth=1.2, opacity=0.75).encode(detail="method:N"),
        chart.mark_rule(strokeWidth=1.2, opacity=0.8).encode(x="fastest:Q", x2="slowest:Q"),
        chart.mark_point(size=55, strokeWidth=1.6, opacity=1).encode(
            shape=_by_family(alt.Shape, 1),
            fill=alt.condition("datum.front", colour, alt.value(ground)),
        ),
        chart.mark_point(size=260, shape="circle", strokeWidth=1).transform_filter("datum.right"),
    ]
    # Names may be wider in the reader's font than in the font of the picture.
    padding = {"left": 5, "right": 30, "top": 5, "bottom": 5}
    whole = alt.layer(*layers, *_names_beside(rows, times, errors))
    return specification(whole.properties(width=WIDTH, height=HEIGHT, padding=padding))


def reading(record: Cost | EngineCost) -> list[str]:
    """Return how to read the chart of error against time, in lines."""
    if isinstance(record, EngineCost):
        dotted = "; dotted: noise of the reference picture itself" if record.noise_floor else ""
        return [
            f"filled: front (nothing else is clearly faster or better){dotted}",
            stated(record.engine),
        ]
    sampled = any(method.monte_carlo for method in record.methods)
    slope = "dashed: slope −1/2, plain Monte Carlo; " if sampled else ""
    lines = [
        "filled: front (nothing else is clearly faster or better); bars: 95 % intervals of times",
        f"{slope}dotted: noise of the physical picture itself",
        f"passes at: what 5 % of the pixels exceed with most samples; circled: at {TOLERANCE:g}",
    ]
    if record.engine:
        lines.append(f"diamonds: given pictures, {stated(record.engine)}{OWN_FRONT}")
    return lines


def _measured(record: Cost) -> list[dict[str, Any]]:
    methods = {method.name: method for method in record.methods}
    return [
        {
            "method": point.method,
            "family": methods[point.method].family,
            "sampled": methods[point.method].monte_carlo,
            "time": 1e3 * point.seconds.value,
            # An interval may reach 0, which a logarithmic axis cannot show. Times are in ms.
            "fastest": 1e3 * max(point.seconds.low, point.seconds.value / 10),
            "slowest": 1e3 * point.seconds.high,
            "error": point.error.value,
            "passes": f"passes at {number(point.tolerance.value)}",
            "right": point.tolerance.high <= TOLERANCE,
            "front": point.front,
        }
        for point in record.points
    ]


def _given(engine: Engine) -> list[dict[str, Any]]:
    # Given times have no interval.
    return [
        {
            "method": setting.method,
            "family": "given",
            "sampled": False,
            "time": 1e3 * setting.seconds.value,
            "fastest": 1e3 * setting.seconds.low,
            "slowest": 1e3 * setting.seconds.high,
            "error": setting.error.value,
            "passes": _passing(setting.passes_at),
            "right": setting.passes_at is not None and setting.passes_at <= TOLERANCE,
            "front": setting.front,
        }
        for setting in engine.settings
    ]


def _passing(threshold: float | None) -> str:
    return "does not pass" if threshold is None else f"passes at {number(threshold)}"


def _by_family(channel: Callable[..., Any], column: int) -> Any:
    """Return a channel that tells families apart, by the colours (0) or shapes (1) of MARKS."""
    styles = [style[column] for style in MARKS.values()]
    return channel("family:N", legend=None, scale=alt.Scale(domain=list(MARKS), range=styles))


def _domain(values: Sequence[float]) -> Ends:
    """Return the ends of a logarithmic axis: room on both sides of the values."""
    low = max(min(values), LEAST_ERROR)
    high = max(max(values), LEAST_ERROR)
    room = 10 ** max(0.06 * log10(high / low), 0.05)
    return low / room, high * room


def _error(field: str, errors: Ends) -> Any:
    return _logarithmic(alt.Y(f"{field}:Q"), errors, "mean ΔE2000 (logarithmic)")


def _logarithmic(channel: Any, domain: Ends, title: str) -> Any:
    scaled = channel.scale(type="log", domain=domain, nice=False)
    return scaled.axis(format="~g", tickCount=6).title(title)


def _charted(rows: Sequence[Mapping[str, Any]], times: Ends, errors: Ends) -> alt.Chart:
    """Return a chart of rows over the two axes, without marks; an error of 0 is at the border."""
    data = alt.Data(values=[{**row, "shown": max(row["error"], errors[0])} for row in rows])
    x = _logarithmic(alt.X("time:Q"), times, "time for one image (ms, logarithmic)")
    return alt.Chart(data).encode(x=x, y=_error("shown", errors))


def _slope(rows: Rows, times: Ends, errors: Ends) -> list[alt.Chart]:
    """Return the line of slope −1/2 through the best point of any Monte Carlo method."""
    sampled = [row for row in rows if row["sampled"]]
    if not sampled:
        return []
    best = min(sampled, key=lambda row: row["error"])
    ends = [max(best["error"], errors[0]) * (time / best["time"]) ** -0.5 for time in times]
    return [_guide(ends, times, errors=errors, dash=[6, 4])]


def _guide(ends: Sequence[float], times: Ends, errors: Ends, dash: list[int]) -> alt.Chart:
    """Return a faint line between errors at both ends of the time axis."""
    rows = [{"time": time, "error": end} for time, end in zip(times, ends, strict=True)]
    chart = _charted(rows, times, errors)
    line: alt.Chart = chart.mark_line(
        color=FAINT, strokeWidth=1.2, strokeDash=dash, clip=True, aria=False
    )
    return line


def _names_beside(rows: Rows, times: Ends, errors: Ends) -> list[alt.Chart]:
    """Return names and where they pass, right of the plot, with lines to their slowest points."""
    low, high = errors
    last = {row["method"]: row for row in sorted(rows, key=lambda row: row["time"])}
    ordered = sorted(last.values(), key=lambda row: -row["error"])
    # Pixels from the top, in which `spread` works; `beside` is the way back to an error.
    heights = [HEIGHT * log10(high / max(row["error"], low)) / log10(high / low) for row in ordered]
    named = [
        {
            **row,
            "beside": high * (low / high) ** (y / HEIGHT),
            "name": f"{row['method']}, {row['passes']}",
        }
        for row, y in zip(ordered, spread(heights, LABEL_GAP, HEIGHT), strict=True)
    ]
    chart = _charted(named, times, errors)
    beside = _error("beside", errors)
    leading: Spec = {"color": "#9a9a9a", "strokeWidth": 0.7, "opacity": 0.6}
    return [
        # Level to the border, and only then to the names: such lines cross none of the others.
        chart.mark_rule(xOffset=6, **leading).encode(x2=alt.value(WIDTH)),
        chart.mark_rule(**leading).encode(
            x=alt.value(WIDTH), x2=alt.value(WIDTH + 18), y2="beside"
        ),
        chart.mark_text(align="left", fontSize=12, limit=LONGEST_NAME).encode(
            x=alt.value(WIDTH + 22), y=beside, text="name:N"
        ),
    ]


def spread(places: Sequence[float], gap: float, length: float) -> list[float]:
    """Move places on a line apart: at least ``gap`` between neighbours, in the same order.

    ``places`` are pixels in ascending order. Neighbours that would touch become a block around the
    mean of their places; blocks stay within ``[0, length]`` if they fit.
    """
    least = gap * np.arange(len(places))  # the room that the places before take
    # Without that room, places that are far enough apart are places that do not descend.
    moved = isotonic_regression(np.asarray(places) - least).x
    apart: list[float] = (np.clip(moved, 0, max(length - least[-1], 0)) + least).tolist()
    return apart
