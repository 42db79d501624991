"""Count pixels where the reference itself is at fault, so the heuristic is not blamed for them.

================  ===========================================================================
Limit             Where
================  ===========================================================================
``clamped``       the surface is smoother than Mitsuba allows: ``roughplastic`` raises every
                  smaller alpha to :data:`SMALLEST_ALPHA`
``terminator``    shading normal and geometric normal disagree on which side a light or the
                  viewer is: one half renders black what the other lights
``energy_loss``   the surface loses more than :data:`LOST` of the light that it should reflect:
                  ``roughplastic`` follows light through only one reflection
``fireflies``     a few samples dominate the estimate: its standard error exceeds
                  :data:`FIREFLY_SHARE` of it, and far exceeds that of nearby pixels
================  ===========================================================================

Masks may overlap. `find` is a function of plain arrays; `of_scene` collects them, and reads the
materials from the scene's graph, through ``twosided``, ``blendbsdf``, ``mask`` and bumps.

For which lights the normals disagree depends on geometry alone. Points, spots and directional
lights have one direction. An area light is sampled at :data:`LIGHT_GRID` squared points of each of
its shapes, with edges and corners; one point is enough. Light that falls between them is so near
the shading normal's horizon that it is dark. Under an environment, the hemispheres of unequal
normals always differ by a wedge. Under uniform light, it loses the share ``(1 - N.N_g) / 2`` of the
irradiance, and counts from :data:`WEDGE_LOST` on.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import drjit as dr
import mitsuba as mi
import numpy as np

from comparisons.departure.blocks import bands
from heuristic.convention import Scene, Shape
from heuristic.materials import SMALLEST_ALPHA
from reference.records import Count, Record
from reference.scene.graph import Graph
from reference.scene.values import number

if TYPE_CHECKING:
    from reference.pairing.albedo import RoughPlastic

LOST = 0.05
"""Smooth ``roughplastic`` already loses 0.03, since its diffuse part is an approximation."""
WEDGE_LOST = 0.01
"""The share lost by normals 11.5 degrees apart."""
LIGHT_GRID = 5
FIREFLY_SHARE = 0.5
FIREFLY_CONTRAST = 8.0
NEIGHBOURHOOD = 5


class LimitCounts(Record):
    """Counted pixels where the reference itself is at fault, by limit; limits may overlap."""

    clamped: Count
    terminator: Count
    energy_loss: Count
    fireflies: Count
    any: Count


@dataclass(frozen=True)
class Lights:
    """Origins of light: points (N, 3), directions towards it (M, 3), and whether from all sides."""

    points: np.ndarray
    directions: np.ndarray
    surrounding: bool = False


@dataclass(frozen=True)
class Surfaces:
    """Inputs of limits at the first surfaces on a grid of camera rays.

    ``alpha`` (H, W) is the smallest of any ``roughplastic`` there, infinite without one. ``albedo``
    (H, W) is that of the same surface in a white furnace, at normal incidence and with reflectances
    of 1; it is 1 without a ``roughplastic``. ``position`` is in world space, ``shading`` and
    ``geometric`` are normals, ``view`` is the direction towards the viewer, (H, W, 3).
    """

    hit: np.ndarray
    alpha: np.ndarray
    albedo: np.ndarray
    position: np.ndarray
    shading: np.ndarray
    geometric: np.ndarray
    view: np.ndarray
    lights: Lights


def find(
    surfaces: Surfaces,
    mean: np.ndarray,
    standard_error: np.ndarray,
    counted: np.ndarray | None = None,
) -> dict[str, np.ndarray]:
    """Return masks (H, W) of the counted pixels with each limit, and with any.

    ``mean`` and ``standard_error`` (H, W, 3) are the reference's, from independent passes.
    """
    counted = surfaces.hit if counted is None else np.asarray(counted, bool)
    return _masks(surfaces, fireflies(mean, standard_error), counted)


def count(
    scene: Scene, graph: Graph, mean: np.ndarray, standard_error: np.ndarray, counted: np.ndarray
) -> LimitCounts:
    """Count the pixels of a scene's reference that `find` would return, by bands of rows."""
    flies = fireflies(mean, standard_error)
    total = dict.fromkeys(LimitCounts.__struct_fields__, 0)
    height, width = counted.shape
    for rows in bands(height):
        surfaces = of_scene(scene, graph, width, height, rows)
        for name, mask in _masks(surfaces, flies[rows], counted[rows]).items():
            total[name] += int(mask.sum())
    return LimitCounts(**total)


def _masks(surfaces: Surfaces, flies: np.ndarray, counted: np.ndarray) -> dict[str, np.ndarray]:
    masks = {
        "clamped": counted & (surfaces.alpha <= SMALLEST_ALPHA),
        "terminator": counted & terminator(surfaces),
        "energy_loss": counted & (surfaces.albedo < 1 - LOST),
        "fireflies": counted & flies,
    }
    return masks | {"any": np.any(list(masks.values()), axis=0)}


