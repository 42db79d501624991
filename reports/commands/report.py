"""``fotismos report``: all built-in scenes in one report."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import click

from comparisons.processes.pool import Task, Turn
from reports import jobs
from reports.commands.plan import verified
from reports.run import batch

if TYPE_CHECKING:
    from comparisons.hard_cases import HardCases
    from comparisons.options import Options

VERIFIED_AT = (64, 64)
"""Resolution at which a report verifies its plans."""

QUICK = {"resolution": (64, 64), "spp": 16}
"""The defaults of ``--quick``."""

QUICKLY_VERIFIED_AT = (32, 32)

HARD = "hard cases"

LADDERS = frozenset({"fig-6-10", "plastic-spheres", "cornell-box"})
"""Scenes of which methods are measured: a lobe on a mesh, shadows, and interreflection."""

VERIFIED_QUICKLY = slice(3, None, 4)
"""``--quick`` verifies one scene in four, from each group."""


@jobs.command()
@jobs.output_option("out/report")
@jobs.figures_option
@jobs.fresh_option
@jobs.process_options
@jobs.rendering_options
@jobs.option("colour_science")
@jobs.verbosity_options
@click.option("--quick", is_flag=True, help="Everything at a small size, in about a minute.")
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
    is_opened: bool,
    within: float,
    **rendering: Any,
) -> None:
    """Compare all built-in scenes, attribute their errors to effects, and write one report.

    Writes the files of `compare`; the page also has verified plans and the hard cases. The page is
    written again after each scene.

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
    names = [] if request.everything else list(SCENES)
    ladders = frozenset() if quick else LADDERS
    job = jobs.Job(request, figures, with_causes=True, fresh=fresh, within=within, ladders=ladders)
    rendered = jobs.pool(timeout, len(SCENES), workers, scheduler)
    further = _verified(output, names[VERIFIED_QUICKLY if quick else slice(None)], request, quick)
    batch.run(tuple(SCENES), output, job, rendered, further, jobs.open_page if is_opened else None)


def _verified(folder: Path, names: Sequence[str], request: Options, quick: bool) -> batch.Further:
    """Evaluate the hard cases, and compare the plans of scenes with everything simulated."""
    from comparisons.check.moved import level_of_each
    from comparisons.verification import LEVEL

    size = QUICKLY_VERIFIED_AT if quick else VERIFIED_AT
    small = request.changed(resolution=size, spp=None)
    level = level_of_each(LEVEL, len(names)) if names else None
    tasks = [  # the last scenes trace paths, which take longest
        Task(name, timed, (folder, verified, name, small, level)) for name in reversed(names)
    ]
    cases = Task(HARD, timed, (folder, hard_cases))

    def content(by_name: Mapping[str, Any]) -> dict[str, Any]:
        """Return the page's content of the results of tasks."""
        return {"verifications": [by_name[name] for name in names], "hard_cases": by_name[HARD]}

    return batch.Further("verification and hard cases", [cases, *tasks], content)


def timed(folder: Path, function: Callable[..., Any], *arguments: Any) -> tuple[Any, float]:
    """Return what a task returns, and the seconds that it took in its turn."""
    from reports.files import results

    with Turn(folder, folder / results.TABLES):
        begin = perf_counter()
        return function(*arguments), perf_counter() - begin


def hard_cases() -> HardCases:
    """Evaluate the hard cases."""
    from comparisons.hard_cases import collect

    return collect()
