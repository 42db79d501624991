"""Plans of scenes, and the price and fastest method of a scene within a tolerance."""

from typing import Any

from msgspec import structs

from fotismos.comparisons.case import open_case
from fotismos.comparisons.compare import compare
from fotismos.comparisons.departure.criterion import checked_threshold
from fotismos.comparisons.ladder.climb import WIDTH, reduced, requested
from fotismos.comparisons.ladder.cost import choose
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.comparisons.processes.pool import Pool, Task
from fotismos.comparisons.records.comparison import ComparisonRecord
from fotismos.comparisons.records.cost import Choice
from fotismos.comparisons.steps import steps
from fotismos.reports import sentences
from fotismos.reports.jobs import Terminal
from fotismos.reports.terminal import plan_lines, progress
from fotismos.reports.terminal.plan_lines import PlanReport, plan_report

LARGEST = 2**17
"""Pixels of a picture that is compared for its price; the width of a larger one is that of a study.
"""


def show(pool: Pool, scene: str, options: Options, terminal: Terminal) -> int:
    """Print a scene's plan."""
    report: PlanReport = pool.do(Task(scene, planned, (scene, options)))
    terminal.show(report, plan_lines.plan_lines(report))
    return 0


def show_fastest(
    pool: Pool, scene: str, options: Options, within: float, terminal: Terminal
) -> int:
    """Print a scene's price and fastest method within a tolerance; 1 if no method passes."""
    arguments = (scene, options, within)
    with progress.shown(pool, "scenes") as shown:
        record: ComparisonRecord = shown.do(Task(scene, priced, arguments, tells=True))
        choice: Choice = shown.do(Task(scene, chosen, arguments, tells=True))
    choice = structs.replace(choice, price=record.price)
    lines = [*sentences.price_lines(record, within), *sentences.choice_lines(choice)]
    terminal.show(choice, lines)
    return int(choice.chosen is None)


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


def chosen(name: str, options: Options, within: float, progress: Any) -> Choice:
    """Measure the methods of a scene, and name the fastest that passes at a tolerance."""
    case = open_case(name, options)
    return choose(case.source, within, options=case.options, progress=progress)
