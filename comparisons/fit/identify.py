"""Which fitted parameters the image determines, and how uncertain the reference's noise makes them.

A parameter that the image does not show, or that others can make up for, has no fitted value, only
one at which the search happened to stop. The Jacobian's columns answer two questions:

1. *Does it show?* The root mean square change of the loss's coordinates, over the pixels that the
   parameter can reach, for one natural change of it (:mod:`comparisons.fit.parameters`).
2. *Can others undo that?* The same for the change that remains when all other parameters undo as
   much of it as they can: ``1 / sqrt((J^T J)^-1)`` on the diagonal, from the singular values of
   ``J``.

If either is below the loss's threshold, the parameter is not identifiable. Both are judged to first
order, at the fitted values, and as if a parameter at its bound were free to leave it: it may be
there only because the search began there. The covariance holds it there.

The covariance carries the reference's noise to the parameters: noise ``e`` in a pixel's coordinates
moves the gradient of the loss by ``J^T C e`` and its minimum by ``H^-1 J^T C e``, with the loss's
second derivatives ``C`` by a pixel's coordinates and ``H`` by the parameters. It is about noise
alone: even a wrong model has a best fit, which is as certain as the image.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from comparisons.fit.optimise import Residuals
from comparisons.fit.parameters import bounds

AT_BOUND = 1e-5
"""Share of the distance between two bounds; anything nearer to a bound is at it."""

PARTNER = 0.1
"""Share of a change that another parameter must take up to be named."""

COVERAGE = 1.96
"""Standard errors to either side, of an interval that covers 95 % of normal errors."""


@dataclass(frozen=True)
class Verdict:
    """Whether the image determines a parameter.

    Attributes
    ----------
    shows
        Root mean square change in the loss's coordinates by a natural change of it.
    own
        The part of that change which no other parameters undo.
    reason
        Why it is not identifiable; empty if it is.
    partners
        Indices of the parameters that undo it.
    at_bound
        Whether it is at one of its bounds.
    """

    shows: float
    own: float
    reason: str
    partners: tuple[int, ...] = ()
    at_bound: bool = False


def identify(
    residuals: Residuals, x: NDArray, pixels: NDArray[np.int64], standard_error: NDArray
) -> tuple[list[Verdict], NDArray[np.float64]]:
    """Judge each parameter at the best fit.

    Parameters
    ----------
    residuals
        Of the loss that was minimised.
    x
        (P,), the best parameters.
    pixels
        (P,), the number of pixels that each can reach.
    standard_error
        (counted pixels, 3), of the reference, or of its difference from the heuristic.

    Returns
    -------
    verdicts
        One per parameter.
    covariance
        (P, P), in the vector's numbers; 0 for parameters not identifiable or at a bound.
    """
    low, high = bounds(residuals.model.parameters)
    near, threshold = AT_BOUND * (high - low), residuals.distance.threshold
    at_bound = (x - low < near) | (high - x < near)
    root = np.sqrt(np.maximum(pixels, 1))
    changes = residuals.changes(x).reshape(-1, len(x))
    shows = np.linalg.norm(changes, axis=0) / root
    free = shows >= threshold
    inverse = _inverse_normal(changes[:, free])
    own = shows.copy()
    own[free] = 1 / np.sqrt(np.diag(inverse)) / root[free]
    determined = free & (own >= threshold)
    covariance = _covariance(residuals, x, determined & ~at_bound, standard_error)
    lost = determined & (COVERAGE * np.sqrt(np.diag(covariance)) > 1)
    verdicts = []
    for number in range(len(x)):
        reason = ""
        partners: tuple[int, ...] = ()
        if shows[number] < threshold:
            reason = "does not show in the image"
        elif free[number] and not determined[number]:
            partners = _partners(inverse, np.flatnonzero(free), number)
            reason = "others make up for it"
        elif lost[number]:
            reason = "lost in the reference's noise"
        verdicts.append(
            Verdict(
                float(shows[number]), float(own[number]), reason, partners, bool(at_bound[number])
            )
        )
    return verdicts, covariance


def _inverse_normal(jacobian):
    """Return ``(J^T J)^-1``; singular values below rounding are raised to it."""
    if not jacobian.shape[1]:
        return np.zeros((0, 0))
    _, singular, rows = np.linalg.svd(jacobian, full_matrices=False)
    singular = np.maximum(singular, 1e-12 * singular[0])
    scaled = rows.T / singular
    return scaled @ scaled.T


def _covariance(residuals, x, determined, standard_error):
    covariance = np.zeros((len(x),) * 2)
    if determined.any():
        second = residuals.quadratic(x)[1][np.ix_(determined, determined)]
        slopes = residuals.distance.derivative(residuals.reference, residuals.viewing)
        noise = residuals.curvature(x) @ (slopes * standard_error[:, None, :])
        changes = residuals.changes(x)[..., determined]
        spread = np.einsum("nkp,nkc->pnc", changes, noise) / len(noise)
        moved = np.linalg.pinv(second, hermitian=True) @ spread.reshape(len(spread), -1)
        covariance[np.ix_(determined, determined)] = moved @ moved.T
    return covariance


def _partners(inverse, free, number):
    """Return the parameters that must change with one for the image to stay unchanged."""
    place = int(np.flatnonzero(free == number)[0])
    direction = np.abs(inverse[place] / inverse[place, place])
    return tuple(
        int(other)
        for other, share in zip(free, direction, strict=True)
        if other != number and share > PARTNER
    )
