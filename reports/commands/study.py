"""``fotismos study``: how the departure behaves over a space of scenes."""

import os
from contextlib import ExitStack
from pathlib import Path

import click

from reports import jobs
from reports.terminal import verbosity


@click.command()
@click.argument("file", type=click.Path(path_type=Path), metavar="FILE.toml")
@jobs.output_option("out", "study/NAME")
@click.option(
    "--processes",
    type=click.IntRange(min=1),
    metavar="N",
    help="Processes on this machine. [default: one per core]",
)
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    metavar="N",
    help="Start a Dask cluster of N worker processes on this machine.",
)
@jobs.scheduler_option
@click.option(
    "--findings",
    type=click.Path(path_type=Path),
    metavar="PAGE.md",
    help="Write the page that FILE.md.j2 describes, its figures next to it, and the dataset next"
    " to FILE.",
)
@jobs.timeout_option
@verbosity.quiet_option
@verbosity.verbose_option
def study(
    file: Path,
    output: Path,
    processes: int | None,
    workers: int | None,
    scheduler: str | None,
    findings: Path | None,
    timeout: float,
) -> None:
    """Compare over a grid or a random design of scenes: one dataset, and maps.

    FILE.toml says which parameters of which scenes vary. Writes NAME.parquet and figures/*.svg to
    OUTPUT/study/NAME. Finished points are kept: the same command resumes a study that ended early.

    \b
    Examples:
      fotismos study studies/phong-roughplastic.toml
      fotismos study my_study.toml --workers 4
      fotismos study my_study.toml --scheduler tcp://head:8786 -o results
    """  # noqa: D301 click reads the \b as: keep these lines
    given = [name for name in (processes, workers, scheduler) if name is not None]
    if len(given) > 1:
        raise click.UsageError("--processes, --workers and --scheduler exclude each other.")
    from comparisons.processes import cluster
    from comparisons.processes.pool import cores
    from comparisons.processes.worker import Task
    from comparisons.study import design, running
    from reports.run import study_files
    from reports.run.output import below, held
    from reports.run.places import assigned
    from reports.terminal import progress

    wanted = design.read(file)
    page = study_files.page(wanted, file, findings)
    with jobs.pool(timeout) as pool:
        blocks = pool.do(Task(wanted.name, running.all_blocks, (wanted,)))
    with held(output, jobs.command_line()) as held_folder:
        studies = below(held_folder, "study")
        (place,) = assigned(studies, [(wanted.name, file)])
        folder = study_files.prepare(wanted, studies / place)
        with ExitStack() as stack:
            if scheduler:
                needs_folder = any(part.reads_files for part in wanted.parts)
                ready = jobs.Ready.far_away() if needs_folder else jobs.Ready.among(1)
                elsewhere = cluster.connected(scheduler, ready)
                spread = running.workers_of(stack.enter_context(elsewhere))
            elif workers:
                of_ours = cluster.local(workers, jobs.Ready.among(workers))
                spread = running.workers_of(stack.enter_context(of_ours))
            else:
                count = (processes or cores()) if jobs.IN_PROCESSES else 0
                spread = running.processes(count, jobs.Ready.among, timeout)
            bar = stack.enter_context(progress.shown("points"))
            outcome = running.run(wanted, folder, spread, bar.of(wanted.name), blocks)
        places = list(study_files.write(wanted, outcome, folder, page))
    verbosity.tell([*study_files.summary(wanted, outcome), ""])
    for place in places:
        click.echo(os.fsencode(place))
