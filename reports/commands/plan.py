"""``fotismos plan``: which effects a scene calls for."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import click

from fotismos.comparisons.processes.pool import Task
from fotismos.reports import jobs
from fotismos.reports.terminal.words import tell, verbose_option

if TYPE_CHECKING:
    from fotismos.comparisons.cost.cost import Choice
    from fotismos.comparisons.options import Options
    from fotismos.reports.terminal.plan_lines import PlanReport


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
    """List the effects that a scene calls for, by which rule, and what will be simulated.

    With --within, the exit code is 1 if no measured method passes.

    \b
    Examples:
      fotismos plan cornell-box
      fotismos plan --within 5 cornell-box
    """  # noqa: D301 click reads the \b as: keep these lines
    with jobs.pool(timeout) as pool:
        pool.start()
        from fotismos.reference.records import to_json
        from fotismos.reports.terminal import cost_tables, plan_lines, progress

        lines: Iterable[str]
        request = jobs.request(rendering)
        code = 0
        if within is not None:
            with progress.shown() as bar:
                arguments = (scene, request, within)
                result = pool.do(
                    Task(name=scene, function=chosen, arguments=arguments, progress=bar.of(scene))
                )
            lines = cost_tables.choice_lines(result)
            code = int(result.chosen is None)
        else:
            result = pool.do(Task(scene, planned, (scene, request)))
            lines = plan_lines.plan_lines(result)
    if as_json:
        click.echo(to_json(result).rstrip())
    else:
        tell(lines)
    if code:
        click.get_current_context().exit(code)


def planned(name: str, request: Options) -> PlanReport:
    """Return the plan of a scene."""
    from fotismos.comparisons.case import open_case
    from fotismos.comparisons.prepared import prepare
    from fotismos.reports.terminal.plan_lines import plan_report

    case = open_case(name, request)
    return plan_report(case.name, prepare(case.source, case.options), case.variant)


def chosen(name: str, request: Options, within: float, progress: Any) -> Choice:
    """Measure the methods of a scene, and name the fastest that passes at a tolerance."""
    from fotismos.comparisons.case import open_case
    from fotismos.comparisons.cost.cost import choose

    case = open_case(name, request)
    return choose(case.source, within, case.options, progress)
