"""The work of ``fotismos study``."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fotismos.comparisons.processes.pool import Pool, Task
from fotismos.comparisons.study import dataset, design, running
from fotismos.comparisons.study.design import StudyFile
from fotismos.reports.charts import study_charts, vega
from fotismos.reports.files import results
from fotismos.reports.files.results import hold_results, own
from fotismos.reports.jobs import command_line
from fotismos.reports.terminal import progress
from fotismos.reports.terminal.words import tell

if TYPE_CHECKING:
    import pyarrow as pa  # loaded late: it is an extra

FIGURES = "figures"


def run(pool: Pool, file: Path, output: Path, many: Callable[[int], Pool]) -> None:
    """Render the points of a study, and write its dataset and figures.

    ``pool`` lists the points, since scenes are read for that; ``many(tasks)`` renders them.
    """
    dataset.arrow()  # before anything is rendered
    chosen = design.read(file)
    with hold_results(output / "study", [(chosen.name, file)], command_line()) as (folder,):
        points = pool.do(Task(chosen.name, running.all_points, (chosen,)))
        # Its work is done, and the renderers get the cores and the memory.
        pool.end()
        tasks = len(points) // running.WORTH_A_PROCESS + 1
        for part in (folder / FIGURES, folder / running.POINTS):
            own(part)  # a study replaces only its own results
        with many(tasks) as renderers, progress.shown("points") as bar:
            table, done = running.run(chosen, folder, renderers, bar.of(chosen.name), points)
        places = write(chosen, table, folder)
    tell([*summary(chosen, table, done), ""])
    for path in places:
        click.echo(os.fsencode(path))


def write(study: StudyFile, table: pa.Table, folder: Path) -> tuple[Path, Path]:
    """Write dataset and figures, and return their places."""
    data = folder / f"{study.name}.parquet"
    figures = folder / FIGURES
    results.write(data, dataset.file_of(table))
    with_result = {row["part"] for row in table.to_pylist() if row["error"] is None}
    for figure in study_charts.all_figures(study):
        if figure.part in with_result:
            svg = vega.paper(study_charts.chart(figure, table, study))
            results.write(figures / f"{figure.name}.svg", svg)
    return data, figures


def summary(study: StudyFile, table: pa.Table, done: int) -> Iterator[str]:
    """Yield a line for each part: points, failures, and the range of the departure."""
    width = max(len(name) for name in ["part", *(part.name for part in study.parts)])
    yield f"{'part':<{width}}  points  failed  mean ΔE2000: least  median   most"
    rows = table.to_pylist()
    for part in study.parts:
        of_part = [row for row in rows if row["part"] == part.name]
        good = sorted(row["dE2000"] for row in of_part if row["error"] is None)
        line = f"{part.name:<{width}}  {len(of_part):>6}  {len(of_part) - len(good):>6}"
        if good:
            line += f"  {good[0]:>18.2f}  {good[len(good) // 2]:>6.2f}  {good[-1]:>5.2f}"
        yield line
    if done < len(rows):
        yield f"{len(rows) - done} points were kept from an earlier run, or are shared."
    for row in [row for row in rows if row["error"] is not None][:3]:
        yield f"failed: {row['part']}, point {row['point']}: {row['error']}"
