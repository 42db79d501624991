"""Running a study: which points are left, where they are done, and how they are kept.

Each finished block is saved at once in its own file, named by everything that it depends on. So a
run that ends early loses nothing, and the next one repeats nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import pyarrow as pa

from comparisons.processes.pool import Pool
from comparisons.processes.worker import Task
from comparisons.store import Entry
from comparisons.study import dataset, point
from comparisons.study.columns import Row
from comparisons.study.design import Study
from comparisons.study.point import Block
from heuristic.errors import LostProcessError
from reference.rendering.passes import Progress

if TYPE_CHECKING:
    from comparisons.processes.cluster import Cluster

Spread: TypeAlias = Callable[[list[Block]], Iterable[tuple[Block, list[Row]]]]
"""Does blocks, and yields each with its rows as it finishes, in any order."""

POINTS = "points"
"""Folder of finished blocks."""

WORTH_A_PROCESS = 16
"""Fewest blocks that repay the start of another process."""


@dataclass(frozen=True)
class Outcome:
    """A finished study: the dataset, and how many points were done, cached, and failed."""

    table: pa.Table
    done: int
    cached: int
    failed: int


def all_blocks(study: Study) -> list[Block]:
    """Return the blocks of points of a study.

    Raises
    ------
    InputError
        When the scene of a part, or a path into it, does not exist.
    """
    for part in study.parts:
        point.check(part)
    return [block for part in study.parts for block in point.blocks(part)]


def run(
    study: Study,
    folder: str | Path,
    spread: Spread | None = None,
    progress: Progress | None = None,
    blocks: list[Block] | None = None,
) -> Outcome:
    """Do the points of a study that are not done yet, and gather all.

    Points that failed in an earlier run are done again.

    Parameters
    ----------
    study
        The study.
    folder
        Keeps finished blocks, in ``points/``.
    spread
        Takes a list of blocks and yields ``(block, rows)`` as they finish, in any order
        (:func:`processes`, :func:`workers_of`). If omitted, this process does all.
    progress
        Called as ``progress(stage, done, total)`` with numbers of points.
    blocks
        The result of :func:`all_blocks`, if called elsewhere: it reads scenes and runs scripts.

    Returns
    -------
    Outcome

    Raises
    ------
    InputError
        See :func:`all_blocks`; before anything is rendered.
    """
    blocks = all_blocks(study) if blocks is None else blocks
    kept = Path(folder) / POINTS
    kept.mkdir(parents=True, exist_ok=True)
    entries = {block.key: Entry(kept / f"{block.key}.json", block.key) for block in blocks}
    found = {}
    for block in blocks:
        rows = (entries[block.key].load() or {}).get("rows")
        if dataset.fits(rows, block.points) and not _failed(rows):
            found[block.key] = rows
    # Points that parts share are done once.
    left = list({block.key: block for block in blocks if block.key not in found}.values())
    total = sum(len(block.points) for block in blocks)
    cached = done = total - sum(len(block.points) for block in left)
    report = progress or (lambda *_: None)
    report("points", done, total)
    for block, rows in (spread or processes(0))(left):
        entries[block.key].save({"rows": rows})
        found[block.key] = rows
        done += len(rows)
        report("points", done, total)
    rows = [row for block in blocks for row in _named(block, found[block.key])]
    return Outcome(dataset.table(study, rows), done - cached, cached, _failed(rows))


def processes(
    count: int,
    ready: Callable[[int], Callable[[], object]] = lambda workers: tuple,
    limit_s: float = inf,
) -> Spread:
    """Return a function for :func:`run` that spreads blocks over processes of this machine.

    There are at most ``count`` processes; with 0 this process does all. ``ready(workers)`` returns
    the function that prepares each of them; for ``limit_s`` see
    :class:`comparisons.processes.pool.Pool`.

    Small points spend half their time in Python and NumPy, which use one core whatever Mitsuba's
    threads do; several processes use all cores.

    Raises
    ------
    LostProcessError
        While running, when one of the processes ends.
    """

    def spread(blocks: list[Block]) -> Iterator[tuple[Block, list[Row]]]:
        workers = min(count, len(blocks) // WORTH_A_PROCESS + 1)
        with Pool(workers, ready(workers), limit_s) as pool:
            for task, rows in pool.each(_tasks(blocks)):
                try:
                    yield task.arguments[0], rows.result()
                except LostProcessError as error:
                    raise LostProcessError(
                        f"{error} All finished points are kept: run the same command again to"
                        " resume."
                    ) from error

    return spread


def workers_of(cluster: Cluster) -> Spread:
    """Return a function for :func:`run` that spreads blocks over a cluster.

    The rows of a block that fails give the reason.
    """

    def spread(blocks: list[Block]) -> Iterator[tuple[Block, list[Row]]]:
        for task, rows in cluster.each(_tasks(blocks)):
            (block,) = task.arguments
            error = rows.exception()
            yield block, _failing(block, str(error)) if error else rows.result()

    return spread


def _tasks(blocks: list[Block]) -> list[Task]:
    return [Task(f"points of {block.part.name}", point.rows, (block,)) for block in blocks]


def _failing(block: Block, reason: str) -> list[Row]:
    return [
        {"part": block.part.name, "point": block.first + number, **values, "error": reason}
        for number, values in enumerate(block.points)
    ]


def _named(block: Block, rows: list[Row]) -> list[Row]:
    """Give rows the part and numbers of this block, which may have had others before."""
    return [
        row | {"part": block.part.name, "point": block.first + number}
        for number, row in enumerate(rows)
    ]


def _failed(rows: list[Row]) -> int:
    return sum(row["error"] is not None for row in rows)
