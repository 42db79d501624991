"""Indirect light at the points that the camera sees.

It is reflected by other surfaces, or comes from the unhidden environment. It is gathered in the
heuristic half, by Mitsuba's ``path`` over the ``phong`` materials and the heuristic's lights, from
a coarse grid of the points that the camera sees::

    I = E / pi = 1 / N sum_j L(w_j) + 1 / (pi N) sum_j L_env(w'_j) V (n.w'_j) / p(w'_j)

where the directions ``w`` follow the cosine and ``w'`` the environment's light. ``L`` is the light
reflected towards the point. The seed is fixed, so runs repeat.
"""

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from heuristic.convention import RADIANCE_PER_IRRADIANCE
from heuristic.plugins.scene_materials import SceneMaterials
from heuristic.stand_ins import tabulated

GRID = 32
"""Points along each side of the image."""

STRATA = 4
"""Directions along each side of the square that maps to a point's hemisphere."""

REFLECTIONS = 16
"""Longest path. Mitsuba ends most paths sooner, by Russian roulette after five."""


@dataclass(frozen=True)
class Seen:
    """Points that the camera sees, with the shaded sides.

    Attributes
    ----------
    si
        The surface interactions, in the current variant.
    normal
        Unit shading normals on the viewer's side.
    k_d
        Diffuse coefficient of the surface; 0 where nothing is seen.
    """

    si: Any
    normal: Any
    k_d: Any

    def visible(self, scene: Any) -> Any:
        """Return ``visible(toward, distance)``, the shadow test at the points."""
        return lambda toward, distance: (
            ~scene.ray_test(self.si.spawn_ray_to(self.si.p + toward * distance))
        )


@dataclass(frozen=True)
class Gathered:
    """Light at points that the camera sees, for each of K channels or wavelengths.

    Attributes
    ----------
    normal
        (N, 3).
    arriving
        (N, K): ``E / pi``, the value of a white surface.
    k_d
        (N, K): the weight of each in the image.
    """

    normal: np.ndarray
    arriving: np.ndarray
    k_d: np.ndarray

    def mean(self, of: np.ndarray | None = None) -> np.ndarray:
        """Return the mean (K,) of the arriving light, or of values (N, 1 or K), over the image.

        The weight of a point is its ``k_d``: ``k_d`` times the mean then has the same mean over the
        image as ``k_d`` times the arriving light.
        """
        values = self.arriving if of is None else of
        weight = self.k_d.sum(axis=0)
        total = (values * self.k_d).sum(axis=0)
        return np.divide(total, weight, out=np.zeros_like(total), where=weight > 0)


def seen(scene: Any, repeat: int = 1, wavelengths: Any = ()) -> Seen:
    """Return the points of the grid, each repeated as often as requested."""
    cells = (np.arange(GRID) + 0.5) / GRID
    x, y = (np.repeat(side.ravel(), repeat) for side in np.meshgrid(cells, cells))
    place = mi.Point2f(mi.Float(x), mi.Float(y))
    ray, _ = scene.sensors()[0].sample_ray(0.0, 0.5, place, mi.Point2f(0.5))
    if mi.is_spectral:
        ray.wavelengths = mi.Spectrum(wavelengths)
    si = scene.ray_intersect(ray)
    active = si.is_valid()
    materials = SceneMaterials(scene)
    twosided = materials.twosided(si, active)
    active &= twosided | (si.wi.z > 0)
    normal = materials.normal(si, active)
    normal = dr.select(si.wi.z < 0, -normal, normal)
    k_d = mi.Spectrum(0)
    for material, is_here in materials.at(si, active):
        k_d += dr.select(active & is_here, mi.Spectrum(material.k_d), 0)
    return Seen(si, normal, k_d)


def gather(scene: Any) -> Gathered:
    """Gather light at the points of the grid, in the current variant."""
    arriving, k_d = [], []
    for wavelengths in tabulated.batches():
        at = seen(scene, STRATA**2, wavelengths)
        found = _arriving(scene, at)
        dr.eval(found, at.k_d, at.normal)
        arriving.append(_by_point(found))
        k_d.append(_by_point(at.k_d))
    normal = np.array(at.normal, float).T[:: STRATA**2]
    return Gathered(normal, np.hstack(arriving), np.hstack(k_d))


def _by_point(value: Any) -> np.ndarray:
    """Return the means of the directions of each point, (N, channels)."""
    rows = tabulated.columns(value, GRID**2 * STRATA**2)
    return rows.reshape(GRID**2, STRATA**2, -1).mean(axis=1)


def _arriving(scene: Any, at: Seen) -> Any:
    """Return one sample of ``E / pi`` at each point."""
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(0, GRID**2 * STRATA**2)
    active = at.si.is_valid()
    cell = dr.arange(mi.UInt32, GRID**2 * STRATA**2) % STRATA**2
    corner = mi.Point2f(mi.Float(cell % STRATA), mi.Float(cell // STRATA))
    toward = mi.warp.square_to_cosine_hemisphere((corner + sampler.next_2d()) / STRATA)
    ray = at.si.spawn_ray(mi.Frame3f(at.normal).to_world(toward))
    # The visible environment is added below: rays would hit a sun too seldom.
    paths = mi.load_dict({"type": "path", "max_depth": REFLECTIONS + 1, "hide_emitters": True})
    reflected, _, _ = paths.sample(scene, sampler, ray, active=active)
    from_around = _from_environment(scene, at, (corner + sampler.next_2d()) / STRATA, active)
    return dr.select(active, reflected, 0) + from_around


def _from_environment(scene: Any, at: Seen, place: Any, active: Any) -> Any:
    environment = scene.environment()
    if environment is None:
        return mi.Spectrum(0)
    sample, light = environment.sample_direction(at.si, place, active)
    cosine = dr.maximum(dr.dot(at.normal, sample.d), 0)
    lit = active & (sample.pdf > 0) & (cosine > 0)
    seen = lit & ~scene.ray_test(at.si.spawn_ray_to(sample.p), lit)
    return dr.select(seen, light * cosine * RADIANCE_PER_IRRADIANCE, 0)
