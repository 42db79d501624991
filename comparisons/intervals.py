"""Standard errors and intervals of repeated measurements."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from reference.records import Estimated

LEVEL = 0.95


def jackknife_error(left_out: ArrayLike) -> NDArray[np.float64]:
    """Return the standard error of a statistic from its values (n, ...), each without one repeat.

    It holds for nonlinear statistics too, whose values for single, noisier repeats would not
    average to their value for the mean.
    """
    left_out = np.asarray(left_out, float)
    return np.sqrt((len(left_out) - 1) * left_out.var(axis=0))


def student(value: float, error: float, count: int) -> Estimated:
    """Return the interval around a value whose standard error comes from ``count`` repeats."""
    from scipy.special import stdtrit  # scipy.stats takes a second to import

    half = float(stdtrit(count - 1, 0.5 + LEVEL / 2)) * error
    return Estimated(value, value - half, value + half)


def jackknifed(values: ArrayLike) -> Estimated:
    """Return the first of values (1 + n), with an interval from the others.

    The first is of all repeats, each other one leaves out one of them.
    """
    value, *others = np.asarray(values, float)
    return student(float(value), float(jackknife_error(others)), len(others))
