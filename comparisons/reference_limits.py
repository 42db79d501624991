"""Pixels where the reference itself is at fault, so that they are not booked on the heuristic.

================  ===========================================================================
Limit             Where
================  ===========================================================================
``clamped``       the surface is smoother than Mitsuba computes: ``roughplastic`` takes every
                  alpha below :data:`SMALLEST_ALPHA` for that
``terminator``    the shading normal and the geometric one disagree on which side a light or
                  the viewer is; one of the two renders black what the other lights
``energy_loss``   the surface loses more than :data:`LOST` of the light that it should reflect:
                  ``roughplastic`` follows light through one reflection alone
``fireflies``     a few samples carry the estimate: its standard error is more than
                  :data:`FIREFLY_SHARE` of it, and far above that of the pixels around it
================  ===========================================================================

Masks may overlap. `find` is a function of plain arrays; `of_scene` collects them.
"""

from dataclasses import dataclass, fields

import drjit as dr
import mitsuba as mi
import numpy as np

from reference.albedo import RoughPlastic, of_roughplastic

SMALLEST_ALPHA = 1e-4
LOST = 0.05
"""Smooth ``roughplastic`` already loses 0.03, since its diffuse part is an approximation."""
FIREFLY_SHARE = 0.5
FIREFLY_CONTRAST = 8.0
NEIGHBOURHOOD = 5


@dataclass(frozen=True)
class Limits:
    """Masks (H, W) of counted pixels, by limit."""

    clamped: np.ndarray
    terminator: np.ndarray
    energy_loss: np.ndarray
    fireflies: np.ndarray

    @property
    def any(self):
        """The pixels with one limit or more."""
        return self.clamped | self.terminator | self.energy_loss | self.fireflies

    def data(self):
        """Return the number of pixels by limit, and ``any``, as plain data."""
        counts = {field.name: int(getattr(self, field.name).sum()) for field in fields(self)}
        return counts | {"any": int(self.any.sum())}


@dataclass(frozen=True)
class Surfaces:
    """What limits depend on, at the first surface on a grid of camera rays.

    ``alpha`` (H, W) is infinite and ``albedo`` (H, W) 1 where there is no ``roughplastic``;
    ``albedo`` is that of the same surface under the white furnace: at normal incidence with a
    reflectance of 1. ``shading`` and ``geometric`` are normals, ``view`` the direction towards the
    viewer, (H, W, 3); ``lights`` a list of directions towards lights, (H, W, 3) each.
    """

    hit: np.ndarray
    alpha: np.ndarray
    albedo: np.ndarray
    shading: np.ndarray
    geometric: np.ndarray
    view: np.ndarray
    lights: tuple


def find(surfaces, mean, standard_error, counted=None):
    """Return the :class:`Limits` of a reference.

    Parameters
    ----------
    surfaces : Surfaces
        As `of_scene` returns them.
    mean, standard_error
        (H, W, 3): the reference's estimate and its standard error from independent passes.
    counted
        (H, W), the pixels that count; those that hit a surface where it is not given.
    """
    counted = surfaces.hit if counted is None else np.asarray(counted, bool)
    return Limits(
        clamped=counted & (surfaces.alpha <= SMALLEST_ALPHA),
        terminator=counted & terminator(surfaces),
        energy_loss=counted & (surfaces.albedo < 1 - LOST),
        fireflies=counted & fireflies(mean, standard_error),
    )


def terminator(surfaces):
    """Return where shading and geometric normal disagree about a light or the viewer."""
    mask = np.zeros(surfaces.hit.shape, bool)
    for direction in (surfaces.view, *surfaces.lights):
        sides = [np.einsum("...i,...i", n, direction) > 0 for n in (
            surfaces.shading, surfaces.geometric)]  # fmt: skip
        mask |= sides[0] != sides[1]
    return mask & surfaces.hit


def fireflies(mean, standard_error):
    """Return where a few samples carry the estimate.

    If all light of a pixel came in one of many passes, its standard error would equal its mean. So
    ``SE > FIREFLY_SHARE mean`` in the sum of the channels, and ``SE`` exceeds
    :data:`FIREFLY_CONTRAST` times the median of the pixels around, where the image is not noisy
    throughout.
    """
    from scipy.ndimage import median_filter

    total = np.abs(np.asarray(mean, float)).sum(axis=-1)
    error = np.asarray(standard_error, float).sum(axis=-1)
    around = median_filter(error, size=NEIGHBOURHOOD, mode="nearest")
    return (error > FIREFLY_SHARE * total) & (error > FIREFLY_CONTRAST * around)


def of_scene(scene, width, height, sensor=0):
    """Collect the :class:`Surfaces` that the centres of a scene's pixels see."""
    x, y = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    place = mi.Point2f(mi.Float(x.ravel()), mi.Float(y.ravel()))
    ray, _ = scene.sensors()[sensor].sample_ray_differential(0.0, 0.5, place, mi.Point2f(0.5))
    si = scene.ray_intersect(ray)
    hit = si.is_valid()

    def grid(vector):
        return np.array(dr.select(hit, mi.Vector3f(vector), 0), float).T.reshape(height, width, 3)

    index = np.array(dr.reinterpret_array(mi.UInt32, si.shape)).reshape(height, width)
    alpha, albedo = np.full((height, width), np.inf), np.ones((height, width))
    for shape in scene.shapes():
        found = _roughplastic(shape.bsdf())
        if found is not None:
            is_here = index == int(dr.reinterpret_array(mi.UInt32, mi.ShapePtr(shape))[0])
            alpha[is_here], albedo[is_here] = found.alpha, _furnace(found)
    position = grid(si.p)
    lights = tuple(np.array(p, float).ravel() - position for p in _positions(scene))
    seen = np.array(hit).reshape(height, width)
    return Surfaces(seen, alpha, albedo, grid(si.sh_frame.n), grid(si.n), grid(-ray.d), lights)


def _roughplastic(bsdf):
    """Return the parameters of a ``roughplastic``, also within ``twosided``, or None."""
    if "RoughPlastic" not in str(bsdf):
        return None
    params = {name.rpartition(".")[2]: value for name, value in mi.traverse(bsdf)}
    return RoughPlastic((1.0,) * 3, _first(params["alpha"]), _first(params["eta"]))


def _first(value):
    return float(np.ravel(value)[0])


def _furnace(plastic):
    albedo = of_roughplastic(plastic)
    return float((albedo.diffuse + albedo.specular).mean())


def _positions(scene):
    """Return the positions of the lights that are points or spots."""
    for emitter in scene.emitters():
        if not emitter.flags() & +mi.EmitterFlags.DeltaPosition:
            continue
        params = mi.traverse(emitter)
        if "position" in params:
            yield params["position"]
        elif "to_world" in params:
            yield np.array(params["to_world"].matrix)[:3, 3]
