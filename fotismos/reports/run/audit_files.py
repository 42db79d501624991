"""The files of an audit: its record, its page with a chart of the lobes; and its lines."""

from collections.abc import Iterator, Mapping
from math import cos, radians, sin
from pathlib import Path
from typing import Any

import altair as alt

from fotismos.comparisons.audit.checks import Audit, Kind, audit_with_subject, spheres
from fotismos.comparisons.case import RGB
from fotismos.heuristic import plugins
from fotismos.heuristic.convention import Floats
from fotismos.reference import records
from fotismos.reference.scene.graph import set_variant
from fotismos.reports.charts import vega
from fotismos.reports.charts.vega import FAINT, Spec
from fotismos.reports.files import results
from fotismos.reports.files.images import tonemap, webp
from fotismos.reports.page.templating import head, rendered
from fotismos.reports.sentences import of_audit
from fotismos.reports.terminal.table import Column, Table, printed
from fotismos.reports.terminal.words import number

WIDTH = 270
"""Pixels of a plot: with its axis it fits a phone."""

INKS = ("#7a6fd0", "#2b93b8", "#3f9e5f", "#b8862b", "#d06f6f")
DASHES = ([1, 0], [6, 3], [2, 2], [9, 2, 2, 2], [4, 1])
"""Colours and dashes of lines by light or viewer, visible on light and dark grounds."""

SHOWN = (0.0, 60.0, 80.0, 120.0, 180.0)
"""Viewer's angles of the furnace over roughness; above 90 from behind."""

Rows = list[dict[str, Any]]
"""Points of lines, in their order: ``x``, ``y`` and what the line is ``of``."""


def audited(
    kind: Kind,
    name: str,
    parameters: dict[str, Any],
    command: str,
    target: Path,
    like: str | None = None,
) -> Audit:
    """Audit a heuristic or a BSDF, and write the audit's files."""
    set_variant(RGB)
    plugins.register()
    record, subject = audit_with_subject(
        kind, name, parameters=parameters, command=command, like=like
    )
    shown = [curve.material for curve in record.curves if curve.lobes]
    write(target, record, spheres(subject, shown))
    return record


def furnace(record: Audit) -> Spec:
    """Return the chart of the white furnace: over ``alpha`` if it was varied, else over the angle.

    The faint lines are single-scattering GGX, white, of the same ``alpha``.
    """
    varied = [curve for curve in record.curves if curve.alpha]
    kinds: dict[str, tuple[Rows, Rows]] = {}
    for curve in varied or record.curves:
        lines = kinds.setdefault(curve.material.partition(",")[0], ([], []))
        for angle, *values in zip(
            record.angles, curve.seen, curve.single_scattering or curve.seen, strict=True
        ):
            # Over alpha there is a line for each angle, over the angle only one.
            at, of = (curve.alpha, f"{angle:g}°") if varied else (angle, "")
            for rows, value in zip(lines, values, strict=True):
                if not varied or angle in SHOWN:
                    rows.append({"x": at, "y": value, "of": of})
    x = alt.X("x:Q").title("alpha" if varied else "viewer’s angle").scale(nice=False)
    y = alt.Y("y:Q").title("seen")
    charts = {
        kind: _chart(rows, faint, of="viewer at", x=x, y=y) for kind, (rows, faint) in kinds.items()
    }
    return _charts(charts)


def lobes(record: Audit) -> Spec:
    """Return the chart: a radius is ``pi f``; the half circle is a white diffuse surface."""
    charts = {}
    circle = [{"x": sin(at), "y": cos(at), "of": ""} for at in map(radians, range(-90, 91, 5))]
    for curve in record.curves:
        rows: Rows = [
            {"x": value * sin(radians(view)), "y": value * cos(radians(view)), "of": f"{light:g}°"}
            for light, lobe in zip(record.lights, curve.lobes, strict=False)
            for view, value in zip(record.views, lobe, strict=True)
        ]
        if rows:
            farthest = max(max(abs(row["x"]), abs(row["y"])) for row in rows)
            reach = 1.05 * max(1.0, farthest)
            low = -reach if min(row["y"] for row in rows) < 0 else 0
            shown = {"tickCount": 4}
            x = alt.X("x:Q", axis=shown).title(None).scale(domain=[-reach, reach], nice=False)
            y = alt.Y("y:Q", axis=shown).title(None).scale(domain=[low, reach], nice=False)
            chart = _chart(rows, circle, of="light at", x=x, y=y)
            # Half as high if nothing points down, so that circles stay round.
            charts[curve.material] = chart.properties(height=WIDTH if low else WIDTH // 2)
    return _charts(charts)


def _charts(charts: dict[str, Any]) -> Spec:
    titled = (chart.properties(title=title) for title, chart in charts.items())
    return vega.specification(alt.vconcat(*titled))


def _chart(rows: Rows, faint: Rows, of: str, x: alt.X, y: alt.Y) -> alt.LayerChart:
    names = list(dict.fromkeys(row["of"] for row in rows))
    legend = alt.Legend(orient="top", symbolSize=300, symbolType="stroke")

    def style(channel: Any, styles: Any) -> Any:
        scale = alt.Scale(domain=names, range=list(styles))
        shown = legend if len(names) > 1 else None
        return channel("of:N", title=of, sort=names, legend=shown, scale=scale)

    def line(rows: Rows, width: int, colour: Any) -> alt.Chart:
        # Vega-Lite joins points by x; `order` lets a curve turn back.
        points = alt.Data(values=[row | {"order": order} for order, row in enumerate(rows)])
        dashes = style(alt.StrokeDash, DASHES)
        chart: alt.Chart = alt.Chart(points).mark_line(clip=True, strokeWidth=width)
        chart = chart.encode(x=x, y=y, order="order:Q", strokeDash=dashes, color=colour)
        return chart

    below = line(faint, 1, alt.value(FAINT))
    above = line(rows, 2, style(alt.Color, INKS))
    return alt.LayerChart(layer=[below, above], width=WIDTH, height=WIDTH // 2)


def write(folder: Path, record: Audit, pictures: Mapping[str, Floats]) -> None:
    """Write ``audit.svg``, ``index.html`` and ``audit.json`` to a folder; the record comes last."""
    results.own(folder)
    results.write(folder / "audit.svg", vega.paper(lobes(record)))
    results.write(folder / results.PAGE, render(record, folder, pictures))
    results.write(folder / "audit.json", records.to_json(record))


def render(
    record: Audit, folder: Path | None = None, pictures: Mapping[str, Floats] | None = None
) -> str:
    """Return the page of an audit in a folder, with linear pictures by material; no scripts."""
    return rendered(
        "audit.html.j2",
        title=of_audit(record),
        head=head("audit", folder),
        record=record,
        checks=Table(CHECKS, record.checks),
        spheres={name: webp(tonemap(picture)) for name, picture in (pictures or {}).items()},
        lobes=vega.figure("Lobes", lobes(record)),
        furnace=vega.figure("White furnace", furnace(record)),
    )


# --- On a terminal ---------------------------------------------------------------------------


def _counted(value: float) -> str:
    """Return the value of a check; a count has no decimals."""
    return f"{value:g}" if value == int(value) else number(value)


CHECKS = (
    Column("check", "name"),
    Column("verdict", "verdict"),
    Column("found", "value", _counted),
    Column("expected", "expected"),
    Column("worst case", "worst"),
)
"""The table of checks."""


def lines(record: Audit) -> Iterator[str]:
    """Yield the lines of an audit."""
    yield of_audit(record)
    yield ""
    yield from printed(Table(CHECKS, record.checks))
    if record.mistakes:
        yield from ("", *record.mistakes)
