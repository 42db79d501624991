"""Time of one image of ``N`` pixels with ``s`` samples each, as a curve of both.

On later frames (the first one traces and compiles besides)::

    T(N, s) = t_0 + t_N N + t_s N s,    t_0, t_N, t_s >= 0

fitted in logarithms, so that each measurement counts by its relative error. Its interval is that of
Student's t for one more measurement. How far measurements scatter about the law, each of them tells
by what a fit without it would miss: over all methods of a run together, since the machine is theirs
in turns, and of each method more by its own.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats
from scipy.optimize import least_squares

from comparisons.cost.prediction.error_law import LEVEL

Range = tuple[float, float, float]
"""A value, and the ends of its interval."""

SHARED = 6
"""Measurements that those of all methods count as, for one method beside its own."""

LEAST_SCATTER = 0.01
"""Relative: no clock and no machine are better."""


@dataclass(frozen=True)
class TimeCurve:
    """``T(N, s)`` of the module's formula, in seconds.

    Attributes
    ----------
    coefficients
        ``(t_0, t_N, t_s)``.
    covariance
        (3, 3): of their logarithms, over the square of the scatter.
    missed
        (n,): what a fit without each measurement misses of it in ``log T``, over what that varies
        by for a scatter of 1.
    """

    coefficients: tuple[float, float, float]
    covariance: NDArray[np.float64]
    missed: NDArray[np.float64]

    @classmethod
    def fit(cls, pixels: ArrayLike, spp: ArrayLike, seconds: ArrayLike) -> "TimeCurve":
        """Fit measured times, (n,) each, at least four of them."""
        terms = _terms(pixels, spp)
        measured = np.log(np.asarray(seconds, float))
        # Scaled so that all three unknowns start alike: a third of the smallest time each.
        start = np.log(np.exp(measured.min()) / 3 / terms.max(axis=0))
        found = least_squares(
            lambda logs: np.log(terms @ np.exp(logs)) - measured, start, x_scale=1.0
        )
        # A coefficient that came out as nothing has no slope, and the pseudoinverse no say in it.
        covariance = np.linalg.pinv(found.jac.T @ found.jac, rcond=1e-6)
        leverage = np.einsum("ni,ij,nj->n", found.jac, covariance, found.jac)
        missed = found.fun / np.sqrt(np.maximum(1 - leverage, 1 / len(measured)))
        return cls(tuple(np.exp(found.x).tolist()), covariance, missed)

    def scatter(self, curves: Sequence["TimeCurve"]) -> float:
        """Return the standard deviation of ``log T``, beside the curves of all methods."""
        shared = np.mean(np.concatenate([curve.missed for curve in curves]) ** 2)
        whole = np.sum(self.missed**2) + SHARED * shared
        return max(sqrt(whole / (len(self.missed) + SHARED)), LEAST_SCATTER)

    def at(self, pixels: float, spp: float, scatter: float) -> Range:
        """Return seconds, and the ends of their interval at :data:`LEVEL`."""
        parts = _terms([pixels], [spp])[0] * self.coefficients
        value = float(parts.sum())
        slope = parts / value
        spread = scatter * sqrt(1 + float(slope @ self.covariance @ slope))
        freedom = len(self.missed) - len(slope) + SHARED
        reach = exp(stats.t.ppf((1 + LEVEL) / 2, freedom) * spread)
        return value, value / reach, value * reach


def _terms(pixels: ArrayLike, spp: ArrayLike) -> NDArray[np.float64]:
    pixels, spp = np.asarray(pixels, float), np.asarray(spp, float)
    return np.stack([np.ones_like(pixels), pixels, pixels * spp], axis=-1)
