"""The hard cases of the kernel at single points: exponents, geometry and lights.

Here the naive evaluation is the textbook's formula in single precision.
"""

from collections.abc import Callable
from dataclasses import replace

import drjit as dr
import numpy as np
from drjit.llvm import Array3f, Float
from numpy.typing import NDArray

import heuristic
from comparisons.hard import textbook
from comparisons.hard.cases import HardCase
from comparisons.hard.textbook import Setting

POINTS = 2001


def by_kernel(setting: Setting) -> NDArray[np.float32]:
    """Evaluate :func:`heuristic.shade` at a setting, in single precision: an array (N,)."""
    s = setting.rounded()
    count = max(np.size(getattr(s, name)) // 3 for name in ("position", "normal", "view", "light"))
    count = max(count, np.size(s.n), np.size(s.intensity))

    def vector(value):
        return Array3f(np.ascontiguousarray(np.broadcast_to(value, (count, 3)).T))

    light = vector(s.light)
    intensity = Float(np.broadcast_to(s.intensity, count).copy())
    k0, k1, k2 = map(float, s.attenuation)
    lamp: heuristic.PointLight | heuristic.SpotLight
    if s.direction is None:
        lamp = heuristic.PointLight(light, intensity, (k0, k1, k2))
    else:
        direction = tuple(map(float, s.direction))
        lamp = heuristic.SpotLight(
            light, direction, intensity, float(s.cutoff), float(s.m), (k0, k1, k2)
        )
    n = Float(np.broadcast_to(s.n, count).copy())
    material = heuristic.Material(k_d=float(s.k_d), k_s=float(s.k_s), n=n)
    arrays = (vector(s.position), vector(s.normal), vector(s.view))
    dr.eval(arrays, n, light, intensity)
    value = heuristic.shade(*arrays, material, [lamp])
    return np.array(value + dr.zeros(Float, count))


def shaded(
    name: str,
    group: str,
    hard: str,
    bound: float,
    setting: Setting,
    naive: Callable[[Setting, type[np.floating]], NDArray] = textbook.shade,
) -> HardCase:
    """Make a case of a setting; ``naive(setting, dtype)`` is the formula as people write it."""
    setting = setting.rounded()
    return HardCase(
        name,
        group,
        hard,
        bound,
        lambda: naive(setting, textbook.NAIVE),
        lambda: by_kernel(setting),
        lambda: textbook.shade_exactly(setting),
        setting,
    )


def highlight(n: float, points: int = POINTS) -> Setting:
    """Return a setting across a highlight, from its middle to a thousandth of its peak."""
    width = np.sqrt(2 * np.log(1e3) / n)
    return Setting(
        normal=(0.1, 0.2, 0.9), light=(1.0, 2.0, 4.0), k_s=1.0, n=n,
        view=_mirrored((1.0, 2.0, 4.0), (0.1, 0.2, 0.9), np.linspace(0, width, points)),
    )  # fmt: skip


def _mirrored(light, normal, angle):
    """Return views at angles from the mirror image of a light about a normal."""
    light, normal = (np.float32(v).astype(float) for v in (light, normal))
    light, normal = light / np.linalg.norm(light), normal / np.linalg.norm(normal)
    mirrored = 2 * (light @ normal) * normal - light
    side = np.cross(mirrored, (0.3, 0.5, -0.8))
    side /= np.linalg.norm(side)
    return np.cos(angle)[:, None] * mirrored + np.sin(angle)[:, None] * side


def _mirror_directions():
    """Return views in the mirror direction of a light, to single precision."""
    normal = np.random.default_rng(2).normal(size=(POINTS, 3)).astype(np.float32).astype(float)
    normal[:, 2] = np.abs(normal[:, 2]) + 0.1
    unit = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    return Setting(
        normal=normal, light=(0, 0, 1), view=2 * unit[:, 2:] * unit - (0, 0, 1), k_s=1.0, n=1e7
    )


def _grazing():
    """Return lights and views a little above surfaces of all directions, facing each other."""
    rng = np.random.default_rng(1)
    normal, other = rng.normal(size=(2, POINTS, 3)).astype(np.float32).astype(float)
    unit = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    along = np.cross(unit, other)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    height = np.logspace(-8, -6, POINTS)[:, None] * unit
    return Setting(normal=normal, light=along + height, view=height - along, k_s=1.0, n=100.5)


_HIGHLIGHT = highlight(1e6)
_AT_END = _mirrored((1.0, 2.0, 4.0), (0.1, 0.2, 0.9), np.pi / 2 - np.logspace(-6.5, -2, POINTS))
_FLAT = Setting(k_d=1.0)
_SPOT = Setting(k_d=1.0, light=(0.0, 0.0, 2.0), direction=(0.0, 0.0, -1.0))


def _under_a_spot(angle, **changes):
    """Points of a plane at angles from the axis of a spot above it, whose normals face it."""
    angle = np.atleast_1d(angle)
    place = np.stack([2 * np.tan(angle), 0 * angle, 0 * angle], axis=1)
    return replace(_SPOT, position=place, normal=(0.0, 0.0, 1.0), **changes)


_AGAINST = np.array([(3, 5, -4), (3, -5, -4), (7, 0, -1), (-1, 0, -7)])
_RAYS = (_AGAINST * np.arange(1, 51)[:, None, None]).reshape(-1, 3).astype(float)
_ON_CONE = Setting(k_d=1.0, cutoff=135.0, direction=(-3.0, 0.0, 4.0), light=-_RAYS, normal=-_RAYS)
"""Integers at exactly 135 degrees from an axis: as far against it as across it."""

CASES = (
    shaded("exponent 0 at the lobe's end", "exponents",
           "R·V is 0, and so is n: a power gives 0⁰ = 1, where the lobe has ended.", 2e-4,
           Setting(k_s=1.0, n=0.0, view=(1.0, 0.0, 0.0))),
    shaded("exponent 1/2, R·V just above 0", "exponents",
           "The scalar product cancels to a few digits, whose root is still visible.", 2e-4,
           replace(_HIGHLIGHT, n=0.5, view=_AT_END)),
    shaded("exponent 1e-3, R·V just above 0", "exponents",
           "The lobe is almost even and ends abruptly; only the sign of R·V matters.", 2e-4,
           replace(_HIGHLIGHT, n=1e-3, view=_mirrored((1.0, 2.0, 4.0), (0.1, 0.2, 0.9),
                   np.pi / 2 + np.linspace(-3e-7, 3e-7, POINTS)))),
    shaded("exponent 1e5", "exponents",
           "The power multiplies the rounding of R·V near 1 by n.", 2e-4, highlight(1e5)),
    shaded("exponent 1e6", "exponents",
           "The same; even rounding N, L and V turns the highlight visibly.", 2e-4,
           _HIGHLIGHT),
    shaded("exponent 123456.78", "exponents", "A large exponent that is not an integer.", 2e-4,
           highlight(123456.78)),
    shaded("exponent 1e7 in the mirror direction", "exponents",
           "R·V rounds to just over 1 or just under, and the power makes it 3.3 or 0.3.", 2e-4,
           _mirror_directions()),
    shaded("a light on the surface", "geometry", "d = 0: no direction, and 0 / 0.", 2e-4,
           replace(_FLAT, light=(0.0, 0.0, 0.0))),
    shaded("a light at a distance of 1e-20", "geometry", "d² vanishes: 1e-40 is subnormal.",
           1e-6, replace(_FLAT, light=(0.6e-20, 0.0, 0.8e-20))),
    shaded("a light at a distance of 1e20", "geometry", "d² is 1e40, beyond single precision.",
           1e-6, replace(_FLAT, light=(0.6e20, 0.0, 0.8e20))),
    shaded("a viewer on the surface", "geometry", "No view direction: 0 / 0.", 2e-4,
           Setting(k_s=1.0, n=9.5, view=(0.0, 0.0, 0.0))),
    shaded("grazing light and view", "geometry",
           "Within 1e-8 to 1e-6 radians of the surface, rounding decides which side they are on.",
           2e-4, _grazing()),
    shaded("normals of length 1e-30", "geometry", "Their square vanishes.", 1e-5,
           replace(_FLAT, normal=(0.6e-30, 0.0, 0.8e-30))),
    shaded("normals of length 1e30", "geometry", "Their square is beyond single precision.", 1e-5,
           replace(_FLAT, normal=(0.6e30, 0.0, 0.8e30))),
    shaded("a normal of zero", "geometry", "Interpolated normals can cancel: 0 / 0.", 1e-5,
           replace(_FLAT, normal=(0.0, 0.0, 0.0))),
    shaded("a scene of size 1e-6, n = 1e5", "geometry", "A sharp highlight in a tiny scene.", 2e-4,
           replace(highlight(1e5), light=(1e-6, 2e-6, 4e-6))),
    shaded("a scene of size 1e6, n = 1e5", "geometry", "A sharp highlight in a huge scene.", 2e-4,
           replace(highlight(1e5), light=(1e6, 2e6, 4e6))),
    shaded("far from the origin, n = 1e5", "geometry",
           "Light and point 1e6 away: their difference is exact, all else rounds.", 2e-4,
           replace(highlight(1e5), position=(1e6, 1e6, 1e6), light=(1e6 + 1, 1e6 + 2, 1e6 + 4))),
    shaded("intensity 1e-30 at a distance of 1e-20", "lights",
           "1/d² overflows, and the intensity brings it back to 1e10.", 1e-6,
           replace(_FLAT, light=(0.0, 0.0, 1e-20), intensity=1e-30, attenuation=(0.0, 0.0, 1.0))),
    shaded("intensity 1e30 at a distance of 1e20", "lights",
           "1/d² vanishes, and the intensity brings it back to 1e-10.", 1e-6,
           replace(_FLAT, light=(0.0, 0.0, 1e20), intensity=1e30, attenuation=(0.0, 0.0, 1.0))),
    shaded("a spot with m = 1e5", "lights", "The power multiplies the rounding of the cosine by m.",
           1e-3, _under_a_spot(np.linspace(0, 0.01, POINTS), m=1e5, cutoff=30.0)),
    shaded("a cutoff of 1e-4 degrees", "lights",
           "The cosine of the cutoff rounds to 1, as do the cosines of points far outside.", 1e-5,
           _under_a_spot(np.deg2rad(1e-4) * np.array([0, 0.2, 0.5, 0.8, 1.2, 2, 10, 50, 150]),
                         cutoff=1e-4)),
    shaded("a cutoff of 179.99 degrees", "lights",
           "The cosine rounds to -1, and the dark needle behind the light disappears.", 1e-5,
           replace(_SPOT, direction=(0.0, 0.0, 1.0), cutoff=179.99,
                   position=[(2 * np.deg2rad(0.01) * f, 0, 0) for f in (0, 0.3, 0.8, 1.2, 3)])),
    replace(
        shaded("a point exactly on the cone", "lights",
               "6.2 says ≥: coordinates on the cone are lit, however they round.", 1e-6,
               _ON_CONE),
        exact=lambda: np.ones(len(_RAYS))),
)  # fmt: skip
"""The cases of the kernel."""
