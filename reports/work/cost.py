"""The work of ``fotismos cost``."""

from pathlib import Path
from typing import Any

import click

from fotismos.comparisons.case import open_case
from fotismos.comparisons.cost.cost import cost
from fotismos.comparisons.cost.cost_record import Cost
from fotismos.comparisons.cost.measure import Effort
from fotismos.comparisons.cost.timed_pictures import EngineTimes
from fotismos.comparisons.options import Options
from fotismos.comparisons.processes.pool import Pool
from fotismos.reference.records import to_json
from fotismos.reports.files.results import PAGE
from fotismos.reports.run import cost_files
from fotismos.reports.terminal import cost_tables
from fotismos.reports.terminal.words import tell, tell_where
from fotismos.reports.work.folders import results_of

Size = tuple[int, int]


def run(
    pool: Pool,
    scene: str,
    output: Path,
    options: Options,
    rounds: int | None,
    at: Size | None,
    is_measured: bool,
    engine: EngineTimes | None,
    as_json: bool,
) -> None:
    """Study one scene, and print the table or the record."""
    arguments = (options, rounds, at, is_measured, engine)
    records = results_of(pool, output / "cost", scenes=[scene], work=measured, arguments=arguments)
    ((folder, record),) = records.items()
    if as_json:
        click.echo(to_json(record), nl=False)
        return
    tell(cost_tables.lines(record))
    tell_where(folder / PAGE)


def measured(
    name: str,
    options: Options,
    rounds: int | None,
    at: Size | None,
    is_measured: bool,
    engine: EngineTimes | None,
    target: Path,
    progress: Any,
) -> Cost:
    """Study what each step of accuracy costs, and write its files."""
    case = open_case(name, options)
    effort = Effort() if rounds is None else Effort(rounds=rounds)
    size = at and f"{at[0]}x{at[1]}"
    given = {} if engine is None else engine.as_options()
    repeated = case.command("cost", rounds=rounds, at=size, measure=is_measured or None, **given)
    study = cost(
        case.source,
        case.options,
        effort,
        progress,
        repeated,
        at,
        is_measured,
        engine_times=engine,
    )
    cost_files.write(target, study)
    return study.record
