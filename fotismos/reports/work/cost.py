"""The work of ``fotismos cost``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fotismos.comparisons.cost import engine as engines
from fotismos.comparisons.cost.timed_pictures import EngineTimes
from fotismos.comparisons.departure.criterion import TOLERANCE, checked_threshold
from fotismos.comparisons.names import matching, picture_parts
from fotismos.comparisons.options import Options
from fotismos.comparisons.pictures import require_no_scene
from fotismos.comparisons.processes.pool import Pool
from fotismos.comparisons.records.engine import EngineCost
from fotismos.reference.records import to_json
from fotismos.reports.files.results import PAGE
from fotismos.reports.run import cost_files
from fotismos.reports.terminal import cost_tables
from fotismos.reports.terminal.words import tell, tell_where
from fotismos.reports.work.folders import results_of

if TYPE_CHECKING:  # pictures without a scene need no Mitsuba
    from fotismos.comparisons.records.cost import Cost

Size = tuple[int, int]


def run(
    pool: Pool,
    scene: str | None,
    output: Path,
    options: Options,
    rounds: int | None,
    at: Size | None,
    is_measured: bool,
    engine: EngineTimes | None,
    within: float,
    as_json: bool,
) -> None:
    """Study one scene, or pictures without one, and print the table or the record."""
    folder = output / "cost"
    checked_threshold(within)
    if scene is None:
        of_scenes = {
            "rounds": rounds,
            "at": at,
            "measure": is_measured,
            "kernel_time": engine and engine.kernel_time,
        }
        require_no_scene(options, [name for name, value in of_scenes.items() if value])
        path, _ = picture_parts(matching(options.reference)[0])
        records = results_of(
            pool,
            folder,
            scenes=[path.stem],
            work=judged,
            arguments=(options, engine, within),
            files=[path],
        )
    else:
        arguments = (options, rounds, at, is_measured, engine)
        records = results_of(pool, folder, scenes=[scene], work=measured, arguments=arguments)
    ((target, record),) = records.items()
    if as_json:
        click.echo(to_json(record), nl=False)
        return
    if isinstance(record, EngineCost):
        tell(cost_tables.lines_of_pictures(record, within))
    else:
        tell(cost_tables.lines(record))
    tell_where(target / PAGE)


def judged(
    name: str, options: Options, engine: EngineTimes, within: float, target: Path, progress: Any
) -> EngineCost:
    """Judge the pictures of an engine's settings without a scene, and write the files."""
    chosen = None if within == TOLERANCE else f"{within:g}"
    command = options.command("cost", "", **engine.as_options(), within=chosen)
    study = engines.front_of_pictures(options, engine, name, command)
    cost_files.write(target, study, cost_files.view_of_pictures(study, within))
    return study.record


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
    from fotismos.comparisons.case import open_case  # loaded late: pictures need no Mitsuba
    from fotismos.comparisons.cost.cost import cost  # as late
    from fotismos.comparisons.cost.measure import Effort  # as late

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
    cost_files.write(target, study, cost_files.view(study))
    return study.record
