"""The work of ``fotismos plan``."""

from collections.abc import Iterable
from typing import Any

import click

from fotismos.comparisons.case import open_case
from fotismos.comparisons.cost.cost import Choice, choose
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.comparisons.processes.pool import Pool, Task
from fotismos.reference.records import Record, to_json
from fotismos.reports.terminal import cost_tables, plan_lines, progress
from fotismos.reports.terminal.plan_lines import PlanReport, plan_report
from fotismos.reports.terminal.words import tell


def run(pool: Pool, scene: str, options: Options, within: float | None, as_json: bool) -> int:
    """Print a scene's plan, or its fastest method within a tolerance; return the exit code."""
    code = 0
    lines: Iterable[str]
    result: Record
    if within is None:
        report: PlanReport = pool.do(Task(scene, planned, (scene, options)))
        lines = plan_lines.plan_lines(report)
        result = report
    else:
        with progress.shown() as bar:
            task = Task(
                name=scene,
                function=chosen,
                arguments=(scene, options, within),
                progress=bar.of(scene),
            )
            choice: Choice = pool.do(task)
        lines = cost_tables.choice_lines(choice)
        code = int(choice.chosen is None)
        result = choice
    if as_json:
        click.echo(to_json(result).rstrip())
    else:
        tell(lines)
    return code


def planned(name: str, options: Options) -> PlanReport:
    """Return the plan of a scene."""
    case = open_case(name, options)
    return plan_report(case.name, prepare(case.source, case.options), case.variant)


def chosen(name: str, options: Options, within: float, progress: Any) -> Choice:
    """Measure the methods of a scene, and name the fastest that passes at a tolerance."""
    case = open_case(name, options)
    return choose(case.source, within, options=case.options, progress=progress)
