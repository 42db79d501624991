"""The losses of a fit: means over pixels of a distance between two images.

=================  =====================================================================  =========
Loss               Distance of two pixels                                                 Unit
=================  =====================================================================  =========
``perceptual``     Euclidean in CAM16-UCS                                                 ΔE
``linear``         its square, in linear RGB; 1 is display white                          white
``log-luminance``  square of the ratio of luminances, each with                           stops
                   :data:`comparisons.departure.metrics.LOG2_EPSILON` added, in stops
=================  =====================================================================  =========

``perceptual`` is the default: departures are reported as mean colour differences, and of the three
metrics only CAM16-UCS is a plain Euclidean distance that is also close to ΔE2000. ΔE ITP is
Euclidean too, but dominated by the darkest pixels, where the models differ for all parameters.

- Unlike the metric, it is not clipped at display white: a clipped highlight would not show how high
  and narrow it is, and its lobe would be used to fit something else.
- The distance is averaged, not its square, as in the reports: otherwise a shadow, which no
  parameter makes, would pull all of them towards itself. Below ``Loss.rounding`` the distance
  turns into its square, ``sqrt(d^2 + c^2) - c``, to have derivatives everywhere. That is a tenth of
  a just noticeable difference: the loss is the mean distance to less than 0.1, and so is its
  minimum.

Residuals are not weighted by the reference's standard error: a reference without noise would have
infinite weights, and a fit to what is certain is not a fit to what is seen.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from comparisons.departure.metrics import LOG2_EPSILON
from comparisons.departure.spaces import Viewing, cam16ucs_unclipped, luminance

STEP = 1e-4
"""Relative step of the finite differences of colour spaces; their own error is its square."""

SMALLEST_STEP = 1e-8


@dataclass(frozen=True)
class Loss:
    """A loss: coordinates of pixels, and their derivatives.

    Attributes
    ----------
    name, unit
        See the table above.
    coordinates
        ``(rgb (N, 3), viewing) -> (N, K)``.
    derivative
        ``(rgb (N, 3), viewing) -> (N, K, 3)``, of the coordinates by R, G and B.
    threshold
        Root mean square change of the coordinates below which nothing shows.
    sees_colour
        Whether it distinguishes colours of equal luminance.
    rounding
        ``c`` above; infinite for squares.
    """

    name: str
    unit: str
    coordinates: Callable[[NDArray, Viewing], NDArray]
    derivative: Callable[[NDArray, Viewing], NDArray]
    threshold: float
    sees_colour: bool = True
    rounding: float = inf


def _linear(rgb, viewing):
    return rgb


def _linear_derivative(rgb, viewing):
    return np.broadcast_to(np.eye(3), (len(rgb), 3, 3))


def _log(rgb, viewing):
    return np.log2(np.maximum(luminance(rgb), 0) + LOG2_EPSILON)[:, None]


def _log_derivative(rgb, viewing):
    weights = luminance(np.eye(3))
    lifted = np.maximum(luminance(rgb), 0) + LOG2_EPSILON
    return (weights / (lifted[:, None] * np.log(2)))[:, None, :]


def _perceptual(rgb, viewing):
    return cam16ucs_unclipped(rgb, viewing)


def _perceptual_derivative(rgb, viewing):
    """Return central differences; all six images are converted at once."""
    step = STEP * np.abs(rgb) + SMALLEST_STEP
    shifts = np.concatenate([sign * np.eye(3) for sign in (1, -1)])
    values = _perceptual(rgb + shifts[:, None, :] * step, viewing)
    return np.moveaxis((values[:3] - values[3:]) / (2 * step.T[..., None]), 0, -1)


LOSSES = {
    loss.name: loss
    for loss in (
        Loss(
            "perceptual", "ΔE (CAM16-UCS)", _perceptual, _perceptual_derivative, 0.05, rounding=0.1
        ),
        Loss("linear", "white", _linear, _linear_derivative, 5e-4),
        Loss("log-luminance", "stops", _log, _log_derivative, 5e-3, sees_colour=False),
    )
}
