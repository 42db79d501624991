"""Time of one image of ``N`` pixels with ``s`` samples each, as a curve of both.

On later frames (the first one traces and compiles besides)::

    T(N, s) = t_0 + t_N N + t_s N s,    t_0, t_N, t_s >= 0

fitted in logarithms, so that each measurement counts by its relative error. Its interval is that of
Student's t for one more measurement, from what the measurements depart from the fit.
"""

from dataclasses import dataclass
from math import exp, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats
from scipy.optimize import least_squares

LEVEL = 0.9
"""Chance of an interval to hold what is measured later."""

Range = tuple[float, float, float]
"""A value, and the ends of its interval."""

LEAST_SCATTER = 0.05
"""Relative: a measurement that is repeated later moves by so much on a quiet machine."""


@dataclass(frozen=True)
class TimeCurve:
    """``T(N, s)`` of the module's formula, in seconds.

    Attributes
    ----------
    coefficients
        ``(t_0, t_N, t_s)``.
    covariance
        (3, 3): of their logarithms, over the square of the scatter.
    scatter
        Standard deviation of ``log T``.
    freedom
        Degrees of freedom that it is known by.
    """

    coefficients: tuple[float, float, float]
    covariance: NDArray[np.float64]
    scatter: float
    freedom: int

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
        freedom = max(len(measured) - 3, 1)
        scatter = max(sqrt(2 * found.cost / freedom), LEAST_SCATTER)
        # A coefficient that came out as nothing has no slope, and the pseudoinverse no say in it.
        covariance = np.linalg.pinv(found.jac.T @ found.jac, rcond=1e-6)
        return cls(tuple(np.exp(found.x).tolist()), covariance, scatter, freedom)

    def at(self, pixels: float, spp: float) -> Range:
        """Return seconds, and the ends of their interval at :data:`LEVEL`."""
        parts = _terms([pixels], [spp])[0] * self.coefficients
        value = float(parts.sum())
        slope = parts / value
        spread = self.scatter * sqrt(1 + float(slope @ self.covariance @ slope))
        reach = exp(stats.t.ppf((1 + LEVEL) / 2, self.freedom) * spread)
        return value, value / reach, value * reach


def _terms(pixels: ArrayLike, spp: ArrayLike) -> NDArray[np.float64]:
    pixels, spp = np.asarray(pixels, float), np.asarray(spp, float)
    return np.stack([np.ones_like(pixels), pixels, pixels * spp], axis=-1)
