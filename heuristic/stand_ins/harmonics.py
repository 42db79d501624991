"""Spherical harmonics of the environment: nine numbers per channel for its unoccluded irradiance.

Ramamoorthi and Hanrahan, "An efficient representation for irradiance environment maps" (2001).
Reflection by a diffuse surface is a convolution with the cosine, which keeps little beyond the
second order: ``E(n) = sum_lm A_l L_lm Y_lm(n)`` with ``A_0 = pi``, ``A_1 = 2 pi / 3`` and
``A_2 = pi / 4``, and ``L_lm`` the integral of ``L Y_lm`` over the sphere. It is exact for light of
no more than second order.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import pi
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from heuristic.heuristics import HEURISTICS, Heuristic
from heuristic.points import INPUTS, Array, Point
from heuristic.stand_ins import tabulated
from heuristic.stand_ins.ambient_light import has_environment, lit
from heuristic.stand_ins.tabulated import Table

RINGS = 512
"""Rings of directions over the sphere, with twice as many each: 0.35 degrees, finer than a sun."""

CONVOLVED = np.repeat((1.0, 2 / 3, 1 / 4), (1, 3, 5))
"""``A_l / pi`` of the nine terms."""


def basis(direction: Any) -> list[Any]:
    """Return the nine real harmonics at unit vectors with ``x``, ``y`` and ``z``."""
    x, y, z = direction.x, direction.y, direction.z
    return [
        0.5 * (1 / pi) ** 0.5 + 0 * x,
        *((3 / (4 * pi)) ** 0.5 * one for one in (y, z, x)),
        *((15 / (4 * pi)) ** 0.5 * one for one in (x * y, y * z)),
        (5 / (16 * pi)) ** 0.5 * (3 * z * z - 1),
        (15 / (4 * pi)) ** 0.5 * (x * z),
        (15 / (16 * pi)) ** 0.5 * (x * x - y * y),
    ]


@dataclass(frozen=True)
class Directions:
    """Directions (N,) over the sphere, as NumPy or Dr.Jit arrays."""

    x: Any
    y: Any
    z: Any


def sphere() -> tuple[Directions, np.ndarray]:
    """Return directions over the sphere and the solid angle of each, which add up to 4 pi."""
    edges = np.linspace(0, pi, RINGS + 1)
    theta, phi = (edges[1:] + edges[:-1]) / 2, (np.arange(2 * RINGS) + 0.5) * pi / RINGS
    theta, phi = (side.ravel() for side in np.meshgrid(theta, phi, indexing="ij"))
    solid_angle = np.repeat((np.cos(edges[:-1]) - np.cos(edges[1:])) * pi / RINGS, 2 * RINGS)
    sine = np.sin(theta)
    return Directions(sine * np.cos(phi), sine * np.sin(phi), np.cos(theta)), solid_angle


def project(radiance: Callable[[Directions], np.ndarray]) -> np.ndarray:
    """Return the coefficients (9, K) of ``E / pi`` of a radiance (N, K) over the sphere."""
    directions, solid_angle = sphere()
    weighted = np.stack(basis(directions)) * solid_angle
    return CONVOLVED[:, None] * (weighted @ radiance(directions))


@dataclass
class Harmonics:
    """The coefficients of ``E / pi``."""

    terms: tuple[Table, ...]


def prepare(scene: Any) -> Harmonics:
    """Project the environment of a scene."""
    environment = scene.environment()

    def radiance(directions: Directions) -> np.ndarray:
        si = dr.zeros(mi.SurfaceInteraction3f, len(directions.x))
        si.wi = -mi.Vector3f(*(mi.Float(one) for one in vars(directions).values()))
        found = []
        for wavelengths in tabulated.batches():
            if mi.is_spectral:
                si.wavelengths = mi.Spectrum(wavelengths)
            found.append(tabulated.columns(environment.eval(si), len(directions.x)))
        return np.hstack(found)

    return Harmonics(tuple(map(Table, project(radiance))))


def shade(point: Point) -> Array:
    """Return the chapters' model with the environment's irradiance in place of ``I_a``."""
    terms = zip(point.prepared.terms, basis(point.normal), strict=True)
    arriving = sum(term.at(point.wavelengths) * value for term, value in terms)
    return lit(point, dr.maximum(arriving, 0), replaces_ambient=True)


def refuse(scene: Any) -> str:
    """Return why there is nothing to project, if so."""
    return "" if has_environment(scene) else "it has no environment"


HARMONICS = HEURISTICS.own(
    Heuristic(
        "harmonics-ambient",
        shade,
        "spherical harmonics",
        needs=frozenset(INPUTS) - {"uv", "visible"},
        prepare=prepare,
        refuse=refuse,
    )
)