def terminator(surfaces: Surfaces) -> np.ndarray:
    """Return where shading and geometric normals disagree about a light or the viewer."""
    mask = surfaces.hit & (surfaces.shading != surfaces.geometric).any(axis=-1)
    position, shading, geometric, view = (
        getattr(surfaces, name)[mask].astype(float)
        for name in ("position", "shading", "geometric", "view")
    )

    def disagree(direction: np.ndarray) -> np.ndarray:
        sides = [np.einsum("...i,...i", n, direction) > 0 for n in (shading, geometric)]
        return sides[0] != sides[1]

    lights = surfaces.lights
    found = disagree(view)
    for point in lights.points:
        found |= disagree(point - position)
    for direction in lights.directions:
        found |= disagree(np.broadcast_to(direction, shading.shape))
    if lights.surrounding:
        found |= (1 - np.einsum("...i,...i", shading, geometric)) / 2 > WEDGE_LOST
    mask[mask] = found
    return mask


def fireflies(mean: np.ndarray, standard_error: np.ndarray) -> np.ndarray:
    """Return where a few samples dominate the estimate.

    If all light of a pixel came in one of many passes, its standard error would equal its mean. So
    the condition is ``SE > FIREFLY_SHARE mean`` in the sum of the channels. ``SE`` must also exceed
    :data:`FIREFLY_CONTRAST` times the median nearby, since the whole image may be noisy.
    """
    mean, standard_error = np.asarray(mean), np.asarray(standard_error)
    found = np.zeros(mean.shape[:2], bool)
    for rows in bands(len(found)):
        total = np.abs(mean[rows]).sum(axis=-1, dtype=float)
        error, lower = _lower_around(standard_error, rows)
        # A median is below a value if more than half of its inputs are.
        found[rows] = (error > FIREFLY_SHARE * total) & (lower > NEIGHBOURHOOD**2 // 2)
    return found


def _lower_around(standard_error: np.ndarray, rows: slice) -> tuple[np.ndarray, np.ndarray]:
    """Return the errors (h, W) of some rows, and how many nearby are far lower; edges repeat."""
    reach = NEIGHBOURHOOD // 2
    height, width = standard_error.shape[:2]
    near = np.clip(np.arange(rows.start - reach, rows.stop + reach), 0, height - 1)
    error = np.pad(standard_error[near].sum(axis=-1, dtype=float), ((0, 0), (reach, reach)), "edge")
    own = error[reach : reach + rows.stop - rows.start, reach : reach + width]
    limit, lower = own / FIREFLY_CONTRAST, np.zeros(own.shape, np.uint8)
    for y, x in np.ndindex(NEIGHBOURHOOD, NEIGHBOURHOOD):
        lower += error[y : y + len(own), x : x + width] < limit
    return own, lower


def of_scene(
    scene: Scene, graph: Graph | None, width: int, height: int, rows: slice = slice(None)
) -> Surfaces:
    """Collect what the centres of a scene's pixels see, in some rows.

    Materials are read from the graph that the scene was made of; without it, they have no limit.
    """
    heights = (np.arange(height)[rows] + 0.5) / height
    x, y = np.meshgrid((np.arange(width) + 0.5) / width, heights)
    height = len(heights)
    place = mi.Point2f(mi.Float(x.ravel()), mi.Float(y.ravel()))
    ray, _ = scene.sensors()[0].sample_ray_differential(0.0, 0.5, place, mi.Point2f(0.5))
    si = scene.ray_intersect(ray)
    hit = si.is_valid()

    def grid(vector: Any) -> np.ndarray:
        return np.array(dr.select(hit, mi.Vector3f(vector), 0)).T.reshape(height, width, 3)

    alpha, albedo = np.full((2, height * width), ((np.inf,), (1.0,)))
    if graph is not None:
        _read_plastics(graph, si, alpha, albedo)
    seen = np.array(hit).reshape(height, width)
    return Surfaces(
        seen,
        alpha.reshape(seen.shape),
        albedo.reshape(seen.shape),
        grid(si.p),
        grid(si.sh_frame.n),
        grid(si.n),
        grid(-ray.d),
        lights_of(scene),
    )


def _read_plastics(graph: Graph, si: Any, alpha: np.ndarray, albedo: np.ndarray) -> None:
    """Fill in alpha and albedo (N) where surfaces (N) show a ``roughplastic`` of the graph."""
    nodes = graph.nodes(mi.ObjectType.BSDF)
    if "roughplastic" not in map(graph.plugin, nodes):
        return
    from reference.pairing.nearest import white_roughplastic  # loaded late: only for plastics

    plastics = {i: white_roughplastic(graph, i) for i in nodes}
    furnaces = {i: plastic for i, plastic in plastics.items() if plastic is not None}
    if not furnaces:
        return
    bsdfs: dict[str, list[int]] = {}
    for node in graph.nodes(mi.ObjectType.Shape):
        children = graph.children(node, mi.ObjectType.BSDF)
        bsdfs.setdefault(graph.props(node).id(), []).extend(i for _, i in children)
    pointers = np.array(dr.reinterpret_array(mi.UInt32, si.shape))
    numbers, first = np.unique(pointers, return_index=True)
    for pointer, at in zip(numbers, first, strict=True):
        found = bsdfs.get(si.shape[int(at)].id(), []) if pointer else []
        if len(found) == 1:  # shapes of two groups may have one name
            here = pointers == pointer
            values = _of_material(graph, found[0], si, furnaces)
            alpha[here], albedo[here] = (np.broadcast_to(v, here.shape)[here] for v in values)


def _of_material(
    graph: Graph, index: int, si: Any, plastics: "Mapping[int, RoughPlastic]"
) -> tuple[Any, Any]:
    """Return the least alpha and the furnace's albedo of a BSDF at surfaces, also nested."""
    if index in plastics:
        return plastics[index].alpha, _furnace(plastics[index])
    children = graph.children(index, mi.ObjectType.BSDF)
    inner = [_of_material(graph, child, si, plastics) for _, child in children]
    match graph.plugin(index), inner:
        case "twosided", [front, back]:
            is_front = np.array(si.wi.z) > 0
            return tuple(np.where(is_front, *sides) for sides in zip(front, back, strict=True))
        case "blendbsdf", [first, second]:
            return _mixed(second, first, _share(graph, index, "weight", si))
        case "mask", [only]:
            return _mixed(only, (np.inf, 1.0), _share(graph, index, "opacity", si))
        case "twosided" | "bumpmap" | "normalmap", [only]:
            return only
    return np.inf, 1.0


def _mixed(a: tuple[Any, Any], b: tuple[Any, Any], share: np.ndarray) -> tuple[Any, Any]:
    """Return alpha and albedo of a surface of which ``a`` has a share and ``b`` the rest."""
    alpha = np.minimum(np.where(share > 0, a[0], np.inf), np.where(share < 1, b[0], np.inf))
    return alpha, share * a[1] + (1 - share) * b[1]


def _share(graph: Graph, index: int, key: str, si: Any) -> np.ndarray:
    """Return a weight between 0 and 1 at surfaces; it may be a texture."""
    textures = dict(graph.children(index, mi.ObjectType.Texture))
    if key in textures:
        value = np.array(graph.instantiate(textures[key]).eval_1(si))
    else:
        value = np.array(number(graph, index, key, 0.5))
    return np.clip(value, 0, 1)


@lru_cache
def _furnace(plastic: "RoughPlastic") -> float:
    from reference.pairing.albedo import of_roughplastic  # loaded late: see _read_plastics

    albedo = of_roughplastic(plastic)
    return float((albedo.diffuse + albedo.specular).mean())


def lights_of(scene: Scene) -> Lights:
    """Return the lights of a scene."""
    points, directions, surrounding = [], [], False
    shining = [shape for shape in scene.shapes() if shape.is_emitter()]
    for emitter in scene.emitters():
        flags = emitter.flags()
        if flags & +mi.EmitterFlags.Surface:
            continue
        params = mi.traverse(emitter)
        if flags & +mi.EmitterFlags.DeltaPosition:
            points.append(_given(params, "position", column=3))
        elif flags & +mi.EmitterFlags.DeltaDirection:
            directions.append(-_given(params, "direction", column=2))
        elif flags & +mi.EmitterFlags.Infinite:
            surrounding = True
    for shape in shining:
        places, normals = _points_on(shape)
        if shape.emitter().flags() & +mi.EmitterFlags.DeltaDirection:
            directions.extend(-np.unique(normals, axis=0))
        else:
            points.extend(places)
    return Lights(np.reshape(points, (-1, 3)), np.reshape(directions, (-1, 3)), surrounding)


def _given(params: Any, name: str, column: int) -> np.ndarray:
    """Return a parameter of three numbers, or the column of ``to_world`` that replaces it."""
    value = params[name] if name in params else params["to_world"].matrix
    value = np.array(value, float)
    return value.ravel() if name in params else value[:3, column].ravel()


def _points_on(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Return points and normals of a shape, (N, 3) each, on a grid that includes its edges."""
    places = np.linspace(0, 1 - 2**-24, LIGHT_GRID)
    x, y = (axis.ravel() for axis in np.meshgrid(places, places))
    found = shape.sample_position(0.0, mi.Point2f(mi.Float(x), mi.Float(y)))
    return np.array(found.p, float).T, np.array(found.n, float).T
