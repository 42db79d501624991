"""The search for the best parameters: bounded least squares from several starts.

SciPy's trust-region reflective method (Branch, Coleman and Li 1999) takes the Jacobian of
:mod:`comparisons.fit.model` and the bounds. A highlight's width can trap it, so that it starts from
the paired parameters and from lobes of several widths, each with the coefficients that suit it
best: they are the solution of a linear problem.
"""

from dataclasses import dataclass
from math import log

import numpy as np
from scipy.optimize import least_squares, lsq_linear

from comparisons.fit import parameters as layout

STARTS = (2.0, 8.0, 32.0, 128.0, 512.0)
"""Exponents of the form ``phong`` to start from; of ``blinn`` they are four times as large."""

REFINED = 2
"""The starts that are followed to their minimum, besides the paired one: those of least cost."""

TOLERANCE = 1e-9
LARGEST_COUNT = 100


@dataclass(frozen=True)
class Start:
    """One search: where it began, where it ended, and what it took.

    ``cost`` is the root mean square of the loss's residuals; None at the end where a start was
    worse than others and not followed. ``n`` is None for the paired parameters.
    """

    n: float | None
    cost: float
    final_cost: float | None = None
    evaluations: int = 0
    converged: bool = False
    message: str = "not followed: other starts are better"


@dataclass(frozen=True)
class Solution:
    """The best parameters ``x``, the Jacobian of the residuals there, and all searches."""

    x: np.ndarray
    cost: float
    jacobian: np.ndarray
    starts: tuple[Start, ...]


class Residuals:
    """Differences in a loss's coordinates over the counted pixels, and their derivatives.

    Parameters
    ----------
    model : comparisons.fit.model.Model
        Of the image.
    reference
        (H W, 3).
    counted
        (H W), the pixels that count.
    loss : comparisons.fit.loss.Loss
        In whose coordinates.
    viewing : comparisons.spaces.Viewing
        How linear values are looked at.
    """

    def __init__(self, model, reference, counted, loss, viewing):
        self.model, self.loss, self.viewing = model, loss, viewing
        self.counted = counted
        self.reference = reference[counted]
        self._wanted = loss.coordinates(self.reference, viewing)

    def at(self, x):
        """Return the residuals, (pixels times coordinates)."""
        test = self.model.image(x)[self.counted]
        return (self.loss.coordinates(test, self.viewing) - self._wanted).ravel()

    def jacobian(self, x):
        """Return their derivatives, (pixels times coordinates, parameters)."""
        test = self.model.image(x)[self.counted]
        slopes = self.loss.derivative(test, self.viewing)
        jacobian = slopes @ self.model.columns(x)[self.counted]
        return jacobian.reshape(-1, len(x))

    def root_mean_square(self, residuals):
        """Return the root mean square over pixels of the distance that residuals make."""
        return float(np.sqrt(np.sum(residuals**2) / max(len(self.reference), 1)))


def minimise(residuals):
    """Find the parameters of least mean square residual.

    Parameters
    ----------
    residuals : Residuals
        What is minimised; its model names the parameters.

    Returns
    -------
    Solution
    """
    model = residuals.model
    low, high = layout.bounds(model.parameters)
    paired = layout.start(model.parameters)
    candidates = [(None, paired)]
    for n in STARTS:
        x = _with_exponent(paired, model, n)
        if not np.array_equal(x, paired):
            candidates.append((n, _best_coefficients(residuals, x, low, high)))
    costs = [residuals.root_mean_square(residuals.at(x)) for _, x in candidates]
    order = [0, *(1 + np.argsort(costs[1:], kind="stable")[:REFINED])]
    starts, best = [], (costs[0], paired)
    for place, (n, x) in enumerate(candidates):
        if place not in order:
            starts.append(Start(n, costs[place]))
            continue
        found = least_squares(
            residuals.at,
            x,
            residuals.jacobian,
            bounds=(low, high),
            x_scale="jac",
            ftol=TOLERANCE,
            xtol=TOLERANCE,
            gtol=TOLERANCE,
            max_nfev=LARGEST_COUNT,
        )
        cost = residuals.root_mean_square(found.fun)
        starts.append(Start(n, costs[place], cost, found.nfev, found.status > 0, found.message))
        best = min(best, (cost, found.x), key=lambda pair: pair[0])
    cost, x = best
    return Solution(x, cost, residuals.jacobian(x), tuple(starts))


def _with_exponent(x, model, n):
    """Return parameters with the same exponent for all materials."""
    at = [parameter.name == "n" for parameter in model.parameters]
    narrow = n * 4 if model.form == "blinn" else n
    return np.where(at, log(narrow), x)


def _best_coefficients(residuals, x, low, high):
    """Return parameters whose coefficients have the least mean square error in linear light."""
    model, counted = residuals.model, residuals.counted
    linear = model.linear
    columns = model.columns(x)[counted][..., linear].reshape(-1, linear.sum())
    wanted = (residuals.reference - model.surface.fixed[counted]).ravel()
    found = lsq_linear(columns, wanted, bounds=(low[linear], high[linear]))
    x = x.copy()
    x[linear] = np.clip(found.x, low[linear], high[linear])
    return x
