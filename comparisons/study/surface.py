"""A flat surface under parallel light, evaluated without an image: kernel against Mitsuba's BSDF.

The light has the heuristic intensity 1, so the irradiance ``pi`` on a surface that faces it. The
surface lies in the plane z = 0, and the light in the plane y = 0 at negative x, so its mirror image
is at azimuth 0. Directions point away from the surface.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike

import heuristic
from comparisons.study.dataset import Row, largest_miss, measure
from comparisons.study.scenes import Point
from heuristic.convention import IRRADIANCE_PER_INTENSITY
from heuristic.numerics import is_moderate
from reference.pairing.albedo import RoughPlastic, to_phong, to_roughplastic
from reference.pairing.factors import Convention, Miss, Phong

HEIGHTS, AZIMUTHS = 240, 120
"""Directions of the quadrature over half the hemisphere; the other half is symmetric."""

VIEW_HEIGHTS, VIEW_AZIMUTHS = 96, 64

PEAK_STEP = 0.05
"""Degrees between the directions searched for a lobe's peak."""


@dataclass(frozen=True)
class StudyMaterial:
    """A material in both models, with the misses of the pairing."""

    phong: Phong
    plastic: RoughPlastic
    misses: tuple[Miss, ...]

    def columns(self) -> Row:
        """Return its parameters in both models, and its miss."""
        return {
            "miss": largest_miss(self.misses),
            "alpha": self.plastic.alpha,
            "int_ior": self.plastic.int_ior,
            "reflectance": self.plastic.diffuse_reflectance[0],
            "n": self.phong.n,
            "k_d": self.phong.k_d[0],
            "k_s": self.phong.k_s[0],
        }


def material(point: Point, convention: Convention) -> StudyMaterial:
    """Return the material of a point, which has the parameters of one of the models."""
    if "n" in point:
        k_d, k_s = ((point[name],) * 3 for name in ("k_d", "k_s"))
        return _of_phong(Phong(k_d, k_s, point["n"]), convention)
    grey = (point["reflectance"],) * 3
    return _of_plastic(RoughPlastic(grey, point["alpha"], point["int_ior"]), convention)


@lru_cache(maxsize=256)
def _of_phong(phong: Phong, convention: Convention) -> StudyMaterial:
    if not any(phong.k_s):
        # Pairing makes it plain diffuse, not roughplastic.
        return StudyMaterial(phong, RoughPlastic(phong.k_d, 1.0, 1.0), ())
    plastic, misses = to_roughplastic(phong, convention)
    return StudyMaterial(phong, plastic, misses)


@lru_cache(maxsize=256)
def _of_plastic(plastic: RoughPlastic, convention: Convention) -> StudyMaterial:
    return StudyMaterial(to_phong(plastic, convention), plastic, ())


def direction(theta: ArrayLike, phi: ArrayLike) -> np.ndarray:
    """Return unit vectors (3, N) from polar angles and azimuths in degrees."""
    angles = np.broadcast_arrays(np.atleast_1d(theta), phi)
    t, p = map(np.deg2rad, angles)
    return np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])


def heuristic_radiance(
    phong: Phong, light: np.ndarray, view: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the kernel's radiance (N,), in all and of the specular part alone.

    Directions (3, N) are of light and viewer. Display-linear: a white diffuse surface that faces
    the light has the value 1. All numbers are opaque, so one kernel serves all materials.
    """
    number = dr.leaf_t(mi.Float)
    k_d, k_s, n = (dr.opaque(number, v) for v in (phong.k_d[0], phong.k_s[0], phong.n))
    count = light.shape[1]
    sun = heuristic.DirectionalLight(-mi.Vector3f(light), dr.opaque(number, 1.0))
    parts = [
        heuristic.shade(
            dr.zeros(mi.Point3f, count),
            mi.Normal3f(0, 0, 1),
            mi.Vector3f(view),
            heuristic.Material(
                k_d=coefficients[0], k_s=coefficients[1], n=n, n_is_moderate=is_moderate(phong.n)
            ),
            [sun],
        )
        for coefficients in ((k_d, k_s), (0, k_s))
    ]
    total, specular = (np.array(part, float) for part in parts)
    return total, specular


def reference_radiance(
    plastic: RoughPlastic, light: np.ndarray, view: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the radiance of Mitsuba's BSDF, as :func:`heuristic_radiance` does."""
    bsdf = _bsdf(plastic)
    si = dr.zeros(mi.SurfaceInteraction3f, light.shape[1])
    si.wi = mi.Vector3f(view)
    context = mi.BSDFContext()
    total = bsdf.eval(context, si, mi.Vector3f(light))
    context.type_mask = +mi.BSDFFlags.DiffuseReflection
    diffuse = bsdf.eval(context, si, mi.Vector3f(light))
    dr.eval(total, diffuse)
    total, diffuse = (
        IRRADIANCE_PER_INTENSITY * np.atleast_2d(np.array(value, float))[0]
        for value in (total, diffuse)
    )
    return total, total - diffuse


@lru_cache(maxsize=8)
def _bsdf(plastic: RoughPlastic) -> Any:
    if plastic.int_ior == plastic.ext_ior:
        return mi.load_dict({"type": "diffuse", "reflectance": plastic.diffuse_reflectance[0]})
    colours = ("diffuse_reflectance", "specular_reflectance")
    values = {name: getattr(plastic, name) for name in ("alpha", "int_ior", "ext_ior")}
    values |= {name: getattr(plastic, name)[0] for name in colours}
    return mi.load_dict({"type": "roughplastic"} | values)


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
    made, angle = material(point, convention), point["light_angle"]
    plane, mirror = direction(np.arange(0, 90, PEAK_STEP), 0.0), direction(angle, 0.0)
    parts = (views(), hemisphere()[0], plane, mirror)
    view = np.concatenate(parts, axis=1)
    light = np.broadcast_to(direction(angle, 180.0), view.shape)
    splits = np.cumsum([part.shape[1] for part in parts])[:-1]
    result: Row = made.columns()
    images = []
    for half, (total, lobe_alone) in (
        ("heuristic", heuristic_radiance(made.phong, light, view)),
        ("reference", reference_radiance(made.plastic, light, view)),
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
