"""The textbook's reflection as printed, in NumPy of any precision.

It shares nothing with the kernel.

Vectors are (..., 3), numbers (..., 1). Hard cases evaluate it in single precision, the naive form
that they break, and in extended precision (:data:`EXACT`; on machines without it, double), which is
exact enough to judge by, since the inputs are of single precision. The diagnosis of shaders changes
it by one mistake after another.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fotismos.heuristic.convention import Floats

NAIVE = np.float32
EXACT = np.longdouble


def dot(a: Floats, b: Floats) -> Floats:
    """Return the dot products (..., 1) of vectors."""
    product: Floats = (a * b).sum(axis=-1, keepdims=True)
    return product


def unit(vectors: Floats) -> Floats:
    """Return vectors over their length, without precautions."""
    return vectors / np.sqrt(dot(vectors, vectors))


def mirrored(normal: Floats, toward: Floats, view: Floats) -> Floats:
    """Return ``R.V``, where ``R = 2 (N.L) N - L`` (8.7)."""
    return dot(2 * normal * dot(normal, toward) - toward, view)


def halfway(normal: Floats, toward: Floats, view: Floats) -> Floats:
    """Return ``N.H`` of Blinn (1977)."""
    return dot(normal, unit(toward + view))


COSINES = {"phong": mirrored, "blinn": halfway}
"""The lobe's cosine by its form, of normal, light and view."""


def clamped(cosine: Floats) -> Floats:
    """Return a cosine, or 0 if it is negative."""
    return np.maximum(cosine, 0)


def lobe(cosine: Floats, n: Any, incidence: Floats) -> Floats:
    """Return ``cosine^n``, 0 where the light is not above the surface."""
    return np.where(incidence > 0, clamped(cosine) ** n, 0)


@dataclass(frozen=True)
class Setting:
    """Points, each with its own light; vectors are (N, 3) or (3,), numbers (N,) or single.

    ``direction`` and ``cutoff`` (degrees) make the light a spot with the exponent ``m``. The lobe's
    ``form`` is one of :data:`COSINES`.
    """

    position: Any = (0.0, 0.0, 0.0)
    normal: Any = (0.0, 0.0, 1.0)
    view: Any = (0.0, 0.0, 1.0)
    light: Any = (0.0, 0.0, 1.0)
    intensity: Any = 1.0
    attenuation: Any = (1.0, 0.0, 0.0)
    k_d: float = 0.0
    k_s: float = 0.0
    n: Any = 1.0
    direction: Any = None
    cutoff: float = 90.0
    m: float = 0.0
    form: str = "phong"

    def rounded(self) -> "Setting":
        """Return the setting with all numbers rounded to single precision."""
        single: dict[str, Any] = {
            name: np.float32(value)
            for name, value in vars(self).items()
            if value is not None and name != "form"
        }
        return replace(self, **single)


def shade(setting: Setting, dtype: Any) -> Floats:
    """Evaluate equation 8.10 for one light, without precautions: an array (N,) of a precision."""
    s = setting
    with np.errstate(all="ignore"):
        normal, view, offset = _vectors(s, dtype)
        normal = unit(normal)
        view = unit(view)
        distance = np.sqrt(dot(offset, offset))
        toward = offset / distance
        cosine = dot(normal, toward)[..., 0]
        reflection = COSINES[s.form](normal, toward, view)[..., 0]
        power = clamped(reflection) ** dtype(s.n)
        distance = distance[..., 0]
        # The light that arrives: 6.1, for a spot also its cone (6.2, 6.3) and fall-off (6.4).
        k0, k1, k2 = map(dtype, s.attenuation)
        arriving = dtype(s.intensity) / (k0 + k1 * distance + k2 * distance**2)
        if s.direction is not None:
            cos_axis = -dot(toward, unit(np.asarray(s.direction).astype(dtype)))[..., 0]
            inside = cos_axis >= np.cos(np.deg2rad(dtype(s.cutoff)))
            arriving = np.where(inside, arriving * np.maximum(cos_axis, 0) ** dtype(s.m), 0)
        # 8.10; at the horizon and below it there is neither term.
        value = arriving * (dtype(s.k_d) * cosine + dtype(s.k_s) * power)
        return np.atleast_1d(np.where(cosine <= 0, 0, value))


def shade_exactly(setting: Setting) -> Floats:
    """Evaluate the same in extended precision, and define it where the equations do not.

    A direction that does not exist receives no light, and the lobe ends where ``R.V <= 0``, for
    ``n = 0`` too.
    """
    value = shade(setting, EXACT)
    with np.errstate(all="ignore"):
        normal, view, toward = map(unit, _vectors(setting, EXACT))
        # Only without a diffuse term is the whole value the lobe's.
        if setting.k_d == 0:
            cosine = COSINES[setting.form](normal, toward, view)
            value = np.where(cosine[..., 0] > 0, value, 0)
    # A vector of length 0 became NaN when `unit` divided it by that length.
    exists = ~np.isnan(dot(toward, toward) + dot(normal, normal) + dot(view, view))[..., 0]
    return np.where(exists, value, 0)


def _vectors(s: Setting, dtype: Any) -> tuple[Floats, Floats, Floats]:
    """Return normal, view, and the way to the light."""
    normal = np.asarray(s.normal).astype(dtype)
    view = np.asarray(s.view).astype(dtype)
    light = np.asarray(s.light).astype(dtype)
    position = np.asarray(s.position).astype(dtype)
    return normal, view, light - position
