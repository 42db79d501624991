"""The specular part of Mitsuba's ``roughplastic`` as printed, in NumPy of any precision.

As in :mod:`comparisons.hard.textbook`, the same lines are the naive form in single precision and
the exact values in extended precision. Sources: Walter, Marschner, Li and Torrance (EGSR 2007) for
the lobe, Beckmann's distribution and the rational form of Smith's masking; Fresnel's equations for
unpolarised light.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray


def specular(
    light: ArrayLike, view: ArrayLike, alpha: ArrayLike, ior: ArrayLike, dtype: type[np.floating]
) -> NDArray:
    """Return ``F D G / (4 cos_view)``, which is ``f cos_light``.

    Directions are (N, 3), the normal is (0, 0, 1). They are used unchanged: normalising them in
    another precision would turn the half vector by more than the sharpest lobe allows.
    """
    light, view = (np.asarray(v).astype(dtype) for v in (light, view))
    alpha, ior = (np.asarray(a).astype(dtype) for a in (alpha, ior))
    half = _unit(light + view)
    masking = smith(light[..., 2], alpha) * smith(view[..., 2], alpha)
    reflected = fresnel((light * half).sum(axis=-1), ior)
    return reflected * beckmann(half[..., 2], alpha) * masking / (4 * view[..., 2])


def beckmann(cosine: NDArray, alpha: NDArray) -> NDArray:
    """Return ``D = exp(-tan² / alpha²) / (pi alpha² cos⁴)``, with ``tan² = 1 / cos² - 1``."""
    tan_square = 1 / cosine**2 - 1
    pi = 4 * np.arctan(cosine.dtype.type(1))
    return np.exp(-tan_square / alpha**2) / (pi * alpha**2 * cosine**4)


def smith(cosine: NDArray, alpha: NDArray) -> NDArray:
    """Return the masking of one direction: Walter et al. (2007), equation 27."""
    with np.errstate(divide="ignore"):
        a = 1 / (alpha * np.sqrt(np.maximum(1 / cosine**2 - 1, 0)))
    a = np.minimum(a, 1.6)
    rational = (3.535 * a + 2.181 * a**2) / (1 + 2.276 * a + 2.577 * a**2)
    return np.where(a < 1.6, rational, 1)


def fresnel(cosine: NDArray, ior: NDArray) -> NDArray:
    """Return the reflectance of a dielectric in air for unpolarised light."""
    inner = np.sqrt(1 - (1 - cosine**2) / ior**2)
    across = (cosine - ior * inner) / (cosine + ior * inner)
    along = (ior * cosine - inner) / (ior * cosine + inner)
    return (across**2 + along**2) / 2


def _unit(vector):
    return vector / np.sqrt((vector * vector).sum(axis=-1, keepdims=True))
