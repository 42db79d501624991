"""Which models of reflection conserve energy, and which are reciprocal: facts, by quadrature.

In a white furnace, light of radiance 1 from all sides, a surface that loses nothing looks like the
furnace; one that looks brighter creates light. The table has the directional-hemispherical albedo
``2 pi int f cos(theta_o)`` for light from one angle, with coefficients and reflectances of 1, and
how far ``f(i, o)`` is from ``f(o, i)``.
"""

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

ANGLES = (0.0, 45.0, 80.0)
AZIMUTHS, HEIGHTS = 960, 720


@dataclass(frozen=True)
class Furnace:
    """A model's albedo for light from each of :data:`ANGLES`, and its departure from reciprocity.

    ``asymmetry`` is the largest ``|f(i, o) - f(o, i)|`` over the mean of the two, over random pairs
    within 80 degrees of the normal, where ``f`` exceeds a thousandth of its largest value.
    """

    model: str
    albedo: tuple[float, ...]
    asymmetry: float


MODELS = {
    "diffuse, ρ = 1": {"type": "diffuse", "reflectance": 1.0},
    "Phong, k_s = 1, n = 9": {"type": "phong", "k_s": 1.0, "n": 9},
    "Phong, k_s = 1, n = 1000": {"type": "phong", "k_s": 1.0, "n": 1000},
    "Phong normalised, n = 9": {"type": "phong", "k_s": 1.0, "n": 9, "normalised": True},
    "Phong normalised, n = 1000": {"type": "phong", "k_s": 1.0, "n": 1000, "normalised": True},
    "Blinn–Phong, k_s = 1, n = 9": {"type": "phong", "k_s": 1.0, "n": 9, "form": "blinn"},
    "Blinn–Phong normalised, n = 9": {
        "type": "phong", "k_s": 1.0, "n": 9, "form": "blinn", "normalised": True
    },
    "Blinn–Phong normalised, n = 1000": {
        "type": "phong", "k_s": 1.0, "n": 1000, "form": "blinn", "normalised": True
    },
    "roughplastic, ρ = 1, α = 0.1": {
        "type": "roughplastic", "diffuse_reflectance": 1.0, "alpha": 0.1
    },
    "roughplastic, ρ = 1, α = 0.5": {
        "type": "roughplastic", "diffuse_reflectance": 1.0, "alpha": 0.5
    },
}  # fmt: skip
"""The models, as Mitsuba dictionaries; the plugins must be registered."""


def table() -> list[Furnace]:
    """Return the albedo and asymmetry of each of :data:`MODELS`, in the current variant."""
    return [
        Furnace(name, tuple(albedo(bsdf, angle) for angle in ANGLES), asymmetry(bsdf))
        for name, bsdf in ((name, mi.load_dict(model)) for name, model in MODELS.items())
    ]


def albedo(bsdf: Any, degrees: float) -> float:
    """Return the albedo of a BSDF for light at an angle from the normal.

    Mitsuba's ``eval(wi, wo)`` is ``f cos(theta_wo)`` with the light at ``wo``. Here ``wi`` are the
    outgoing directions, so models without reciprocity keep their sense.
    """
    light = direction(np.deg2rad(degrees), 0.0)
    outgoing, solid_angle = hemisphere()
    value = evaluate(bsdf, outgoing, light) / light[2, 0]  # f
    return float((value * outgoing[2] * solid_angle).sum())


def hemisphere(azimuths: int = AZIMUTHS, heights: int = HEIGHTS) -> tuple[NDArray, NDArray]:
    """Return directions (3, N) above a surface, and the solid angle (N,) of each.

    They are even in ``t`` with ``cos(theta) = 1 - t^2``, and so dense about the normal.
    """
    t = (np.arange(heights) + 0.5) / heights
    phi = (np.arange(azimuths) + 0.5) * 2 * np.pi / azimuths
    t, phi = (grid.ravel() for grid in np.meshgrid(t, phi))
    return direction(np.arccos(1 - t * t), phi), 2 * t * 2 * np.pi / len(t)


def asymmetry(bsdf: Any) -> float:
    """Return the largest relative difference of ``f(i, o)`` and ``f(o, i)``."""
    a, b = random_pairs()
    there, back = evaluate(bsdf, a, b) / b[2], evaluate(bsdf, b, a) / a[2]
    return float(relative_differences(there, back).max())


def random_pairs(count: int = 20_000) -> list[NDArray]:
    """Return two sets of random directions (3, N), within 80 degrees of the normal."""
    rng = np.random.default_rng(0)
    return [
        direction(np.arccos(rng.uniform(np.cos(np.deg2rad(80)), 1, count)),
                  rng.uniform(0, 2 * np.pi, count))
        for _ in range(2)
    ]  # fmt: skip


def relative_differences(there: NDArray, back: NDArray) -> NDArray:
    """Return ``|a - b|`` over the mean of both, and 0 where that is below 1/1000 of the largest."""
    mean = (there + back) / 2
    counted = mean > 1e-3 * mean.max()
    return np.divide(np.abs(there - back), mean, out=np.zeros_like(mean), where=counted)


def evaluate(bsdf: Any, wi: NDArray, wo: NDArray) -> NDArray[np.float64]:
    """Return ``f cos(theta_wo)`` of a white BSDF, for directions (3, N)."""
    count = max(wi.shape[1], wo.shape[1])
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.wi = mi.Vector3f(np.broadcast_to(wi, (3, count)))
    if mi.is_spectral:
        si.wavelengths = 550.0
    value = bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(np.broadcast_to(wo, (3, count))))
    return np.atleast_2d(np.array(value, float))[0]


def direction(theta: ArrayLike, phi: ArrayLike) -> NDArray:
    """Return unit vectors (3, N) at angles from the normal and about it, in radians."""
    theta, phi = np.broadcast_arrays(np.atleast_1d(theta), phi)
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
