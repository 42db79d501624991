"""A flat surface under parallel light, evaluated without an image: kernel against Mitsuba's BSDF.

The light has the heuristic intensity 1, so the irradiance ``pi`` on a surface that faces it. The
surface lies in the plane z = 0, and the light in the plane y = 0 at negative x, so its mirror image
is at azimuth 0. Directions point away from the surface.
"""

from functools import lru_cache

import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike

from comparisons.audit import furnace
from comparisons.audit.subjects import shaded
from comparisons.study.dataset import Row, largest_miss, measure
from comparisons.study.scenes import Point
from heuristic.heuristics import PHONG
from heuristic.lights import DirectionalLight
from reference.pairing.albedo import RoughPlastic, to_phong, to_roughplastic
from reference.pairing.factors import Convention, Miss, Phong

HEIGHTS, AZIMUTHS = 240, 120
"""Directions of the quadrature over half the hemisphere; the other half is symmetric."""

VIEW_HEIGHTS, VIEW_AZIMUTHS = 96, 64

PEAK_STEP = 0.05
"""Degrees between the directions searched for a lobe's peak."""


@lru_cache(maxsize=256)
def material(
    point: tuple[tuple[str, float], ...], convention: Convention
) -> tuple[Phong, RoughPlastic, tuple[Miss, ...]]:
    """Return a point's material in both models, of which it has one, and the pairing's misses."""
    values = dict(point)
    if "n" not in values:
        grey = (values["reflectance"],) * 3
        plastic = RoughPlastic(grey, values["alpha"], values["int_ior"])
        return to_phong(plastic, convention), plastic, ()
    k_d, k_s = ((values[name],) * 3 for name in ("k_d", "k_s"))
    phong = Phong(k_d, k_s, values["n"])
    if not any(k_s):  # pairing makes it plain diffuse, not roughplastic
        return phong, RoughPlastic(k_d, 1.0, 1.0), ()
    return phong, *to_roughplastic(phong, convention)


def direction(theta: ArrayLike, phi: ArrayLike) -> np.ndarray:
    """Return unit vectors (3, N) from polar angles and azimuths in degrees."""
    return furnace.direction(np.deg2rad(theta), np.deg2rad(phi))


def heuristic_radiance(
    phong: Phong, light: np.ndarray, view: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the kernel's radiance (N,), in all and of the specular part alone.

    Directions (3, N) are of light and viewer. Display-linear: a white diffuse surface that faces
    the light has the value 1.
    """
    sun, place = DirectionalLight(-mi.Vector3f(light), 1.0), (0 * furnace.UP, furnace.UP, view)
    lobe = {"k_s": phong.k_s[0], "n": phong.n}
    total, specular = (
        np.array(shaded(PHONG, place, lobe | {"k_d": k_d}, [sun]), float)[0]
        for k_d in (phong.k_d[0], 0.0)
    )
    return total, specular


def reference_radiance(
    plastic: RoughPlastic, light: np.ndarray, view: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the radiance of Mitsuba's BSDF, as :func:`heuristic_radiance` does."""
    diffuse = {"reflectance": plastic.diffuse_reflectance[0]}
    bsdfs = [{"type": "diffuse", **diffuse}] * 2
    if plastic.int_ior != plastic.ext_ior:
        values = {name: getattr(plastic, name) for name in ("alpha", "int_ior", "ext_ior")}
        values |= {"type": "roughplastic", "diffuse_reflectance": diffuse["reflectance"]}
        bsdfs = [values | {"specular_reflectance": k} for k in (plastic.specular_reflectance[0], 0)]
    total, diffuse = (furnace.of_bsdf(mi.load_dict(bsdf))(light, view)[0] for bsdf in bsdfs)
    return total, total - diffuse


@lru_cache(maxsize=1)
def hemisphere() -> tuple[np.ndarray, np.ndarray]:
    """Return directions (3, N) over half the hemisphere, with weights (N,) for means and albedos.

    These are the Gauss-Legendre nodes in polar angle and azimuth; weights are proportional to the
    projected solid angle, and sum to 1.
    """
    x, w = np.polynomial.legendre.leggauss(HEIGHTS)
    w = w / 2
    y, v = np.polynomial.legendre.leggauss(AZIMUTHS)
    v = v / 2
    theta, phi = np.meshgrid((x + 1) * 45, (y + 1) * 90)
    weight = np.outer(v, w * np.sin(np.deg2rad(x * 90 + 90)))
    return direction(theta.ravel(), phi.ravel()), weight.ravel() / weight.sum()


@lru_cache(maxsize=1)
def views() -> np.ndarray:
    """Return directions of the viewer, (3, N), of equal projected solid angle.

    They cover half the hemisphere: centres of cells equal in ``sin^2(theta)`` and azimuth.
    """
    height = (np.arange(VIEW_HEIGHTS) + 0.5) / VIEW_HEIGHTS
    azimuth = (np.arange(VIEW_AZIMUTHS) + 0.5) * 180 / VIEW_AZIMUTHS
    theta, phi = np.meshgrid(np.rad2deg(np.arcsin(np.sqrt(height))), azimuth)
    return direction(theta.ravel(), phi.ravel())


def albedo(radiance: np.ndarray, light_angle: float) -> float:
    """Return the share of the light that leaves the surface, from radiances on :func:`hemisphere`.

    ``pi mean(L) / (pi cos(theta))``, the mean over projected solid angle: exitance over
    irradiance.
    """
    return float(hemisphere()[1] @ radiance / np.cos(np.deg2rad(light_angle)))


def lobe(point: Point, convention: Convention) -> Row:
    """Return the departure over all views, the albedos, and the peak of the specular part.

    Statistics are over views of equal projected solid angle.
    """
    phong, plastic, misses = material(tuple(point.items()), convention)
    angle = point["light_angle"]
    plane, mirror = direction(np.arange(0, 90, PEAK_STEP), 0.0), direction(angle, 0.0)
    parts = (views(), hemisphere()[0], plane, mirror)
    view = np.concatenate(parts, axis=1)
    light = np.broadcast_to(direction(angle, 180.0), view.shape)
    splits = np.cumsum([part.shape[1] for part in parts])[:-1]
    result: Row = {
        "miss": largest_miss(misses),
        "alpha": plastic.alpha,
        "int_ior": plastic.int_ior,
        "reflectance": plastic.diffuse_reflectance[0],
        "n": phong.n,
        "k_d": phong.k_d[0],
        "k_s": phong.k_s[0],
    }
    images = []
    for half, (total, lobe_alone) in (
        ("heuristic", heuristic_radiance(phong, light, view)),
        ("reference", reference_radiance(plastic, light, view)),
    ):
        seen, everywhere, _, _ = np.split(total, splits)
        _, specular, in_plane, mirrored = np.split(lobe_alone, splits)
        images.append(np.repeat(seen[None, :, None], 3, axis=2))
        result[f"albedo_{half}"] = albedo(everywhere, angle)
        result[f"specular_albedo_{half}"] = albedo(specular, angle)
        result[f"specular_{half}"] = float(mirrored[0])
        highest = in_plane > in_plane.max() * (1 - 1e-6)
        if np.count_nonzero(highest) * PEAK_STEP < 1:  # n = 0 has no peak, k_s = 0 no lobe
            result[f"peak_{half}"] = float(np.argmax(in_plane)) * PEAK_STEP
    test, truth = images
    return result | measure(test, truth, np.ones(test.shape[:2], bool))
