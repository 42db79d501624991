"""The files of an audit: its record, its page with a chart of the lobes; and its lines."""

from collections.abc import Iterator
from math import cos, radians, sin
from pathlib import Path
from typing import Any

import altair as alt

from comparisons.audit.checks import Audit, Checked
from heuristic.heuristics import in_file
from reference import records
from reports.charts import vega
from reports.charts.theme import FAINT, Spec
from reports.files import results
from reports.page.templating import rendered
from reports.terminal import tables
from reports.terminal.words import number

WIDTH = 270
"""Pixels of a plot: with its axis it fits a phone."""

INKS = ("#7a6fd0", "#2b93b8", "#3f9e5f", "#b8862b", "#d06f6f")
DASHES = ([1, 0], [6, 3], [2, 2], [9, 2, 2, 2], [4, 1])
"""Colours and dashes of lines by light or viewer, visible on light and dark grounds."""


SHOWN = (0.0, 60.0, 80.0, 120.0, 180.0)
"""Angles from which the furnace is drawn over roughness; above 90 from behind."""


def furnace(record: Audit) -> Spec:
    """Return the chart of the white furnace: over ``alpha`` if it was varied, else over the angle.

    The faint lines are single-scattering GGX, white, of the same ``alpha``.
    """
    varied = [curve for curve in record.curves if curve.alpha]
    rows = [
        {"x": curve.alpha or angle, "y": seen, "single": single,
         "of": f"{angle:g}°" if varied else "", "kind": curve.material.partition(",")[0]}
        for curve in varied or record.curves
        for angle, seen, single in zip(
            record.angles, curve.seen, curve.single_scattering or curve.seen, strict=True
        )
        if angle in SHOWN or not varied
    ]  # fmt: skip
    x = alt.X("x:Q").title("alpha" if varied else "viewer’s angle").scale(nice=False)
    lines = alt.Chart().encode(x=x, **_styled(rows, "viewer at"))
    faint = lines.mark_line(strokeWidth=1).encode(y="single:Q", color=alt.value(FAINT))
    layers = [faint, lines.mark_line().encode(y=alt.Y("y:Q").title("seen"))]
    chart = alt.LayerChart(layer=layers, width=WIDTH, height=WIDTH // 2, data=alt.Data(values=rows))
    kinds = alt.Row("kind:N", sort=None, title=None, header=alt.Header(labelAnchor="start"))
    return vega.specification(chart.facet(row=kinds).resolve_scale(y="independent"))


def lobes(record: Audit) -> Spec:
    """Return the chart: a radius is ``pi f``; the half circle is a white diffuse surface."""
    charts = []
    for curve in record.curves:
        rows = [
            {"x": value * sin(radians(view)), "y": value * cos(radians(view)), "angle": view,
             "of": f"{light:g}°"}
            for light, lobe in zip(record.lights, curve.lobes, strict=False)
            for view, value in zip(record.views, lobe, strict=True)
        ]  # fmt: skip
        if rows:
            charts.append(_chart(rows).properties(title=curve.material))
    return vega.specification(alt.vconcat(*charts))


def _chart(rows: list[dict[str, Any]]) -> alt.LayerChart:
    reach = 1.05 * max(1.0, *(max(abs(row["x"]), abs(row["y"])) for row in rows))
    low = -reach if min(row["y"] for row in rows) < 0 else 0

    def axis(channel: Any, low: float) -> Any:
        scale = alt.Scale(domain=[low, reach], nice=False, zero=False)
        return channel.title(None).scale(scale).axis(tickCount=4)

    angles = [radians(step) for step in range(-90, 91, 5)]
    circle = [{"x": sin(angle), "y": cos(angle), "angle": angle} for angle in angles]
    diffuse = alt.Chart(alt.Data(values=circle)).mark_line(color=FAINT, strokeWidth=1)
    lines = alt.Chart(alt.Data(values=rows)).mark_line(clip=True, strokeWidth=2)
    lines = lines.encode(**_styled(rows, "light at"))
    layers = [
        each.encode(x=axis(alt.X("x:Q"), -reach), y=axis(alt.Y("y:Q"), low), order="angle:Q")
        for each in (diffuse, lines)
    ]
    return alt.LayerChart(layer=layers, width=WIDTH, height=WIDTH if low else WIDTH // 2)


def _styled(rows: list[dict[str, Any]], title: str) -> dict[str, Any]:
    """Return colour and dashes of lines by what they are ``of``."""
    names = list(dict.fromkeys(row["of"] for row in rows))
    legend = alt.Legend(orient="top", symbolSize=300, symbolType="stroke")

    def style(channel: Any, styles: Any) -> Any:
        scale = alt.Scale(domain=names, range=list(styles))
        shown = legend if len(names) > 1 else None
        return channel("of:N", title=title, sort=names, legend=shown, scale=scale)

    return {"color": style(alt.Color, INKS), "strokeDash": style(alt.StrokeDash, DASHES)}


def write(place: Path, record: Audit) -> None:
    """Write ``audit.svg``, ``index.html`` and ``audit.json`` to a folder; the record comes last."""
    results.own(place)
    results.write(place / "audit.svg", vega.paper(lobes(record)))
    results.write(place / results.PAGE, render(record))
    results.write(place / "audit.json", records.to_json(record))


def render(record: Audit) -> str:
    """Return the page of an audit: one file, without scripts."""
    return rendered(
        "audit.html.j2",
        title=headline(record),
        record=record,
        found=value_of,
        lobes=vega.figure("Lobes", lobes(record)),
        furnace=vega.figure("White furnace", furnace(record)),
    )


# --- On a terminal ---------------------------------------------------------------------------


def headline(record: Audit) -> str:
    """Return the subject with its parameters, and which checks failed."""
    name = record.subject
    if place := in_file(name):
        file = Path(place[0]).name
        name = f"{place[1]} ({file})" if place[1] else file
    title = ", ".join([name, *(f"{key} {value}" for key, value in record.parameters.items())])
    failed = [check.name for check in record.checks if check.verdict == "does not hold"]
    if not failed:
        return f"{title}: all checks hold"
    return f"{title}: {', '.join(failed)} {'does' if len(failed) == 1 else 'do'} not hold"


def value_of(check: Checked) -> str:
    """Return the value of a check; a count has no decimals."""
    value = check.value
    return f"{value:g}" if value is not None and value == int(value) else number(value)


def lines(record: Audit) -> Iterator[str]:
    """Yield the lines of an audit."""
    yield headline(record)
    yield ""
    rows = [
        (check.name, check.verdict, value_of(check), check.expected, check.worst)
        for check in record.checks
    ]
    yield from tables.printed([("check", "verdict", "found", "expected", "worst case"), *rows])
    if record.mistakes:
        yield from ("", *record.mistakes)
