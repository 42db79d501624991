"""Evaluating one block of points as rows: a pure function, the same in any process."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from hashlib import sha256
from itertools import groupby
from json import dumps

import numpy as np

from comparisons import record
from comparisons.study import rendered, surface
from comparisons.study.columns import Row
from comparisons.study.design import Part
from comparisons.study.editing import set_values
from comparisons.study.measure import largest_miss, measure, measure_each
from comparisons.study.scenes import SCENES, Point
from comparisons.study.surface import Material
from heuristic import plugins
from heuristic.errors import FotismosError, InputError, unknown
from heuristic.heuristics import named
from reference.rendering import direct
from reference.scene.graph import set_variant
from reference.scene.identity import digest

VARIANT = "llvm_ad_rgb"
PEAK_STEP = 0.05
"""Degrees between the directions searched for a lobe's peak."""

LARGEST_BLOCK = 4096


@dataclass(frozen=True)
class Block:
    """Points of one part that are evaluated together.

    Attributes
    ----------
    first
        Number of the first point.
    identity
        Digest of the part's scene and heuristic, with every file that they read, and of the
        versions in use.
    """

    part: Part
    first: int
    points: tuple[Point, ...]
    identity: str

    @property
    def key(self) -> str:
        """A name from all that the rows depend on: equal blocks are done once."""
        part = self.part
        content = {
            "scene": part.scene,
            "identity": self.identity,
            "pairing": part.convention.value,
            "heuristic": part.heuristic,
            "seed": part.seed,
            "resolution": part.resolution,
            "spp": part.spp,
            "points": self.points,
        }
        return sha256(dumps(content).encode()).hexdigest()[:32]


def blocks(part: Part) -> list[Block]:
    """Return the blocks of a part: single points, or points that differ only in directions.

    Raises
    ------
    InputError
        When the part's scene cannot be read.
    """
    identity = _identity(part)
    scene = SCENES.get(part.scene)
    together = scene.together if scene else ()

    def alike(numbered: tuple[int, Point]) -> int | list[float]:
        number, point = numbered
        if not together:
            return number
        return [value for name, value in point.items() if name not in together]

    found: list[Block] = []
    first = 0
    for _, group in groupby(enumerate(part.points()), alike):
        points = [point for _, point in group]
        for begin in range(0, len(points), LARGEST_BLOCK):
            some = tuple(points[begin : begin + LARGEST_BLOCK])
            found.append(Block(part, first, some, identity))
            first += len(some)
    return found


def _identity(part: Part) -> str:
    _prepare()
    own = "" if part.scene in SCENES else digest(rendered.opened(part.scene))
    told = [own, named(part.heuristic).digest(), record.versions()]
    return sha256(dumps(told, sort_keys=True).encode()).hexdigest()


def check(part: Part) -> None:
    """Ensure that a part's scene and heuristic exist, and that paths lead to numbers.

    Raises
    ------
    InputError
        Naming what does not exist.
    """
    _prepare()
    known = {each.name: each for each in named(part.heuristic).parameters}
    for point in part.points():
        for name, value in rendered.own_parameters(point).items():
            if name not in known:
                raise unknown(f"part {part.name!r}: parameter of {part.heuristic}", name, known)
            known[name].checked(value)
    if part.scene not in SCENES:
        try:
            source = rendered.opened(part.scene)
            values = rendered.scene_parameters(next(iter(part.points())))
            source.edited(partial(set_values, values=values)).parse()
        except InputError as error:
            raise InputError(f"part {part.name!r}: {error}") from error


def rows(block: Block) -> list[Row]:
    """Evaluate a block; return one row per point.

    The row of a point that fails has its parameters and, in the column ``error``, the reason.
    """
    _prepare()
    part = block.part
    error = None
    try:
        results = _results(part, block)
    # A failing point must not end a study of thousands.
    except Exception as failure:
        kind = "" if isinstance(failure, FotismosError) else f"{type(failure).__name__}: "
        results, error = [{} for _ in block.points], f"{kind}{failure}"
    return [
        {"part": part.name, "point": block.first + number, **point, **result, "error": error}
        for number, (point, result) in enumerate(zip(block.points, results, strict=True))
    ]


def _prepare() -> None:
    set_variant(VARIANT)
    plugins.register()
    direct.register()


def _results(part: Part, block: Block) -> list[Row]:
    if part.scene == "patch":
        return _patch(part, block.points)
    if part.scene == "lobe":
        return [_lobe(part, point) for point in block.points]
    return [rendered.row(part, point, block.identity) for point in block.points]


def _patch(part: Part, points: Sequence[Point]) -> list[Row]:
    """Return the columns of views of a surface of one material, one direction per point."""
    material = surface.material(points[0], part.convention)
    angles = {
        name: np.array([point[name] for point in points])
        for name in ("light_angle", "view_angle", "azimuth")
    }
    light = surface.direction(angles["light_angle"], 180.0)
    view = surface.direction(angles["view_angle"], angles["azimuth"])
    heuristic = surface.heuristic_radiance(material.phong, light, view)
    reference = surface.reference_radiance(material.plastic, light, view)
    columns = measure_each(heuristic.total, reference.total)
    columns["specular_heuristic"] = heuristic.specular
    columns["specular_reference"] = reference.specular
    columns = {name: np.broadcast_to(values, len(points)) for name, values in columns.items()}
    return [
        {name: float(values[number]) for name, values in columns.items()} | _shared(material)
        for number in range(len(points))
    ]


def _lobe(part: Part, point: Point) -> Row:
    """Return the departure over all views, the albedos, and the peak of the specular part.

    Statistics are over views of equal projected solid angle.
    """
    material, angle = surface.material(point, part.convention), point["light_angle"]
    plane = surface.direction(np.arange(0, 90, PEAK_STEP), 0.0)
    mirror = surface.direction(angle, 0.0)
    parts = (surface.views(), surface.hemisphere().view, plane, mirror)
    view = np.concatenate(parts, axis=1)
    light = np.broadcast_to(surface.direction(angle, 180.0), view.shape)
    splits = np.cumsum([part.shape[1] for part in parts])[:-1]
    result: Row = _shared(material)
    images = []
    for name, radiance in (
        ("heuristic", surface.heuristic_radiance(material.phong, light, view)),
        ("reference", surface.reference_radiance(material.plastic, light, view)),
    ):
        seen, hemisphere, _, _ = np.split(radiance.total, splits)
        _, specular, in_plane, mirrored = np.split(radiance.specular, splits)
        images.append(np.repeat(seen[None, :, None], 3, axis=2))
        result[f"albedo_{name}"] = surface.albedo(hemisphere, angle)
        result[f"specular_albedo_{name}"] = surface.albedo(specular, angle)
        result[f"specular_{name}"] = float(mirrored[0])
        highest = in_plane > in_plane.max() * (1 - 1e-6)
        if np.count_nonzero(highest) * PEAK_STEP < 1:  # n = 0 has no peak, k_s = 0 no lobe
            result[f"peak_{name}"] = float(np.argmax(in_plane)) * PEAK_STEP
    test, truth = images
    return result | measure(test, truth, np.ones(test.shape[:2], bool))


def _shared(material: Material) -> dict[str, float]:
    return material.values() | {"miss": largest_miss(material.misses)}
