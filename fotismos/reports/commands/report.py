"""``fotismos report``: all built-in scenes in one report."""

from pathlib import Path
from typing import Any

import click

from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.reports import jobs

QUICK = {"resolution": (64, 64), "spp": 16}
"""The defaults of ``--quick``."""


@jobs.command()
@jobs.output_option("out/report")
@jobs.figures_option
@jobs.fresh_option
@jobs.process_options
@jobs.rendering_options
@jobs.option("colour_science")
@jobs.verbosity_options
@click.option("--quick", is_flag=True, help="Everything at a small size, in about a minute.")
@click.option(
    "--cost",
    "ladders",
    type=click.Choice(list(SCENES)),
    multiple=True,
    metavar="SCENE",
    help="Measure the error and time of methods in a scene, too; repeat it for more scenes.",
)
@jobs.open_option
@jobs.within_option
def report(
    output: Path,
    figures: bool,
    fresh: bool,
    timeout: float,
    workers: int | None,
    scheduler: str | None,
    quick: bool,
    ladders: tuple[str, ...],
    is_opened: bool,
    within: float,
    **rendering: Any,
) -> None:
    """Compare all built-in scenes, attribute their errors to effects, and write one report.

    Writes the files of `compare`; the page also has the hard cases. The page is written again after
    each scene.

    \b
    Examples:
      fotismos report
      fotismos report --cost cornell-box
      fotismos report --quick --open
      fotismos report --resolution 128x128 -o small --figures
    """  # noqa: D301 click reads the \b as: keep these lines
    if quick:
        rendering |= {name: rendering[name] or value for name, value in QUICK.items()}
    options = jobs.chosen_options(rendering)
    job = jobs.Job(
        options=options,
        figures=figures,
        with_causes=True,
        fresh=fresh,
        within=within,
        ladders=frozenset(ladders),
    )
    processes = jobs.pool(timeout, len(SCENES), workers=workers, scheduler=scheduler)
    jobs.work(
        "compare",
        processes,
        scenes=tuple(SCENES),
        output=output,
        job=job,
        max_visible=None,
        junit=None,
        summary_file=None,
        is_opened=is_opened,
        with_hard_cases=True,
    )
