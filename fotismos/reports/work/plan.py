"""The work of ``fotismos plan``."""

from collections.abc import Iterable, Iterator
from typing import Any

import click
from msgspec import structs

from fotismos.comparisons.case import open_case
from fotismos.comparisons.compare import compare
from fotismos.comparisons.cost.cost import choose
from fotismos.comparisons.cost.measure import WIDTH, reduced, requested
from fotismos.comparisons.departure.criterion import checked_threshold
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.comparisons.processes.pool import Pool, Task
from fotismos.comparisons.records.comparison import ComparisonRecord
from fotismos.comparisons.records.cost import Choice
from fotismos.comparisons.steps import steps
from fotismos.reference.records import Record, to_json
from fotismos.reports import verdict
from fotismos.reports.terminal import cost_tables, plan_lines, progress
from fotismos.reports.terminal.plan_lines import PlanReport, plan_report
from fotismos.reports.terminal.words import parameter, tell

LARGEST = 2**17
"""Pixels of a picture that is compared for its price; the width of a larger one is that of a study.
"""


def run(pool: Pool, scene: str, options: Options, within: float | None, as_json: bool) -> int:
    """Print a scene's plan, or its price and fastest method within a tolerance.

    Returns the exit code.
    """
    code = 0
    lines: Iterable[str]
    result: Record
    if within is None:
        report: PlanReport = pool.do(Task(scene, planned, (scene, options)))
        lines = plan_lines.plan_lines(report)
        result = report
    else:
        with progress.shown() as bar:
            of_scene = bar.of(scene)
            record: ComparisonRecord = pool.do(
                Task(scene, priced, (scene, options, within), progress=of_scene)
            )
            choice: Choice = pool.do(
                Task(scene, chosen, (scene, options, within), progress=of_scene)
            )
        choice = structs.replace(choice, price=record.price)
        lines = [*price_lines(record, within), *cost_tables.choice_lines(choice)]
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


def priced(name: str, options: Options, within: float, progress: Any) -> ComparisonRecord:
    """Compare a scene, at its own size if that is affordable, for the price of looking right."""
    checked_threshold(within)
    case = open_case(name, options)
    source = case.source
    options = case.options
    width, height = requested(source, options)
    if width * height > LARGEST:
        options = options.changed(resolution=reduced(source, options, WIDTH))
    return compare(source, options, progress, then=steps(why=True)).record


def price_lines(record: ComparisonRecord, within: float) -> Iterator[str]:
    """Yield whether a scene passes, what makes it look right, and what its plan leaves out."""
    outcome = {"pass": "passes", "fail": "fails"}.get(verdict.decision(record, within))
    judged = verdict.judged(record).subject
    what = f"{judged} {outcome or 'is undecided'} at {LEADING.label} {parameter(within)}"
    size = cost_tables.sized(record.resolution)
    yield f"At {size}: {what}. {verdict.sentence(record, threshold=within)}"
    yield from record.mistakes
    if saving := verdict.saving(record):
        yield saving


def chosen(name: str, options: Options, within: float, progress: Any) -> Choice:
    """Measure the methods of a scene, and name the fastest that passes at a tolerance."""
    case = open_case(name, options)
    return choose(case.source, within, options=case.options, progress=progress)
