"""Running a study: which points are left, how they are evaluated, and how they are kept.

Each finished point is saved at once in its own file, named by everything that it depends on. So a
run that ends early loses nothing, and the next one repeats nothing.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from hashlib import sha256
from itertools import pairwise
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING

import mitsuba as mi
import numpy as np

from fotismos.comparisons.atomic import Entry
from fotismos.comparisons.case import RGB, open_case
from fotismos.comparisons.compare import finish, look
from fotismos.comparisons.names import is_script
from fotismos.comparisons.prepared import Prepared, guarded
from fotismos.comparisons.processes.pool import Pool, Runner, Task
from fotismos.comparisons.records.images import Images
from fotismos.comparisons.study import dataset, scenes, sheet
from fotismos.comparisons.study.dataset import STEPS, Row
from fotismos.comparisons.study.design import OWN, StudyFile, StudyPart
from fotismos.comparisons.study.scenes import RENDERED, SCENES, Point, bsdf, largest_miss
from fotismos.heuristic import plugins
from fotismos.heuristic.errors import FotismosError, InputError, unknown
from fotismos.heuristic.heuristics import named
from fotismos.heuristic.program import versions
from fotismos.reference.pairing.factors import Convention
from fotismos.reference.planning.effects import EFFECTS, PRUNED
from fotismos.reference.planning.plan import physical_integrator
from fotismos.reference.planning.plan_record import Plan
from fotismos.reference.rendering import direct
from fotismos.reference.rendering.passes import passes
from fotismos.reference.rendering.renderer import Renderer
from fotismos.reference.rendering.sums import MEAN, Accumulator
from fotismos.reference.scene.graph import Graph, set_variant
from fotismos.reference.scene.source import Source, digest
from fotismos.reference.scene.values import COLOURS

if TYPE_CHECKING:
    import pyarrow as pa  # loaded late: it is an extra

POINTS = "points"
"""Folder of finished points."""

WORTH_A_PROCESS = 16
"""Fewest points that repay the start of another process."""

PASSES = 4
"""Few passes of many samples: each pass costs a launch, and stratifies its samples. Four suffice to
estimate the noise."""


@dataclass(frozen=True)
class StudyPoint:
    """A point of a part, and its number there.

    ``identity`` is a digest of the part's scene and heuristic, with every file that they read, and
    of the versions in use. A point is ``reusable`` unless its heuristic is a script, of which
    nobody knows what else it reads.
    """

    part: StudyPart
    number: int
    values: Point
    identity: str
    reusable: bool

    @property
    def key(self) -> str:
        """A name from all that the row depends on: equal points are done once."""
        content = [self.part.scene, self.part.options.stated(), self.identity, self.values]
        return sha256(json.dumps(content).encode()).hexdigest()[:32]

    def row(self, columns: Row) -> Row:
        """Return the row of the point with these columns."""
        return {**self.values, **columns, "part": self.part.name, "point": self.number}


def all_points(study: StudyFile) -> list[StudyPoint]:
    """Return the points of a study; ``InputError`` if a scene, or a path into it, does not exist.

    It reads scenes and runs scripts.
    """
    _set_up()
    return [point for part in study.parts for point in _points(part)]


def _set_up() -> None:
    set_variant(RGB)
    plugins.register()
    direct.register()


def _points(part: StudyPart) -> Iterator[StudyPoint]:
    points = part.points()
    try:
        _check(part, points)
    except InputError as error:
        raise InputError(f"part {part.name!r}: {error}") from error
    # All points edit the same source: the first gives its digest.
    scene_digest = "" if part.scene in SCENES else digest(source_of(part, points[0]))
    code = named(part.options.heuristic).digest()
    content = [scene_digest, code, versions()]
    identity = sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
    for number, values in enumerate(points):
        yield StudyPoint(
            part=part, number=number, values=values, identity=identity, reusable=code is not None
        )


def _check(part: StudyPart, points: list[Point]) -> None:
    """Ensure that a part's scene and heuristic exist, and that paths lead to numbers."""
    parameters = {
        parameter.name: parameter for parameter in named(part.options.heuristic).parameters
    }
    for point in points:
        for name, value in split(point)[0].items():
            if name not in parameters:
                raise unknown(f"parameter of {part.options.heuristic}", name, parameters)
            parameters[name].checked(value)
    if part.scene not in SCENES:
        set_values(source_of(part, points[0]).parse(), split(points[0])[1])


