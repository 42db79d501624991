"""Find pixels where the reference itself is at fault, so the heuristic is not blamed for them.

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

Masks may overlap. `find` is a function of plain arrays; `of_scene` collects them.

For which lights the normals disagree depends on geometry alone. Points, spots and directional
lights have one direction. An area light is sampled at :data:`LIGHT_GRID` squared points of each of
its shapes, with edges and corners; one point is enough. Light that falls between them is so near
the shading normal's horizon that it is dark. Under an environment, the hemispheres of unequal
normals always differ by a wedge. Under uniform light, it loses the share ``(1 - N.N_g) / 2`` of the
irradiance, and counts from :data:`WEDGE_LOST` on.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from comparisons.departure.blocks import bands
from comparisons.records import Count, Record
from heuristic.arrays import Scene, Shape
from heuristic.plugins.mapped import SMALLEST_ALPHA
from reference.pairing.albedo import RoughPlastic, of_roughplastic, prepare

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
class Limits:
    """Masks (H, W) of counted pixels, by limit."""

    clamped: np.ndarray
    terminator: np.ndarray
    energy_loss: np.ndarray
    fireflies: np.ndarray

    @property
    def any(self) -> np.ndarray:
        """The pixels with at least one limit."""
        return self.clamped | self.terminator | self.energy_loss | self.fireflies

    def counts(self) -> LimitCounts:
        """Return the number of pixels by limit, and ``any``."""
        return LimitCounts(
            **{name: int(getattr(self, name).sum()) for name in LimitCounts.__struct_fields__}
        )


@dataclass(frozen=True)
class Lights:
    """Origins of light: points (N, 3), directions towards it (M, 3), and whether from all sides."""

    points: np.ndarray
    directions: np.ndarray
    surrounding: bool = False


@dataclass(frozen=True)
class Surfaces:
    """Inputs of limits at the first surfaces on a grid of camera rays.

    ``alpha`` (H, W) is infinite and ``albedo`` (H, W) is 1 where there is no ``roughplastic``.
    ``albedo`` is of the same surface in a white furnace: at normal incidence, with a reflectance of
    1. ``position`` is in world space, ``shading`` and ``geometric`` are normals, ``view`` is the
    direction towards the viewer, (H, W, 3).
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
) -> Limits:
    """Return the limits of a reference.

    Parameters
    ----------
    surfaces
        See `of_scene`.
    mean, standard_error
        (H, W, 3): the reference's estimate and its standard error from independent passes.
    counted
        (H, W): the pixels that count; if omitted, those that see a surface.
    """
    counted = surfaces.hit if counted is None else np.asarray(counted, bool)
    return _masks(surfaces, fireflies(mean, standard_error), counted)


def count(
    scene: Scene, mean: np.ndarray, standard_error: np.ndarray, counted: np.ndarray
) -> LimitCounts:
    """Count the pixels of a scene's reference that `find` would return, by bands of rows."""
    flies = fireflies(mean, standard_error)
    total = dict.fromkeys(LimitCounts.__struct_fields__, 0)
    height, width = counted.shape
    for rows in bands(height):
        surfaces = of_scene(scene, width, height, rows=rows)
        found = _masks(surfaces, flies[rows], counted[rows]).counts()
        total = {name: total[name] + getattr(found, name) for name in total}
    return LimitCounts(**total)


def _masks(surfaces: Surfaces, flies: np.ndarray, counted: np.ndarray) -> Limits:
    return Limits(
        clamped=counted & (surfaces.alpha <= SMALLEST_ALPHA),
        terminator=counted & terminator(surfaces),
        energy_loss=counted & (surfaces.albedo < 1 - LOST),
        fireflies=counted & flies,
    )


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
    scene: Scene, width: int, height: int, sensor: int = 0, rows: slice = slice(None)
) -> Surfaces:
    """Collect what the centres of a scene's pixels see, in some rows."""
    heights = (np.arange(height)[rows] + 0.5) / height
    x, y = np.meshgrid((np.arange(width) + 0.5) / width, heights)
    height = len(heights)
    place = mi.Point2f(mi.Float(x.ravel()), mi.Float(y.ravel()))
    ray, _ = scene.sensors()[sensor].sample_ray_differential(0.0, 0.5, place, mi.Point2f(0.5))
    si = scene.ray_intersect(ray)
    hit = si.is_valid()

    def grid(vector: Any) -> np.ndarray:
        return np.array(dr.select(hit, mi.Vector3f(vector), 0)).T.reshape(height, width, 3)

    index = np.array(dr.reinterpret_array(mi.UInt32, si.shape)).reshape(height, width)
    alpha, albedo = np.full((height, width), np.inf), np.ones((height, width))
    plastics = {shape: _roughplastic(shape.bsdf()) for shape in scene.shapes()}
    prepare(plastic for plastic in plastics.values() if plastic is not None)
    for shape, plastic in plastics.items():
        if plastic is not None:
            is_here = index == int(dr.reinterpret_array(mi.UInt32, mi.ShapePtr(shape))[0])
            alpha[is_here], albedo[is_here] = plastic.alpha, _furnace(plastic)
    seen = np.array(hit).reshape(height, width)
    normals = grid(si.sh_frame.n), grid(si.n)
    return Surfaces(seen, alpha, albedo, grid(si.p), *normals, grid(-ray.d), lights_of(scene))


def _roughplastic(bsdf: Any) -> RoughPlastic | None:
    """Return the parameters of a ``roughplastic``, also within ``twosided``, or None."""
    if "RoughPlastic" not in str(bsdf):
        return None
    params = {name.rpartition(".")[2]: value for name, value in mi.traverse(bsdf)}
    return RoughPlastic((1.0,) * 3, _first(params["alpha"]), _first(params["eta"]))


def _first(value: Any) -> float:
    return float(np.ravel(value)[0])


@lru_cache
def _furnace(plastic: RoughPlastic) -> float:
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
