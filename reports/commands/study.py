"""``fotismos study``: how the departure behaves over a space of scenes."""

import os
from pathlib import Path

import click

from fotismos.reports import jobs
from fotismos.reports.terminal.words import tell


@jobs.command()
@click.argument("file", type=click.Path(path_type=Path), metavar="FILE.toml")
@jobs.output_option("out", "study/NAME")
@jobs.process_options
@jobs.verbosity_options
def study(
    file: Path, output: Path, workers: int | None, scheduler: str | None, timeout: float
) -> None:
    """Compare over a grid or a Sobol design of scenes: one dataset, and maps.

    FILE.toml says which parameters of which scenes vary. Writes NAME.parquet and figures/*.svg to
    OUTPUT/study/NAME. Finished points are kept: the same command resumes a study that ended early.

    \b
    Examples:
      fotismos study studies/phong-roughplastic.toml
      fotismos study my_study.toml --workers 4
      fotismos study my_study.toml --scheduler tcp://head:8786 -o results
    """  # noqa: D301 click reads the \b as: keep these lines
    # Here, because start-up needs neither Mitsuba nor SciPy.
    from fotismos.comparisons.processes.pool import Task
    from fotismos.comparisons.study import design, running
    from fotismos.reports.files.results import hold_results, own
    from fotismos.reports.run import study_files
    from fotismos.reports.terminal import progress

    chosen = design.read(file)
    with hold_results(output / "study", [(chosen.name, file)], jobs.command_line()) as (folder,):
        with jobs.pool(timeout) as pool:
            points = pool.do(Task(chosen.name, running.all_points, (chosen,)))
        tasks = len(points) // running.WORTH_A_PROCESS + 1
        for part in (folder / study_files.FIGURES, folder / running.POINTS):
            own(part)  # a study replaces only its own results
        with jobs.pool(timeout, tasks, workers, scheduler) as pool, progress.shown("points") as bar:
            table, done = running.run(chosen, folder, pool, bar.of(chosen.name), points)
        places = study_files.write(chosen, table, folder)
    tell([*study_files.summary(chosen, table, done), ""])
    for path in places:
        click.echo(os.fsencode(path))
