"""The best exposure: the one factor on the test image that brings it nearest to the reference."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from comparisons.departure.metric import Distances, Metric, checked_pair
from comparisons.departure.spaces import DEFAULT_VIEWING, Array, Viewing

#: The best exposure is sought within this many stops on either side of none.
EXPOSURE_STOPS = 6.0

#: Pixels on which the best exposure is sought, and those that bracket it first.
_SEARCH_PIXELS, _BRACKET_PIXELS = 16_384, 2_048


def best_exposure(
    metric: Metric,
    test: ArrayLike,
    reference: ArrayLike,
    mask: ArrayLike,
    viewing: Viewing = DEFAULT_VIEWING,
) -> float:
    """The factor on `test`, within ±6 stops, that makes the mean of `metric` over `mask` smallest.

    That of a linear metric is the factor of least squares. Of others, the mean is taken over at
    most 16,384 counted pixels, drawn with a fixed seed. Whole stops bracket the minimum, a bounded
    scalar search (Brent) finds it to 0.001 stop, and the factors 1 and least squares compete with
    it, so an image that is a multiple of the reference gives that multiple exactly. 1 if no pixel
    counts or if either image has no positive value there.
    Raises as `comparisons.departure.metrics.delta_e_2000`.
    """
    from scipy.optimize import minimize_scalar

    test, reference = checked_pair(test, reference)
    mask = np.asarray(mask, bool)
    if metric.linear:
        return least_squares_factor(test[mask], reference[mask])
    lit = [(mask & (image > 0.0).any(axis=-1)).any() for image in (test, reference)]
    if not all(lit):
        return 1.0
    # A random draw, not every n-th pixel: a stride would fall in step with the columns.
    places = np.flatnonzero(mask)
    count = min(len(places), _SEARCH_PIXELS)
    drawn = places[np.random.default_rng(0).choice(len(places), count, replace=False)]
    drawn = np.unravel_index(drawn, mask.shape)
    some = tuple(index[:_BRACKET_PIXELS] for index in drawn)
    distances, bracketing = (metric.against(reference, at, viewing) for at in (drawn, some))

    def mean_at(stops: float, distances: Distances = distances) -> float:
        return metric.mean(distances(test, factor=2.0**stops))

    whole_stops = np.arange(-EXPOSURE_STOPS, EXPOSURE_STOPS + 1.0)
    start = whole_stops[np.argmin([mean_at(s, bracketing) for s in whole_stops])]
    bounds = max(start - 1.0, -EXPOSURE_STOPS), min(start + 1.0, EXPOSURE_STOPS)
    found = minimize_scalar(mean_at, bounds=bounds, method="bounded", options={"xatol": 1e-3})
    least_squares = np.log2(least_squares_factor(test[drawn], reference[drawn]))
    candidates = [0.0, float(np.clip(least_squares, -EXPOSURE_STOPS, EXPOSURE_STOPS)), found.x]
    return float(2.0 ** min(candidates, key=mean_at))


def least_squares_factor(test: Array, reference: Array) -> float:
    """``Σ test·reference / Σ test²``, 1 where that is not positive."""
    energy, overlap = float(np.vdot(test, test)), float(np.vdot(test, reference))
    return overlap / energy if energy > 0.0 and overlap > 0.0 else 1.0
