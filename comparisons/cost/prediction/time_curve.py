"""Time of one image of ``N`` pixels with ``s`` samples each, as a function of both.

For later frames (the first also traces and compiles)::

    T(N, s) = t_0 + t_N N + t_s N s,    t_0, t_N, t_s >= 0

fitted in logarithms, so each measurement counts by its relative error. The interval is Student's t
for one more measurement. The scatter about the law comes from the misfit of each measurement to a
fit without it: over all methods of a run, which take turns on the machine, with more weight on a
method's own.
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
"""Weight of all methods' measurements together, next to a method's own."""

LEAST_SCATTER = 0.01
"""Relative; no clock or machine is better."""


@dataclass(frozen=True)
class TimeCurve:
    """``T(N, s)`` of the module's formula, in seconds.

    Attributes
    ----------
    coefficients
        ``(t_0, t_N, t_s)``.
    covariance
        (3, 3): covariance of their logarithms, over the square of the scatter.
    missed
        (n,): misfit of each measurement in ``log T`` to a fit without it, in standard deviations
        for a scatter of 1.
    """

    coefficients: tuple[float, float, float]
    covariance: NDArray[np.float64]
    missed: NDArray[np.float64]

    @classmethod
    def fit(cls, pixels: ArrayLike, spp: ArrayLike, seconds: ArrayLike) -> "TimeCurve":
        """Fit measured times, (n,) each, at least four of them."""
        terms = _terms(pixels, spp)
        measured = np.log(np.asarray(seconds, float))
        # All three terms start equal: a third of the smallest time each.
        start = np.log(np.exp(measured.min()) / 3 / terms.max(axis=0))
        found = least_squares(
            lambda logs: np.log(terms @ np.exp(logs)) - measured, start, x_scale=1.0
        )
        # A coefficient of 0 has no slope; the pseudoinverse leaves it out.
        covariance = np.linalg.pinv(found.jac.T @ found.jac, rcond=1e-6)
        leverage = np.einsum("ni,ij,nj->n", found.jac, covariance, found.jac)
        missed = found.fun / np.sqrt(np.maximum(1 - leverage, 1 / len(measured)))
        return cls(tuple(np.exp(found.x).tolist()), covariance, missed)

    def scatter(self, curves: Sequence["TimeCurve"]) -> float:
        """Return the standard deviation of ``log T``, given the curves of all methods."""
        shared = np.mean(np.concatenate([curve.missed for curve in curves]) ** 2)
        whole = np.sum(self.missed**2) + SHARED * shared
        return max(sqrt(whole / (len(self.missed) + SHARED)), LEAST_SCATTER)

    def at(self, pixels: float, spp: float, scatter: float) -> Range:
        """Return seconds and the ends of their interval at :data:`LEVEL`."""
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
