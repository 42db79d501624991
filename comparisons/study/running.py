"""Running a study: which points are left, where they are done, and what is kept of them.

Every finished block is a file of its own at once, under a name made out of all that it depends on.
So a run that ends early loses nothing, and the next one repeats nothing.
"""

import json
from dataclasses import dataclass
from pathlib import Path

from comparisons import atomic
from comparisons.study import dataset, point, processes
from comparisons.study.point import Block

POINTS = "points"
"""Folder of the finished blocks."""


@dataclass(frozen=True)
class Outcome:
    """A study that has run: the dataset, and how many points were done, at hand, and failed."""

    table: object
    done: int
    at_hand: int
    failed: int


def run(study, folder, spread=None, progress=None):
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
        (:mod:`comparisons.study.processes`, :mod:`comparisons.study.cluster`). All are done in this
        process where it is not given.
    progress : callable, optional
        Called as ``progress(stage, done, total)`` with numbers of points.

    Returns
    -------
    Outcome

    Raises
    ------
    InputError
        When the scene of a part, or a path into it, does not exist: before anything is rendered.
    """
    for part in study.parts:
        point.check(part)
    kept = Path(folder) / POINTS
    kept.mkdir(parents=True, exist_ok=True)
    blocks = [block for part in study.parts for block in point.blocks(part)]
    found = {block.key: _read(kept / f"{block.key}.json") for block in blocks}
    found = {key: rows for key, rows in found.items() if rows and not _failed(rows)}
    # Parts may share points; these are done once.
    left = list({block.key: block for block in blocks if block.key not in found}.values())
    total = sum(len(block.points) for block in blocks)
    at_hand = done = total - sum(len(block.points) for block in left)
    report = progress or (lambda *_: None)
    report("points", done, total)
    for block, rows in (spread or processes.over(1))(left):
        _write(kept / f"{block.key}.json", rows)
        found[block.key] = rows
        done += len(rows)
        report("points", done, total)
    rows = [row for block in blocks for row in _named(block, found[block.key])]
    return Outcome(dataset.table(study, rows), done - at_hand, at_hand, _failed(rows))


def _named(block: Block, rows):
    """Give rows the part and numbers of this block; it may have stood elsewhere before."""
    return [
        row | {"part": block.part.name, "point": block.first + number}
        for number, row in enumerate(rows)
    ]


def _failed(rows):
    return sum(row["error"] is not None for row in rows)


def _read(path):
    """Return the rows of a finished block; None where there are none, or none that can be read."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


def _write(path, rows):
    atomic.write(path, json.dumps(rows, ensure_ascii=False))
