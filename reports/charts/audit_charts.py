"""The charts of an audit: albedos, lobes, setting lights, and a map of reciprocity."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from math import cos, radians, sin
from typing import Any

import altair as alt

from comparisons.audit.audit_record import Audit, Curve
from reports.charts.theme import FAINT, Spec
from reports.charts.vega import specification

WIDTH, HEIGHT = 270, 210
"""Pixels of a plot: with its axis it fits a phone."""

HIGHEST = 2.5
"""End of the axis of albedos; curves above are clipped."""

INKS = ("#7a6fd0", "#2b93b8", "#3f9e5f", "#c9862a")
"""Colours of up to four lines, visible on light and dark grounds."""

DASHES = ([1, 0], [6, 3], [2, 2], [8, 2, 2, 2])

ANGLE = "angle from the normal (degrees)"

ALBEDOS = {"seen": "value seen", "returned": "share of the light returned"}
"""Fields of a curve, and the titles of their axes."""


def albedo_charts(record: Audit, field: str) -> Iterator[tuple[str, Spec]]:
    """Yield a chart of each kind of material, with its name: an albedo by angle and roughness.

    Parameters
    ----------
    record
        An audit.
    field
        One of :data:`ALBEDOS`.
    """
    for kind, curves in _by_kind(record.curves):
        yield kind, specification(_albedos(record, field, curves))


def albedo_chart(record: Audit) -> Spec:
    """Return one chart of all albedos: a row for each of :data:`ALBEDOS`, a column per kind."""
    charts = [
        _albedos(record, field, curves).properties(title=kind)
        for field in ALBEDOS
        for kind, curves in _by_kind(record.curves)
    ]
    grid = alt.concat(*charts, columns=len(charts) // len(ALBEDOS))
    own = grid.resolve_scale(color="independent", strokeDash="independent")
    return specification(own) | {"title": record.subject}


def _by_kind(curves: Iterable[Curve]) -> Iterator[tuple[str, list[Curve]]]:
    found: dict[str, list[Curve]] = {}
    for curve in curves:
        found.setdefault(curve.kind, []).append(curve)
    yield from found.items()


def _albedos(record: Audit, field: str, curves: Sequence[Curve]) -> alt.LayerChart:
    rows = [
        {"x": angle, "y": value, "of": "any" if curve.alpha is None else f"{curve.alpha:g}"}
        for curve in curves
        for angle, value in zip(record.angles, getattr(curve, field), strict=True)
    ]
    top = min(HIGHEST, 1.1 * max(1.0, *(row["y"] for row in rows)))
    lines = _lines(rows, "roughness α").encode(
        x=alt.X("x:Q", title=ANGLE).scale(domain=[0, 90], nice=False).axis(values=[0, 30, 60, 90]),
        y=alt.Y("y:Q", title=ALBEDOS[field]).scale(domain=[0, top], nice=False),
    )
    return _sized(_rule(y=1.0), lines)


def lobe_charts(record: Audit) -> Iterator[tuple[str, Spec]]:
    """Yield a chart of each material's lobes in polar form, with the material's name.

    A radius is ``pi f``; the half circle is a white diffuse surface.
    """
    for material, found in groupby(record.lobes, lambda lobe: lobe.material):
        rows = [
            {"x": value * sin(radians(view)), "y": value * cos(radians(view)), "angle": view,
             "of": f"{lobe.light:g}°"}
            for lobe in found
            for view, value in zip(record.views, lobe.values, strict=True)
        ]  # fmt: skip
        yield material, specification(_lobes(rows))


def _lobes(rows: list[dict[str, Any]]) -> alt.LayerChart:
    reach = 1.05 * max(1.0, *(max(abs(row["x"]), row["y"]) for row in rows))
    scale: dict[str, Any] = {"nice": False, "zero": False}

    def axis(channel: Any, low: float) -> Any:
        return channel.title(None).scale(domain=[low, reach], **scale).axis(tickCount=4)

    angles = [radians(step) for step in range(-90, 91, 5)]
    circle = [{"x": sin(angle), "y": cos(angle), "angle": angle} for angle in angles]
    diffuse = alt.Chart(alt.Data(values=circle)).mark_line(color=FAINT, strokeWidth=1)
    lobes = _lines(rows, "light at")
    layers = [
        each.encode(x=axis(alt.X("x:Q"), -reach), y=axis(alt.Y("y:Q"), 0), order="angle:Q")
        for each in (diffuse, lobes)
    ]
    return _sized(*layers, height=WIDTH // 2)


def sunset_charts(record: Audit) -> Iterator[tuple[str, Spec]]:
    """Yield a chart of each kind of material as the light sets, with the material's name."""
    for sunset in record.sunsets:
        pairs = zip(record.elevations, sunset.values, strict=True)
        rows = [{"x": x, "y": y, "of": ""} for x, y in pairs]
        title = "elevation of the light (degrees)"
        lines = _lines(rows, None).encode(
            x=alt.X("x:Q", title=title).scale(nice=False), y=alt.Y("y:Q", title="value seen")
        )
        yield sunset.material, specification(_sized(_rule(x=0.0), lines))


def asymmetry_chart(record: Audit) -> Spec:
    """Return the map of the relative difference of ``f(l, v)`` and ``f(v, l)``."""
    found = record.asymmetry
    rows = [
        {"light": light, "viewer": viewer, "difference": value}
        for light, row in zip(found.angles, found.differences, strict=True)
        for viewer, value in zip(found.angles, row, strict=True)
    ]

    def axis(channel: Any, whose: str) -> Any:
        made = channel(f"{whose}:O", title=f"{whose}’s angle from the normal (degrees)")
        return made.axis(values=[0, 20, 40, 60, 80], labelAngle=0)

    colour = alt.Color("difference:Q", title="relative difference").scale(
        scheme="viridis", domain=[0, 2]
    )
    chart = alt.Chart(alt.Data(values=rows)).mark_rect().encode(
        x=axis(alt.X, "light"), y=axis(alt.Y, "viewer").sort("descending"),
        color=colour.legend(orient="top", gradientLength=WIDTH),
    )  # fmt: skip
    return specification(chart.properties(width=WIDTH, height=WIDTH))


def _lines(rows: list[dict[str, Any]], title: str | None) -> alt.Chart:
    """Return lines told apart by colour and dash, with a legend if they have a title."""
    names = list(dict.fromkeys(row["of"] for row in rows))
    legend = alt.Legend(orient="top", symbolSize=300, symbolType="stroke")
    shown = legend if title and names != ["any"] else None
    colour, dash = (
        channel("of:N", title=title, sort=names, legend=shown,
                scale=alt.Scale(domain=names, range=list(styles[: len(names)])))
        for channel, styles in ((alt.Color, INKS), (alt.StrokeDash, DASHES))
    )  # fmt: skip
    chart = alt.Chart(alt.Data(values=rows)).mark_line(clip=True, strokeWidth=2)
    return chart.encode(color=colour, strokeDash=dash)


def _rule(**at: float) -> alt.Chart:
    places = {name: alt.datum(value) for name, value in at.items()}
    return (
        alt.Chart(alt.Data(values=[{}])).mark_rule(color=FAINT, strokeDash=[3, 3]).encode(**places)
    )


def _sized(*layers: alt.Chart, height: int = HEIGHT) -> alt.LayerChart:
    return alt.LayerChart(layer=list(layers), width=WIDTH, height=height)
