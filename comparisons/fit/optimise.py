"""The search for the best parameters: a bounded Newton method from several starts.

The loss is a sum over pixels of a convex function of the coordinates' differences, which are nearly
linear in the parameters: its second derivative is that function's, carried over by the Jacobian, as
in the Gauss–Newton method. Each step minimises the quadratic that has these derivatives, damped as
by Levenberg and Marquardt, within the bounds. SciPy's bounded-variable least squares finds that
minimum exactly, so a parameter reaches its bound instead of approaching it. (Gauss–Newton on the
roots of distances takes over a hundred steps where this takes ten: it sees a curvature where a
distance has none.)

A highlight's width can trap the search. It starts from the paired parameters, and from lobes of
several widths with the coefficients that suit each best. So can the kink of a distance at 0, which
is hardly rounded in the end: each search first minimises a loss that is rounded more,
:data:`SMOOTH`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf, isfinite, log
from typing import Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from comparisons.departure.spaces import Viewing
from comparisons.fit import parameters
from comparisons.fit.loss import Loss
from comparisons.fit.model import Model
from comparisons.fit.parameters import Parameter
from comparisons.records import Amount, Count, Record

STARTS = (2.0, 8.0, 32.0, 128.0, 512.0)
"""Exponents of the form ``phong`` to start from; ``blinn`` has four times as large ones."""

FOLLOWED = 2
"""The starts of least loss that are followed to their minimum, besides the paired one."""

SMOOTH = 1.0
"""Rounding, in the loss's unit, of the loss that a search goes through first."""

LARGEST_COUNT = 60
"""Evaluations of one search."""

TOLERANCE = 1e-7
"""A search has converged when a step is expected to lower the loss by less than this part of it."""

SMALLEST_GAIN = 1e-14
"""The same in the loss's own unit, for images that the model can make exactly."""

LARGEST_DAMPING = 1e12


class Fittable(Protocol):
    """An image (N, 3) of pixels as a function of a vector of parameters."""

    @property
    def parameters(self) -> Sequence[Parameter]:
        """The parameters in the vector."""

    def image(self, x: NDArray) -> NDArray:
        """Return the image (N, 3)."""

    def columns(self, x: NDArray) -> NDArray:
        """Return its derivatives (number of parameters, N, 3)."""


AnyModel = TypeVar("AnyModel", bound=Fittable)


class Start(Record):
    """One search: where it began, where it ended, and its cost.

    Attributes
    ----------
    n
        Exponent of the start; null for the paired parameters.
    loss, final_loss
        Where it began and ended (:meth:`Residuals.loss`); null if it was not followed, since
        others began better.
    """

    n: float | None
    loss: Amount
    final_loss: Amount | None = None
    evaluations: Count = 0
    converged: bool = False


@dataclass(frozen=True)
class Solution:
    """The best parameters ``x``, the loss there, and all searches."""

    x: np.ndarray
    loss: float
    starts: tuple[Start, ...]


class Residuals(Generic[AnyModel]):
    """Differences in a loss's coordinates, and the derivatives of the loss.

    The loss is the mean over pixels of ``r(d) = sqrt(d^2 + c^2) - c`` for distances ``d``, or of
    ``d^2 / 2`` if ``c`` is infinite.

    Parameters
    ----------
    model
        Of the pixels that count.
    reference
        (N, 3).
    distance
        The loss.
    viewing
        How linear values are viewed.
    """

    def __init__(self, model: AnyModel, reference: NDArray, distance: Loss, viewing: Viewing):
        self.model, self.reference = model, reference
        self.distance, self.viewing = distance, viewing
        self._target = distance.coordinates(reference, viewing)

    def smoothed(self) -> "Residuals[AnyModel]":
        """Return the same with a loss that is rounded by :data:`SMOOTH` or more."""
        rounding = max(self.distance.rounding, SMOOTH)
        distance = replace(self.distance, rounding=rounding)
        return Residuals(self.model, self.reference, distance, self.viewing)

    def differences(self, x: NDArray) -> NDArray:
        """Return the differences of the coordinates, (N, K)."""
        return self._differences_of(self.model.image(x))

    def _differences_of(self, image: NDArray) -> NDArray:
        return self.distance.coordinates(image, self.viewing) - self._target

    def changes(self, x: NDArray) -> NDArray:
        """Return their derivatives, (N, K, parameters)."""
        slopes = self.distance.derivative(self.model.image(x), self.viewing)
        return slopes @ self.model.columns(x).transpose(1, 2, 0)

    def loss(self, x: NDArray) -> float:
        """Return the loss."""
        return self.loss_of(self.model.image(x))

    def loss_of(self, image: NDArray) -> float:
        """Return the loss of an image (N, 3) of the pixels that count."""
        square = np.sum(self._differences_of(image) ** 2, axis=1)
        c = self.distance.rounding
        # The same as sqrt(d^2 + c^2) - c, without the difference of like numbers.
        values = square / (np.sqrt(square + c * c) + c) if isfinite(c) else square / 2
        return float(values.mean())

    def curvature(self, x: NDArray) -> NDArray:
        """Return the second derivative of a pixel's loss by its coordinates, (N, K, K).

        ``I / s - d d^T / s^3`` with ``s = sqrt(d^2 + c^2)``.
        """
        differences = self.differences(x)
        identity = np.eye(differences.shape[1])
        s = self._norm(differences)[..., None]
        if not isfinite(self.distance.rounding):
            return np.broadcast_to(identity, (len(differences), *identity.shape))
        return identity / s - differences[:, :, None] * differences[:, None, :] / s**3

    def quadratic(self, x: NDArray) -> tuple[NDArray, NDArray]:
        """Return gradient (P,) and second derivative (P, P) of the loss by the parameters."""
        changes, differences = self.changes(x), self.differences(x)
        gradient = np.einsum("nkp,nk->p", changes, differences / self._norm(differences))
        flat = changes.reshape(-1, len(x))
        second = flat.T @ (self.curvature(x) @ changes).reshape(-1, len(x))
        return gradient / len(differences), second / len(differences)

    def _norm(self, differences):
        """Return ``s``, (N, 1); 1 for squares."""
        c = self.distance.rounding
        square = np.sum(differences**2, axis=1, keepdims=True)
        return np.sqrt(square + c * c) if isfinite(c) else np.ones_like(square)


