"""Predicted error over predicted time of each method at a size, with bands, as a chart."""

from typing import Any

import altair as alt

from comparisons.cost.cost_record import Cost, Forecast, Prediction, Seen
from reports.charts.error_over_time import (
    LEAST_ERROR,
    by_family,
    charted,
    domain,
    layered,
    names_beside,
    tooltips,
)
from reports.charts.theme import Spec


def prediction_chart(record: Cost, ground: str = "transparent") -> Spec:
    """Return the chart of a study with a prediction: curves, bands, and measured points."""
    families = {rung.name: rung.family for rung in record.rungs}
    found = _prediction(record)
    rows = [_row(forecast, families[forecast.method]) for forecast in found.forecasts]
    seen = [_seen(f.method, f.measured, families[f.method]) for f in found.forecasts if f.measured]
    times = domain([row[end] for row in rows for end in ("fastest", "slowest")])
    errors = domain([max(row[end], LEAST_ERROR) for row in rows for end in ("low", "high")])
    for row in (*rows, *seen):
        row["shown"] = max(row["error"], errors[0])
    for row in rows:
        row["low"] = max(row["low"], errors[0])
    colour = by_family(alt.Color, 0)
    curves = charted(rows, times, errors).encode(color=colour)
    layers = [
        curves.mark_area(opacity=0.18).encode(y="low:Q", y2="high:Q", detail="rung:N"),
        curves.mark_line(strokeWidth=1.4).encode(detail="rung:N"),
        curves.mark_rule(strokeWidth=1, opacity=0.35).encode(x="fastest:Q", x2="slowest:Q"),
        curves.mark_point(size=18, filled=True, opacity=0.9).encode(tooltip=tooltips()),
        *names_beside(rows, times, errors),
    ]
    if seen:
        measured = charted(seen, times, errors).encode(color=colour)
        layers.append(measured.mark_point(shape="cross", size=90, fill=ground, strokeWidth=1.5))
    return layered(layers)


def _prediction(record: Cost) -> Prediction:
    assert record.prediction is not None, "the chart is of a study with --at"
    return record.prediction


def standing_alone(record: Cost) -> Spec:
    """Return the chart with a title, on white."""
    found = _prediction(record)
    width, height = found.resolution
    subtitle = [
        f"fitted to {', '.join('x'.join(map(str, size)) for size in found.fitted)};"
        f" {record.machine.cores} cores, {record.machine.processor}",
        reading(record),
    ]
    title = {
        "text": f"{record.scene}: predicted at {width} × {height} pixels",
        "subtitle": subtitle,
    }
    return prediction_chart(record, "white") | {"title": title}


def reading(record: Cost) -> str:
    """Return how to read the chart, in a line."""
    found = _prediction(record)
    level = f"{found.level:.0%}"
    crosses = any(forecast.measured for forecast in found.forecasts)
    said = f"bands and strokes: {level} intervals of error and time; points: powers of 2 samples"
    return f"{said}; crosses: measured" if crosses else said


def _row(forecast: Forecast, family: str) -> dict[str, Any]:
    return {
        "rung": forecast.method,
        "family": family,
        "spp": forecast.spp,
        "time": forecast.seconds.value * 1e3,
        "fastest": forecast.seconds.low * 1e3,
        "slowest": forecast.seconds.high * 1e3,
        "error": forecast.error.value,
        "low": forecast.error.low,
        "high": forecast.error.high,
    }


def _seen(method: str, measured: Seen, family: str) -> dict[str, Any]:
    return {
        "rung": method,
        "family": family,
        "time": measured.seconds.median * 1e3,
        "error": measured.error,
    }
