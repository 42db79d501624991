"""``fotismos report``: all built-in scenes in one report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from comparisons.processes.pool import Pool
from comparisons.processes.worker import Task
from reports import jobs, opening
from reports.run import batch, tasks
from reports.terminal import verbosity

if TYPE_CHECKING:
    from comparisons.case import Request
    from comparisons.hard.collection import HardCases
    from comparisons.verification import Verification
    from reports.run.stages import Run
    from reports.terminal.progress import Bar

VERIFIED_AT = (64, 64)
"""Resolution at which a report verifies its plans."""

QUICK = {"resolution": (64, 64), "spp": 16}
"""The defaults of ``--quick``."""

QUICKLY_VERIFIED_AT = (32, 32)


@click.command()
@jobs.output_option("out/report")
@jobs.figures_option
@jobs.fresh_option
@jobs.timeout_option
@jobs.all_workers_option
@jobs.scheduler_option
@jobs.rendering_options
@verbosity.quiet_option
@verbosity.verbose_option
@click.option("--quick", is_flag=True, help="Everything at a small size, in a minute or two.")
@opening.option
def report(
    output: Path,
    figures: bool,
    fresh: bool,
    timeout: float,
    workers: int | None,
    scheduler: str | None,
    quick: bool,
    is_opened: bool,
    **rendering: Any,
) -> None:
    """Compare all built-in scenes, price their effects, and write one report.

    Writes the files of `compare`; the page also has verified plans, the hard cases and the index of
    equations. The page appears after some seconds, with all scenes at a small size, and is written
    again as they are refined.

    \b
    Examples:
      fotismos report
      fotismos report --quick --open
      fotismos report --resolution 128x128 -o small --figures
    """  # noqa: D301 click reads the \b as: keep these lines
    from comparisons.gallery.builtin import SCENES

    if quick:
        rendering |= {name: rendering[name] or value for name, value in QUICK.items()}
    request = jobs.request(rendering)

    def more(pool: Pool, run: Run, bar: Bar) -> dict[str, Any]:
        from heuristic import equations

        names = [] if request.everything else list(SCENES)
        with run.timing("verification and hard cases"):
            cases, verifications = _verified(pool, bar, names, request, quick)
        return {
            "verifications": verifications,
            "hard_cases": cases,
            "equations": equations.index(),
        }

    wanted = batch.Wanted(request, figures, not quick, with_cost=True, fresh=fresh)
    rendered = jobs.pool(timeout, workers, scheduler)
    batch.run(tuple(SCENES), output, wanted, rendered, more, opening.seen(is_opened))


def _verified(
    pool: Pool, bar: Bar, names: Sequence[str], request: Request, quick: bool
) -> tuple[HardCases, list[Verification]]:
    """Evaluate the hard cases, and compare the plan of each scene with everything simulated."""
    from comparisons.check.moved import level_of_each
    from comparisons.verification import LEVEL

    size = QUICKLY_VERIFIED_AT if quick else VERIFIED_AT
    small = replace(request, resolution=size, spp=None)
    level = level_of_each(LEVEL, len(names)) if names else None
    verified = (
        Task(name, tasks.verified, (name, small, level, not quick), bar.of(name)) for name in names
    )
    found = {}
    bar.begin("verification and hard cases", 1 + len(names), batch.MORE)
    for task, outcome in pool.each(chain([Task("hard cases", tasks.hard_cases, ())], verified)):
        found[task.name] = outcome.result()
        bar.over(task.progress)
    return found["hard cases"], [found[name] for name in names]
