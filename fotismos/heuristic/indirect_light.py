"""Indirect light gathered at visible points, and ambient light that is set to it.

``I = ... + k_d A``, where ``A`` stands for the light that other surfaces reflect, or that comes
from the unhidden environment. It is gathered in the textbook half, by Mitsuba's ``path`` over the
``phong`` materials and the heuristic's lights, from a coarse grid of the points that the camera
sees::

    I = E / pi = 1 / N sum_j L(w_j) + 1 / (pi N) sum_j L_env(w'_j) V (n.w'_j) / p(w'_j)

where the directions ``w`` follow the cosine and ``w'`` the environment's light. ``L`` is the light
reflected towards the point. The seed is fixed, so runs repeat.

``A`` comes from a sky of radiance ``S`` above the horizon and a ground of ``G`` below. A surface
with ``c = n.up`` receives ``E / pi = S (1 + c) / 2 + G (1 - c) / 2``: the integral of both halves
over its hemisphere. ``S`` and ``G`` are fitted by least squares to these points, each weighted by
its ``k_d``, which keeps the image's mean.

The sun of ``sunsky`` is one of the lights, so it is not part of the environment here. ``I_a``
stands for the environment if the scene has one, and is then replaced. If the scene has its
own ``I_a``, it stays, and the light reflected by surfaces is added.
"""

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from fotismos.heuristic import background, materials
from fotismos.heuristic.convention import RADIANCE_PER_IRRADIANCE, Array, Doubles
from fotismos.heuristic.heuristics import INPUTS, Heuristic, Point
from fotismos.heuristic.plugins.coefficients import SceneMaterials

GRID = 32
"""Points along each side of the image."""

STRATA = 4
"""Directions along each side of the square that maps to a point's hemisphere."""

RAYS = GRID**2 * STRATA**2

REFLECTIONS = 16
"""Longest path. Mitsuba ends most paths sooner, by Russian roulette after five."""


def gather(scene: Any) -> tuple[Doubles, Doubles, Doubles]:
    """Return the light at points that the camera sees, in K channels.

    ``normal`` (N, 3), ``arriving`` (N, K): ``E / pi``, the value of a white surface, and ``k_d``
    (N, K): the weight of each in the image.
    """
    si, normal, k_d = _seen(scene)
    with background.without_sun(scene):
        light = _arriving(scene, si, normal)
        dr.eval(light, k_d, normal)
    return np.array(normal, float).T[:: STRATA**2], _by_point(light), _by_point(k_d)


def weighted_mean(arriving: Doubles, k_d: Doubles) -> Doubles:
    """Return the mean (K,) of the arriving light over the image, weighted by ``k_d``.

    ``k_d`` times it has the same mean over the image as ``k_d`` times the arriving light.
    """
    weight = k_d.sum(axis=0)
    total = (arriving * k_d).sum(axis=0)
    return np.asarray(np.divide(total, weight, out=np.zeros_like(total), where=weight > 0))


def _by_point(value: Any) -> Doubles:
    """Return the means of the directions of each point, (N, channels)."""
    value = mi.Spectrum(value) + dr.zeros(mi.Spectrum, RAYS)
    rows = np.array(value, float).reshape(-1, RAYS).T
    return np.asarray(rows.reshape(GRID**2, STRATA**2, -1).mean(axis=1))


def _seen(scene: Any) -> tuple[Any, Any, Any]:
    """Return the interactions of the grid's rays, the normals of the sides seen, and their k_d.

    Each point is repeated for its directions; where nothing is seen ``k_d`` is 0.
    """
    cells = (np.arange(GRID) + 0.5) / GRID
    columns, rows = np.meshgrid(cells, cells)
    x = mi.Float(np.repeat(columns.ravel(), STRATA**2))
    y = mi.Float(np.repeat(rows.ravel(), STRATA**2))
    film = mi.Point2f(x, y)
    ray, _ = scene.sensors()[0].sample_ray(0.0, 0.5, film, mi.Point2f(0.5))
    si = scene.ray_intersect(ray)
    active = si.is_valid()
    bsdfs = SceneMaterials(scene)
    active &= bsdfs.twosided(si, active) | (si.wi.z > 0)
    normal = bsdfs.normal(si, active)
    normal = dr.select(si.wi.z < 0, -normal, normal)
    k_d = mi.Spectrum(0)
    for material, is_here in bsdfs.at(si, active):
        k_d += dr.select(active & is_here, mi.Spectrum(material.k_d), 0)
    return si, normal, k_d