def run(
    study: StudyFile,
    folder: str | Path,
    runner: Runner | None = None,
    points: list[StudyPoint] | None = None,
) -> tuple[pa.Table, int]:
    """Do the points of a study that are not done yet; return the dataset, and how many it did.

    Points that failed in an earlier run are done again. A ``runner`` does the points; if omitted,
    this process. ``folder`` keeps finished points, in ``points/``; ``points`` are those of
    :func:`all_points`, if it was called elsewhere.
    """
    points = all_points(study) if points is None else points
    store = Path(folder) / POINTS
    store.mkdir(parents=True, exist_ok=True)
    # Points that parts share are done once.
    kept = {point.key for point in points if point.reusable}
    entries = {key: Entry(store / f"{key}.json", key) for key in kept}
    saved = {key: (entry.load() or {}).get("row") for key, entry in entries.items()}
    results = {key: row for key, row in saved.items() if row and row["error"] is None}
    left = {point.key: point for point in points if point.key not in results}
    sheets = {part.name: sheet.sheet_of(part) for part in study.parts}
    shown = {
        point.key
        for point in points
        if (found := sheets[point.part.name]) is not None and point.number in found.points
    }
    tasks = [
        Task(
            name=f"points of {point.part.name}",
            function=evaluated,
            arguments=(point,),
            ends_process=is_script(point.part.scene),
        )
        for point in left.values()
    ]
    for task, outcome in (runner or Pool(0)).each(tasks):
        (point,) = task.arguments
        error = outcome.exception()
        if error:
            results[point.key] = point.row({"error": str(error)})
        else:
            results[point.key], pictures = outcome.result()
            if pictures is not None and point.key in shown:
                sheet.save(store / f"{point.key}.npy", pictures)
        if point.reusable:
            entries[point.key].save({"row": results[point.key]})
    # A row that parts share gets the name and number of each.
    return dataset.table(study, [point.row(results[point.key]) for point in points]), len(left)


def kept_pictures(points: list[StudyPoint], folder: Path) -> dict[int, sheet.Pictures]:
    """Return the pictures that a study's folder has of points of one part, by their numbers."""
    found = ((p.number, sheet.load(folder / POINTS / f"{p.key}.npy")) for p in points)
    return {number: pictures for number, pictures in found if pictures is not None}


def evaluated(point: StudyPoint) -> tuple[Row, sheet.Pictures | None]:
    """Return the row of a point, and small pictures of it if it is rendered and did not fail.

    They are the same in any process. The row of a point that fails has its parameters and, in the
    column ``error``, the reason.
    """
    _set_up()
    part = point.part
    columns: Row = {"error": None}
    pictures = None
    try:
        if part.scene == "lobe":
            more, halves = scenes.lobe(point.values, part.options)
            columns |= more
        else:
            halves = _prepared(point)
        comparison = finish(look(halves), halves, then=())
        columns |= dataset.measures(comparison)
        if isinstance(halves, Prepared):
            columns |= _steps(halves, comparison.images)
            columns["miss"] = largest_miss(halves.pair.pairing.misses)
            pictures = sheet.small(comparison.images.heuristic, comparison.images.reference)
        if part.scene in SCENES:
            columns |= scenes.columns(point.values, Convention(part.options.pairing))
    # A failing point must not end a study of thousands.
    except Exception as failure:
        kind = "" if isinstance(failure, FotismosError) else f"{type(failure).__name__}: "
        return point.row({"error": f"{kind}{failure}"}), None
    return point.row(columns), pictures


# --- Renderings --------------------------------------------------------------------------------