def minimise(residuals: Residuals[Model]) -> Solution:
    """Find the parameters of least loss."""
    paired = parameters.start(residuals.model.parameters)
    candidates: list[tuple[float | None, NDArray]] = [(None, paired)]
    candidates += [(n, _best_coefficients(residuals, paired, n)) for n in STARTS]
    losses = [residuals.loss(x) for _, x in candidates]
    followed = {0, *(1 + np.argsort(losses[1:], kind="stable")[:FOLLOWED])}
    starts, best = [], (inf, paired)
    for place, (n, x) in enumerate(candidates):
        if place in followed:
            x, _, before, _ = descend(residuals.smoothed(), x)
            x, loss, evaluations, converged = descend(residuals, x)
            evaluations += before
            best = min(best, (loss, x), key=lambda pair: pair[0])
            starts.append(Start(n, losses[place], loss, evaluations, converged))
        else:
            starts.append(Start(n, losses[place]))
    return Solution(best[1], best[0], tuple(starts))


def descend(residuals: Residuals, x: NDArray) -> tuple[NDArray, float, int, bool]:
    """Return the minimum that a search from ``x`` finds, its loss, evaluations and convergence."""
    low, high = parameters.bounds(residuals.model.parameters)
    loss, damping = residuals.loss(x), 1e-3
    gradient, second = residuals.quadratic(x)
    for evaluations in range(1, LARGEST_COUNT):
        damped = second + damping * np.diag(np.diag(second))
        step = _bounded_minimum(damped, gradient, low - x, high - x)
        expected = -(gradient @ step + step @ damped @ step / 2)
        if expected <= max(TOLERANCE * loss, SMALLEST_GAIN) or damping > LARGEST_DAMPING:
            return x, loss, evaluations, True
        trial = np.clip(x + step, low, high)
        gained = loss - residuals.loss(trial)
        if gained > 0:
            x, loss = trial, loss - gained
            gradient, second = residuals.quadratic(x)
            damping *= 0.1 if gained > 0.5 * expected else 1
        if gained <= 0.1 * expected:
            damping *= 8
    return x, loss, LARGEST_COUNT, False


def _best_coefficients(residuals, x, n):
    """Return parameters with one exponent, and the coefficients that suit it in linear RGB."""
    model = residuals.model
    low, high = parameters.bounds(model.parameters)
    at_n = np.array([parameter.name == "n" for parameter in model.parameters])
    x = np.where(at_n, log(n * 4 if model.form == "blinn" else n), x)
    linear = model.linear
    columns = model.columns(x)[linear].reshape(linear.sum(), -1)
    target = (residuals.reference - model.surface.fixed).ravel()
    x[linear] = _bounded_minimum(columns @ columns.T, -columns @ target, low[linear], high[linear])
    return x


def _bounded_minimum(second, gradient, low, high):
    """Return the minimum of ``g x + x H x / 2`` within bounds, by bounded least squares.

    Directions without curvature get as much of it as rounding would leave, and stay in place.
    """
    values, vectors = np.linalg.eigh(second)
    roots = np.sqrt(np.maximum(values, max(1e-13 * values[-1], 1e-300)))
    found = lsq_linear(
        roots[:, None] * vectors.T, -(vectors.T @ gradient) / roots, (low, high), method="bvls"
    )
    return np.clip(found.x, low, high)