def _arriving(scene: Any, si: Any, normal: Any) -> Any:
    """Return one sample of ``E / pi`` for each direction of each point."""
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(0, RAYS)
    active = si.is_valid()
    # Each ray of a point has its own stratum.
    cell = dr.arange(mi.UInt32, RAYS) % STRATA**2
    corner = mi.Point2f(mi.Float(cell % STRATA), mi.Float(cell // STRATA))
    toward = mi.warp.square_to_cosine_hemisphere((corner + sampler.next_2d()) / STRATA)
    ray = si.spawn_ray(mi.Frame3f(normal).to_world(toward))
    # The visible environment is added below: rays would hit a small bright part too seldom.
    paths = mi.load_dict({"type": "path", "max_depth": REFLECTIONS + 1, "hide_emitters": True})
    reflected, _, _ = paths.sample(scene, sampler, ray, active=active)
    around = _from_environment(
        scene, si, normal=normal, sensor=(corner + sampler.next_2d()) / STRATA
    )
    return dr.select(active, reflected, 0) + around


def _from_environment(scene: Any, si: Any, normal: Any, sensor: Any) -> Any:
    environment = scene.environment()
    if environment is None:
        return mi.Spectrum(0)
    active = si.is_valid()
    sample, light = environment.sample_direction(si, sensor, active)
    cosine = dr.maximum(dr.dot(normal, sample.d), 0)
    active &= (sample.pdf > 0) & (cosine > 0)
    active &= ~scene.ray_test(si.spawn_ray_to(sample.p), active)
    return dr.select(active, light * cosine * RADIANCE_PER_IRRADIANCE, 0)


EVENNESS = 1e-3
"""Weight, relative to all points, that makes sky and ground equal if nothing distinguishes them
because all visible surfaces have the same inclination."""


def upward(scene: Any) -> Doubles:
    """Return the axis of the world, or its opposite, nearest to the camera's up vector."""
    matrix = np.array(scene.sensors()[0].world_transform().matrix, float)
    # The camera's up vector: its second axis, in the world.
    column = matrix.reshape(4, 4, -1)[:3, 1, 0]
    axis = int(np.argmax(np.abs(column)))
    return np.asarray(np.sign(column[axis]) * np.eye(3)[axis])


def fit(normal: Doubles, arriving: Doubles, k_d: Doubles, up: Doubles) -> tuple[Doubles, Doubles]:
    """Return sky and ground, (K,) each and not negative, by weighted least squares.

    A channel is ``A + B c`` with ``A`` through the mean, and ``|B| <= A``: if sky or ground would
    be negative it is 0, and the other alone keeps the mean.
    """
    cosine = (normal @ up)[:, None]
    total = k_d.sum(axis=0)
    mean = weighted_mean(arriving, k_d)
    share = np.divide(k_d, total, out=np.zeros_like(k_d), where=total > 0)
    # Weighted mean and variance of the cosine, and the slope of the regression, (K,) each.
    middle = (share * cosine).sum(axis=0)
    spread = (share * (cosine - middle) ** 2).sum(axis=0) + EVENNESS
    slope = (share * (cosine - middle) * (arriving - mean)).sum(axis=0) / spread
    # sky = A + B and ground = A - B are not negative, with A + B middle = mean.
    slope = np.clip(slope, -mean / (1 - middle + 1e-9), mean / (1 + middle + 1e-9))
    level = mean - slope * middle
    return np.maximum(level + slope, 0), np.maximum(level - slope, 0)


def fitted_sky(scene: Any) -> tuple[Array, Array, list[float], bool]:
    """Return sky, ground, the upward direction, and whether they replace ``I_a``."""
    up = upward(scene)
    normal, arriving, k_d = gather(scene)
    above, below = fit(normal, arriving, k_d, up)
    sky = mi.Spectrum(above.tolist())
    ground = mi.Spectrum(below.tolist())
    dr.make_opaque(sky, ground)  # as literals they would compile a kernel for every scene
    return sky, ground, up.tolist(), scene.environment() is not None


def refuse(scene: Any) -> str:
    """Return why there are no colours in RGB; empty if there are."""
    return f"{mi.variant()} has wavelengths in place of RGB" if mi.is_spectral else ""


def shade(point: Point) -> Array:
    """Return the chapters' model plus ``k_d`` times the light ``E / pi`` from sky and ground."""
    sky, ground, up, replaces_ambient = point.prepared
    cosine = dr.dot(point.normal, mi.Vector3f(up))
    arriving = sky * (0.5 + 0.5 * cosine) + ground * (0.5 - 0.5 * cosine)
    ambient = materials.checked_colour("ambient", point.arguments.ambient)
    stays = not (replaces_ambient or materials.is_zero(ambient))
    colour = point.textbook(ambient=ambient if stays else 0)
    return colour + point.material.k_d * arriving


HEMISPHERE = Heuristic(
    name="hemisphere-ambient",
    shade=shade,
    label="hemisphere ambient light",
    needs=frozenset(INPUTS) - {"uv", "environment", "visible"},
    prepare=fitted_sky,
    refuse=refuse,
)