def _prepared(point: StudyPoint) -> Prepared:
    """Return the scene of a point, ready to be rendered in :data:`PASSES` passes.

    The scene is read once while its ``identity`` stays. Nothing asks for its price or its causes.
    """
    part = point.part
    tuned, in_scene = split(point.values)
    source = source_of(part, point.values, point.identity)
    if part.scene not in SCENES:
        source = source.edited(partial(set_values, values=in_scene))
    ready = guarded(source, part.options)
    spp = max(1, (part.options.spp or 0) // PASSES)
    heuristic = ready.heuristic.sampled(spp)
    reference = ready.reference.sampled(spp)
    # The heuristic's own parameters are the integrator's.
    parameters = mi.traverse(heuristic.integrator)
    for name, value in tuned.items():
        parameters[name] = value
    parameters.update()
    return replace(
        ready,
        passes=PASSES,
        heuristic=heuristic,
        reference=reference,
        first=heuristic,
        second=reference,
        has=frozenset(),
    )


def _steps(ready: Prepared, images: Images) -> Row:
    """Render what is between the halves, with the same camera rays, and return the changes.

    The columns :data:`fotismos.comparisons.study.dataset.STEPS` are the root mean square changes of
    the image as each step is added; ``dominant`` names the largest.
    """
    *stages, last = _plans(ready.plan).items()
    renderers = [
        Renderer(
            ready.scene,
            physical_integrator(plan, ready.scene, ready.pair.hide_emitters),
            pass_spp=ready.reference.pass_spp,
            label="physical picture",
            size=ready.size,
        )
        for _, plan in stages
    ]
    sums = [Accumulator(MEAN) for _ in renderers]
    for rendered in passes(renderers, ready.options.seed, PASSES):
        for total, image in zip(sums, rendered, strict=True):
            total.add(image)
    between = [images.heuristic, *(total.mean() for total in sums), images.reference]
    # Steps that change nothing have no image, and keep 0.
    sizes = dict.fromkeys(STEPS, 0.0)
    for (name, _), (before, after) in zip((*stages, last), pairwise(between), strict=True):
        change = (after - before).mean(axis=2)[images.counted]
        sizes[name] = float(np.sqrt(np.mean(change**2)))
    return sizes | {"dominant": max(sizes, key=sizes.__getitem__)}


def split(point: Point) -> tuple[Point, Point]:
    """Return a point's parameters of the heuristic, without their prefix, and of the scene."""
    tuned = {k.removeprefix(OWN): value for k, value in point.items() if k.startswith(OWN)}
    return tuned, {name: value for name, value in point.items() if not name.startswith(OWN)}


def source_of(part: StudyPart, point: Point, identity: str = "") -> Source:
    """Return the scene of a point: a study scene is made, another is read."""
    if make := RENDERED.get(part.scene):
        return Source(part.scene, lambda: make(point, bsdf(point)))
    return _read(part.scene, identity)


@lru_cache(maxsize=4)
def _read(scene: str, identity: str) -> Source:
    """Read a user's scene or a built-in one once, while its files stay the same."""
    case = open_case(scene)
    if case.variant != RGB:
        raise InputError(f"{scene} needs {case.variant}: study a scene in RGB.")
    return case.source


def _plans(chosen: Plan) -> dict[str, Plan]:
    """Return the plan of each step that changes something; the last is the chosen plan."""
    simulated = set(EFFECTS) - set(PRUNED)
    plans = {STEPS[0]: chosen.simulating(simulated)}
    for effect in PRUNED:
        simulated.add(effect)
        more = chosen.simulating(simulated)
        if more != list(plans.values())[-1]:
            plans[effect.label] = more
    return plans


def set_values(graph: Graph, values: dict[str, float]) -> None:
    """Set values in a user's scene, by path: ``<id of the element>.<parameter>``.

    The scene must state the parameter as a number, or as RGB, which becomes grey.
    """
    in_use = [graph.props(index) for index in graph.nodes_in_use()]
    for path, value in values.items():
        # An id may contain dots itself.
        identifier, _, key = path.rpartition(".")
        props = [props for props in in_use if props.id() == identifier and key in props]
        if not props:
            paths = sorted(
                f"{props.id()}.{name}"
                for props in in_use
                for name, present in props.items()
                if props.id() and _is_number(present)
            )
            raise InputError(
                f"{graph.name} has no parameter {path!r}. Write <id>.<parameter>, such as one of:"
                f" {', '.join(paths)}."
            )
        if not _is_number(props[0][key]):
            raise InputError(f"{graph.name}: {path} is not a number or RGB. Vary one that is.")
        is_colour = isinstance(props[0][key], COLOURS)
        props[0][key] = mi.ScalarColor3f(value) if is_colour else value


def _is_number(value: object) -> bool:
    return isinstance(value, (Real, *COLOURS)) and not isinstance(value, bool)
