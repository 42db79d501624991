"""``fotismos study``: how the error behaves over a space of scenes."""

from pathlib import Path

import click

from fotismos.reports import jobs


@jobs.command()
@click.argument("file", type=click.Path(path_type=Path), metavar="FILE.toml")
@jobs.output_option("out", "study/NAME")
@jobs.process_options
@jobs.verbosity_options
def study(
    file: Path, output: Path, workers: int | None, scheduler: str | None, timeout: float
) -> None:
    """Compare over a grid or a Sobol design of scenes: one dataset, and maps.

    FILE.toml says which parameters of which scenes vary. Writes a page, NAME.parquet, and figures,
    among them pictures over the parameters, to OUTPUT/study/NAME. Finished points are kept: the
    same command resumes a study that ended early.

    \b
    Examples:
      fotismos study studies/phong-roughplastic.toml
      fotismos study my_study.toml --workers 4
      fotismos study my_study.toml --scheduler tcp://head:8786 -o results
    """  # noqa: D301 click reads the \b as: keep these lines
    jobs.work(
        "study",
        jobs.pool(timeout),
        file=file,
        output=output,
        many=lambda tasks: jobs.pool(timeout, tasks, workers=workers, scheduler=scheduler),
    )
