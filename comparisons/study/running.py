"""Running a study: which points are left, how they are evaluated, and how they are kept.

Each finished block of points is saved at once in its own file, named by everything that it depends
on. So a run that ends early loses nothing, and the next one repeats nothing.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import sha256
from itertools import groupby
from pathlib import Path

import pyarrow as pa

from comparisons import record
from comparisons.atomic import Entry
from comparisons.case import RGB
from comparisons.processes.pool import Pool, Task
from comparisons.study import dataset, rendered, surface
from comparisons.study.dataset import Row
from comparisons.study.design import StudyFile, StudyPart
from comparisons.study.scenes import SCENES, Point
from heuristic import plugins
from heuristic.errors import FotismosError, InputError, unknown
from heuristic.heuristics import named
from reference.rendering import direct
from reference.rendering.renderer import Progress
from reference.scene.graph import set_variant
from reference.scene.source import digest

POINTS = "points"
"""Folder of finished blocks."""

LARGEST_BLOCK = 4096

WORTH_A_PROCESS = 16
"""Fewest blocks that repay the start of another process."""


@dataclass(frozen=True)
class PointBlock:
    """Points of one part that are evaluated together: one, or those that differ in directions.

    ``first`` is the number of the first one. ``identity`` is a digest of the part's scene and
    heuristic, with every file that they read, and of the versions in use.
    """

    part: StudyPart
    first: int
    points: tuple[Point, ...]
    identity: str

    @property
    def key(self) -> str:
        """A name from all that the rows depend on: equal blocks are done once."""
        part = self.part
        content = [part.scene, part.options.stated(), self.identity, self.points]
        return sha256(json.dumps(content).encode()).hexdigest()[:32]


@dataclass(frozen=True)
class Outcome:
    """A finished study: the dataset, and how many points were done, cached, and failed."""

    table: pa.Table
    done: int
    cached: int
    failed: int


def all_blocks(study: StudyFile) -> list[PointBlock]:
    """Return the blocks of a study; ``InputError`` if a scene, or a path into it, does not exist.

    It reads scenes and runs scripts.
    """
    _prepare()
    return [block for part in study.parts for block in _blocks(part)]


def _prepare() -> None:
    set_variant(RGB)
    plugins.register()
    direct.register()


def _blocks(part: StudyPart) -> Iterator[PointBlock]:
    points = part.points()
    try:
        _check(part, points)
    except InputError as error:
        raise InputError(f"part {part.name!r}: {error}") from error
    scene = SCENES.get(part.scene)
    own = "" if scene else digest(rendered.source_of(part, points[0]))
    versions = [own, named(part.options.heuristic).digest(), record.versions()]
    identity = sha256(json.dumps(versions, sort_keys=True).encode()).hexdigest()
    together = scene.together if scene else ()

    def alike(number: int) -> list[float]:
        if not together:
            return [number]
        return [value for name, value in points[number].items() if name not in together]

    for _, group in groupby(range(len(points)), alike):
        numbers = list(group)
        for begin in range(numbers[0], numbers[-1] + 1, LARGEST_BLOCK):
            end = min(begin + LARGEST_BLOCK, numbers[-1] + 1)
            yield PointBlock(part, begin, tuple(points[begin:end]), identity)


def _check(part: StudyPart, points: list[Point]) -> None:
    """Ensure that a part's scene and heuristic exist, and that paths lead to numbers."""
    known = {each.name: each for each in named(part.options.heuristic).parameters}
    for point in points:
        for name, value in rendered.split(point)[0].items():
            if name not in known:
                raise unknown(f"parameter of {part.options.heuristic}", name, known)
            known[name].checked(value)
    if part.scene not in SCENES:
        graph = rendered.source_of(part, points[0]).parse()
        rendered.set_values(graph, rendered.split(points[0])[1])


def rows(block: PointBlock) -> list[Row]:
    """Evaluate a block, the same in any process; return one row per point.

    The row of a point that fails has its parameters and, in the column ``error``, the reason.
    """
    _prepare()
    part = block.part
    convention = part.options.convention
    try:
        if part.scene == "patch":
            results = surface.patch(block.points, convention)
        elif part.scene == "lobe":
            results = [surface.lobe(point, convention) for point in block.points]
        else:
            results = [rendered.row(part, point, block.identity) for point in block.points]
    # A failing point must not end a study of thousands.
    except Exception as failure:
        kind = "" if isinstance(failure, FotismosError) else f"{type(failure).__name__}: "
        return _failing(block, f"{kind}{failure}")
    return _rows(block, [result | {"error": None} for result in results])


def _rows(block: PointBlock, results: list[Row]) -> list[Row]:
    return [
        {**point, **result, "part": block.part.name, "point": block.first + number}
        for number, (point, result) in enumerate(zip(block.points, results, strict=True))
    ]


def _failing(block: PointBlock, reason: str) -> list[Row]:
    return _rows(block, [{"error": reason}] * len(block.points))


def run(
    study: StudyFile,
    folder: str | Path,
    pool: Pool | None = None,
    progress: Progress | None = None,
    blocks: list[PointBlock] | None = None,
) -> Outcome:
    """Do the points of a study that are not done yet, and gather all.

    Points that failed in an earlier run are done again. A pool, or a cluster, does the points; if
    omitted, this process. ``folder`` keeps finished blocks, in ``points/``; ``progress(stage, done,
    total)`` is called with numbers of points; ``blocks`` are those of :func:`all_blocks`, if it was
    called elsewhere.
    """
    blocks = all_blocks(study) if blocks is None else blocks
    kept = Path(folder) / POINTS
    kept.mkdir(parents=True, exist_ok=True)
    entries = {block.key: Entry(kept / f"{block.key}.json", block.key) for block in blocks}
    results = {}
    for block in blocks:
        saved = (entries[block.key].load() or {}).get("rows")
        if saved and not _failed(saved):
            results[block.key] = saved
    # Points that parts share are done once.
    left = {block.key: block for block in blocks if block.key not in results}
    total = sum(len(block.points) for block in blocks)
    cached = done = total - sum(len(block.points) for block in left.values())
    report = progress or (lambda *_: None)
    report("points", done, total)
    tasks = [Task(f"points of {b.part.name}", rows, (b,)) for b in left.values()]
    for task, outcome in (pool or Pool(0)).each(tasks):
        (block,) = task.arguments
        error = outcome.exception()
        results[block.key] = _failing(block, str(error)) if error else outcome.result()
        entries[block.key].save({"rows": results[block.key]})
        done += len(block.points)
        report("points", done, total)
    # Rows of a block that parts share get the name and numbers of each.
    all_rows = [row for block in blocks for row in _rows(block, results[block.key])]
    return Outcome(dataset.table(study, all_rows), done - cached, cached, _failed(all_rows))


def _failed(all_rows: list[Row]) -> int:
    return sum(row["error"] is not None for row in all_rows)
