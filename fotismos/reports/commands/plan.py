"""``fotismos plan``: which effects a scene needs."""

from typing import Any

import click

from fotismos.reports import jobs
from fotismos.reports.terminal.words import verbose_option


@jobs.command()
@jobs.scene_argument
@jobs.json_option
@click.option(
    "--within",
    type=jobs.Within(min=0, min_open=True),
    metavar="ERROR",
    help="Measure the methods of `cost`, and name the fastest that passes: at most 5 % of its"
    " pixels exceed this ΔE2000.",
)
@jobs.timeout_option
@jobs.scene_options
@verbose_option
def plan(scene: str, as_json: bool, within: float | None, timeout: float, **rendering: Any) -> None:
    """List the effects that a scene needs, the rule for each, and what will be simulated.

    With --within, the exit code is 1 if no measured method passes.

    \b
    Examples:
      fotismos plan cornell-box
      fotismos plan --within 5 cornell-box
    """  # noqa: D301 click reads the \b as: keep these lines
    code = jobs.work(
        "plan",
        jobs.pool(timeout),
        scene=scene,
        options=jobs.chosen_options(rendering),
        within=within,
        as_json=as_json,
    )
    if code:
        click.get_current_context().exit(code)
