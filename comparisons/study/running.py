"""Running a study: which points are left, where they are done, and what is kept of them.

Every finished block is a file of its own at once, under a name made out of all that it depends on.
So a run that ends early loses nothing, and the next one repeats nothing.
"""

from dataclasses import dataclass
from math import inf
from pathlib import Path

from comparisons.processes.pool import Pool
from comparisons.processes.worker import Task
from comparisons.store import Entry
from comparisons.study import dataset, point
from comparisons.study.point import Block
from heuristic.errors import LostProcessError

POINTS = "points"
"""Folder of the finished blocks."""

WORTH_A_PROCESS = 16
"""Blocks below which the start of a process costs more than it saves."""


@dataclass(frozen=True)
class Outcome:
    """A study that has run: the dataset, and how many points were done, cached, and failed."""

    table: object
    done: int
    cached: int
    failed: int


def all_blocks(study):
    """Return the blocks of points of a study, of :class:`comparisons.study.point.Block`.

    Raises
    ------
    InputError
        When the scene of a part, or a path into it, does not exist.
    """
    for part in study.parts:
        point.check(part)
    return [block for part in study.parts for block in point.blocks(part)]


def run(study, folder, spread=None, progress=None, blocks=None):
    """Do the points of a study that are not done yet, and put all together.

    Points that failed in an earlier run are done again.

    Parameters
    ----------
    study : comparisons.study.design.Study
        The study.
    folder
        Where finished blocks are kept, in ``points/``.
    spread : callable, optional
        Takes a list of blocks and yields ``(block, rows)`` as they are finished, in any order
        (:func:`processes`, :func:`workers_of`). If omitted, all are done in
        this process.
    progress : callable, optional
        Called as ``progress(stage, done, total)`` with numbers of points.
    blocks : optional
        What :func:`all_blocks` returned elsewhere: it reads the scenes, and runs scripts.

    Returns
    -------
    Outcome

    Raises
    ------
    InputError
        As :func:`all_blocks`, before anything is rendered.
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
    # Parts may share points; these are done once.
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


def processes(count, ready=lambda workers: tuple, limit_s=inf):
    """Return what spreads blocks over so many processes of this machine, as `run` takes it.

    ``ready(workers)`` returns what gets one of so many ready to render, and ``limit_s`` is as of
    :class:`comparisons.processes.pool.Pool`; with a ``count`` of 0 this process does all.

    A small point is half Python and NumPy, which keep one core busy whatever Mitsuba's threads do;
    several processes keep all of them busy.

    Raises
    ------
    LostProcessError
        While it runs, when one of the processes ends.
    """

    def spread(blocks):
        workers = min(count, len(blocks) // WORTH_A_PROCESS + 1)
        with Pool(workers, ready(workers), limit_s) as pool:
            for task, rows in pool.each(_tasks(blocks)):
                try:
                    yield task.arguments[0], rows.result()
                except LostProcessError as error:
                    raise LostProcessError(
                        f"{error} All finished points are kept; run the same command again, and it"
                        " goes on from there."
                    ) from error

    return spread


def workers_of(cluster):
    """Return what spreads blocks over a cluster, as `run` takes it.

    A block that is not done has rows that say why. ``cluster`` is a
    :class:`comparisons.processes.cluster.Cluster`.
    """

    def spread(blocks):
        for task, rows in cluster.each(_tasks(blocks)):
            (block,) = task.arguments
            error = rows.exception()
            yield block, _failing(block, str(error)) if error else rows.result()

    return spread


def _tasks(blocks):
    return [Task(f"points of {block.part.name}", point.rows, (block,)) for block in blocks]


def _failing(block, reason):
    return [
        {"part": block.part.name, "point": block.first + number, **values, "error": reason}
        for number, values in enumerate(block.points)
    ]


def _named(block: Block, rows):
    """Give rows the part and numbers of this block; it may have stood elsewhere before."""
    return [
        row | {"part": block.part.name, "point": block.first + number}
        for number, row in enumerate(rows)
    ]


def _failed(rows):
    return sum(row["error"] is not None for row in rows)
