"""A study: its points rendered, its dataset, figures and page."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fotismos.comparisons.processes.pool import Pool, Task
from fotismos.comparisons.study import dataset, design, running
from fotismos.comparisons.study.dataset import Row
from fotismos.comparisons.study.design import StudyFile
from fotismos.comparisons.study.running import StudyPoint
from fotismos.comparisons.study.sheet import sheet_of
from fotismos.reports.charts import study_charts, vega
from fotismos.reports.files import results
from fotismos.reports.files.results import PAGE, hold_results, own
from fotismos.reports.jobs import Terminal, command_line
from fotismos.reports.page.templating import head, rendered
from fotismos.reports.terminal import progress
from fotismos.reports.terminal.table import Table, printed
from fotismos.reports.terminal.words import tell

if TYPE_CHECKING:
    import pyarrow as pa  # loaded late: it is an extra

FIGURES = "figures"


def show(pool: Pool, file: Path, terminal: Terminal) -> None:
    """Render the points of a study, and write its dataset and figures.

    ``pool`` lists the points, since scenes are read for that; others then render them.
    """
    dataset.arrow()  # before anything is rendered
    chosen = design.read(file)
    dataset.check_figures(chosen)
    study_charts.check_charts(chosen)
    with hold_results(terminal.output / "study", [(chosen.name, file)], command_line()) as (
        folder,
    ):
        points = pool.do(Task(chosen.name, running.all_points, (chosen,)))
        # Its work is done, and the renderers get the cores and the memory.
        pool.end()
        tasks = len(points) // running.WORTH_A_PROCESS + 1
        for part in (folder / FIGURES, folder / running.POINTS):
            own(part)  # a study replaces only its own results
        with terminal.pool(tasks) as pool, progress.shown(pool, "points") as shown:
            table, done = running.run(chosen, folder, shown, points)
        written = write(chosen, table, points, folder)
    tell([*summary(chosen, table, done), ""])
    for path in written:
        click.echo(os.fsencode(path))


def write(
    study: StudyFile, table: pa.Table, points: list[StudyPoint], folder: Path
) -> tuple[Path, ...]:
    """Write dataset, figures, contact sheets and page, and return their places."""
    data = folder / f"{study.name}.parquet"
    results.write(data, dataset.file_of(table))
    rows = table.to_pylist()
    with_result = {row["part"] for row in rows if row["error"] is None}
    figures = []
    for figure in study_charts.all_figures(study):
        if figure.part in with_result:
            spec = study_charts.chart(figure, table, study)
            results.write(folder / FIGURES / f"{figure.name}.svg", vega.paper(spec))
            figures.append(vega.figure(figure.title, spec))
    sheets = {}
    for part in study.parts:
        layout = sheet_of(part)
        pictures = running.kept_pictures([p for p in points if p.part.name == part.name], folder)
        if layout and pictures:
            sheets[part.name] = study_charts.contact_sheet(part, layout, pictures)
            results.write(folder / FIGURES / f"sheet-{part.name}.webp", sheets[part.name])
    html = rendered(
        "study.html.j2",
        title=study.title,
        head=head("study", folder),
        ranges=_ranges(study, rows),
        sheets=sheets,
        figures=figures,
        command=command_line(),
    )
    results.write(folder / PAGE, html)
    return data, folder / FIGURES, folder / PAGE


def _ranges(study: StudyFile, rows: Sequence[Row]) -> Table:
    """Return the table of parts: points, failed ones, least, median and most error."""
    ranges: list[tuple[str, ...]] = [
        ("part", "points", "failed", "mean ΔE2000: least", "median", "most")
    ]
    for part in study.parts:
        of_part = [row for row in rows if row["part"] == part.name]
        good = sorted(row["dE2000"] for row in of_part if row["error"] is None)
        errors = ["–", "–", "–"]
        if good:
            errors = [f"{error:.2f}" for error in (good[0], good[len(good) // 2], good[-1])]
        ranges.append((part.name, f"{len(of_part)}", f"{len(of_part) - len(good)}", *errors))
    return Table.of(ranges)


def summary(study: StudyFile, table: pa.Table, done: int) -> Iterator[str]:
    """Yield a line for each part: points, failures, and the range of the error."""
    rows = table.to_pylist()
    yield from printed(_ranges(study, rows))
    if done < len(rows):
        yield f"{len(rows) - done} points were kept from an earlier run, or are shared."
    for row in [row for row in rows if row["error"] is not None][:3]:
        yield f"failed: {row['part']}, point {row['point']}: {row['error']}"
