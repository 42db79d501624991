"""The illumination model as a textbook prints it, in NumPy, of any precision.

In single precision it is the naive form that the hard cases break. In extended precision
(:data:`EXACT`; on machines without it, double) the same lines are exact enough to judge by, since
the inputs are of single precision. It shares nothing with the kernel.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from heuristic.arrays import Array

NAIVE, EXACT = np.float32, np.longdouble


@dataclass(frozen=True)
class Setting:
    """Points, each with its own light; vectors are (N, 3) or (3,), numbers (N,) or single.

    ``direction`` and ``cutoff`` (degrees) make the light a spot with the exponent ``m``.
    """

    position: Array = (0.0, 0.0, 0.0)
    normal: Array = (0.0, 0.0, 1.0)
    view: Array = (0.0, 0.0, 1.0)
    light: Array = (0.0, 0.0, 1.0)
    intensity: Array = 1.0
    attenuation: Array = (1.0, 0.0, 0.0)
    k_d: float = 0.0
    k_s: float = 0.0
    n: Array = 1.0
    direction: Array = None
    cutoff: float = 90.0
    m: float = 0.0

    def rounded(self) -> "Setting":
        """Return the setting with all numbers rounded to single precision."""
        rounded: dict[str, Any] = {
            name: np.float32(value) for name, value in vars(self).items() if value is not None
        }
        return replace(self, **rounded)


def shade(
    setting: Setting, dtype: type[np.floating], horizon: bool = True, unit_normal: bool = True
) -> NDArray:
    """Evaluate equation 8.10 for one light, without precautions: an array (N,) of a precision.

    Without ``horizon``, ``N.L`` and ``R.V`` need not be above 0, as 8.5 and 8.9 are printed;
    without ``unit_normal``, the normal is taken for a unit vector.
    """
    s = setting
    with np.errstate(all="ignore"):
        normal, view = (_of(vector, dtype) for vector in (s.normal, s.view))
        normal, view = _unit(normal) if unit_normal else normal, _unit(view)
        offset = _of(s.light, dtype) - _of(s.position, dtype)
        distance = np.sqrt(_dot(offset, offset))
        toward = offset / distance[..., None]
        cosine = _dot(normal, toward)
        mirrored = 2 * normal * cosine[..., None] - toward
        reflection = _dot(mirrored, view)
        lobe = (np.maximum(reflection, 0) if horizon else reflection) ** _of(s.n, dtype)
        k0, k1, k2 = (dtype(k) for k in s.attenuation)
        arriving = _of(s.intensity, dtype) / (k0 + k1 * distance + k2 * distance**2)
        if s.direction is not None:
            cos_axis = -_dot(toward, _unit(_of(s.direction, dtype)))
            inside = cos_axis >= np.cos(np.deg2rad(dtype(s.cutoff)))
            arriving = np.where(inside, arriving * np.maximum(cos_axis, 0) ** dtype(s.m), 0)
        value = arriving * (dtype(s.k_d) * cosine + dtype(s.k_s) * lobe)
        return np.atleast_1d(np.where(horizon & (cosine <= 0), 0, value))


def shade_exactly(setting: Setting) -> NDArray:
    """Evaluate the same in extended precision, and define it where the equations do not.

    A direction that does not exist receives no light, and the lobe ends where ``R.V <= 0``, for
    ``n = 0`` too.
    """
    value = shade(setting, EXACT)
    s = setting
    normal, view = (_unit(_of(vector, EXACT)) for vector in (s.normal, s.view))
    toward = _unit(_of(s.light, EXACT) - _of(s.position, EXACT))
    mirrored = 2 * normal * _dot(normal, toward)[..., None] - toward
    if s.k_d == 0:
        value = np.where(_dot(mirrored, view) > 0, value, 0)
    exists = ~(np.isnan(toward).any(-1) | np.isnan(normal).any(-1) | np.isnan(view).any(-1))
    return np.where(exists, value, 0)


def triangle_normal(
    p0: ArrayLike, p1: ArrayLike, p2: ArrayLike, dtype: type[np.floating]
) -> NDArray:
    """Evaluate equation 6.19 as printed."""
    a, b, c = (_of(p, dtype) for p in (p0, p1, p2))
    with np.errstate(all="ignore"):
        return _unit(np.cross(b - a, c - a))


def _of(value, dtype):
    return np.asarray(value).astype(dtype)


def _dot(a, b):
    return (a * b).sum(-1)


def _unit(vector):
    with np.errstate(all="ignore"):
        return vector / np.sqrt(_dot(vector, vector))[..., None]
