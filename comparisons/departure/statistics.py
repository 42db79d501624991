"""Statistics over an image: summaries, the best exposure and the noise floor.

"How far" has two readings, and both are reported: the distance as it is, and the distance after
the one exposure factor on the test image that makes it smallest. The second is the *shape* of
the departure; what lies between the two is *level*.

A colour difference is never negative, so a noisy reference differs from the truth by ΔE > 0 even
where the test image is exact; `noise_floor` says by how much. Which pixels differ by more than
noise is told by `comparisons.departure.marks`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from comparisons.departure.exposure import best_exposure, least_squares_factor
from comparisons.departure.metrics import (
    DEFAULT_VIEWING,
    Array,
    Metric,
    Viewing,
    checked_pair,
    log2_luminance_ratio,
    rmse,
)

#: Pixels measured at a time: temporaries stay small whatever the image's size.
_BLOCK_PIXELS = 2**20


@dataclass(frozen=True)
class ExposedSummary:
    """A metric over an image after the factor `exposure` on the test image."""

    exposure: float
    mean: float
    p50: float
    p95: float
    max: float


@dataclass(frozen=True)
class MetricSummary:
    """A metric over the counted pixels, in the metric's own unit.

    `noise_floor` is the mean that the reference's own noise alone would give.
    """

    mean: float
    p50: float
    p95: float
    max: float
    noise_floor: float
    after_exposure: ExposedSummary


@dataclass(frozen=True)
class ExposedRmse:
    """The linear RMSE after the factor `exposure` on the test image."""

    exposure: float
    value: float


@dataclass(frozen=True)
class RmseSummary:
    """The linear RMSE over the counted pixels; 1 is display white."""

    value: float
    noise_floor: float
    after_exposure: ExposedRmse


@dataclass(frozen=True)
class RatioSummary:
    """The signed luminance ratio over the counted pixels, in stops."""

    mean: float
    p05: float
    p50: float
    p95: float


def summarise(
    metric: Metric,
    test: ArrayLike,
    reference: ArrayLike,
    mask: ArrayLike,
    viewing: Viewing = DEFAULT_VIEWING,
    noise: ArrayLike | None = None,
) -> tuple[MetricSummary, Array]:
    """The numbers of `metric` over `mask`, and its map over the whole image.

    test, reference
        Linear images (H, W, 3).
    mask
        Boolean (H, W): the pixels that count. With none, every number is 0 and the factor 1.
    noise
        A noise image (H, W, 3) as for `noise_floor`; without it the floor is 0.

    The best exposure is used only if it lowers the mean over all counted pixels, so
    ``after_exposure.mean <= mean`` always. Raises as `comparisons.departure.metrics.delta_e_2000`.
    """
    test, reference = checked_pair(test, reference)
    mask = np.asarray(mask, bool)
    factor = best_exposure(metric, test, reference, mask, viewing)
    has_noise = noise is not None and np.any(noise)
    distance, exposed, noisy = np.zeros(test.shape[:-1]), [], []
    for rows in _blocks(test):
        here, truth = mask[rows], reference[rows]
        # Equal colours are 0 apart: what lies around the objects of a figure costs nothing.
        wanted = here | (test[rows] != truth).any(axis=-1)
        fixed = metric.coordinates(truth[wanted], viewing)
        shown = metric.coordinates(test[rows][wanted], viewing)
        distance[rows][wanted] = metric.difference(fixed, shown)
        fixed = fixed[here[wanted]]
        if factor != 1.0:
            shown = metric.coordinates(factor * test[rows][here], viewing)
            exposed.append(metric.difference(fixed, shown))
        if has_noise:
            shown = metric.coordinates((truth + noise[rows])[here], viewing)
            noisy.append(metric.difference(fixed, shown))
    numbers = after = _numbers(distance[mask])
    if factor != 1.0:
        after = _numbers(np.concatenate(exposed))
        if after["mean"] > numbers["mean"]:
            factor, after = 1.0, numbers
    floor = _numbers(np.concatenate(noisy))["mean"] if has_noise else 0.0
    at_best = ExposedSummary(exposure=factor, **after)
    return MetricSummary(**numbers, noise_floor=floor, after_exposure=at_best), distance


def summarise_rmse(
    test: ArrayLike, reference: ArrayLike, mask: ArrayLike, noise: ArrayLike | None = None
) -> RmseSummary:
    """The linear RMSE over `mask`, its noise floor √(mean noise²), and after best exposure."""
    test, reference = checked_pair(test, reference)
    mask = np.asarray(mask, bool)
    test, reference = test[mask], reference[mask]
    value = rmse(test, reference)
    factor = least_squares_factor(test, reference)
    after = rmse(factor * test, reference)
    if after > value:
        factor, after = 1.0, value
    floor = 0.0
    if noise is not None:
        floor = rmse(np.asarray(noise)[mask], np.zeros_like(reference))
    return RmseSummary(value, floor, ExposedRmse(factor, after))


def summarise_log2_luminance(
    test: ArrayLike, reference: ArrayLike, mask: ArrayLike
) -> tuple[RatioSummary, Array]:
    """Mean and percentiles of `log2_luminance_ratio` over `mask`, and the map (H, W) in stops."""
    ratio = log2_luminance_ratio(test, reference)
    values = ratio[np.asarray(mask, bool)]
    if not values.size:
        return RatioSummary(0.0, 0.0, 0.0, 0.0), ratio
    p05, p50, p95 = np.percentile(values, (5, 50, 95))
    return RatioSummary(float(values.mean()), float(p05), float(p50), float(p95)), ratio


def noise_floor(
    metric: Metric,
    reference: ArrayLike,
    noise: ArrayLike,
    mask: ArrayLike,
    viewing: Viewing = DEFAULT_VIEWING,
) -> float:
    """The mean of `metric` over `mask` between the reference and itself with noise added.

    ``mean difference(reference + noise, reference)``. `noise` (H, W, 3) is an image with the
    distribution of the reference's standard error, such as the mean of its independent passes
    taken with alternating signs. A result near this value cannot be told from none.
    """
    reference, noise = checked_pair(reference, noise)
    mask = np.asarray(mask, bool)
    if not mask.any() or not noise.any():
        return 0.0
    values = []
    for rows in _blocks(reference):
        here = reference[rows][mask[rows]]
        noisy = metric.coordinates(here + noise[rows][mask[rows]], viewing)
        values.append(metric.difference(metric.coordinates(here, viewing), noisy))
    return float(np.concatenate(values).mean())


def _numbers(values: Array) -> dict[str, float]:
    if not values.size:
        return {"mean": 0.0, "p50": 0.0, "p95": 0.0, "max": 0.0}
    p50, p95 = np.percentile(values, (50, 95))
    return {
        "mean": float(values.mean()),
        "p50": float(p50),
        "p95": float(p95),
        "max": float(values.max()),
    }


def _blocks(image: Array) -> Iterator[slice]:
    """Slices of rows that hold about `_BLOCK_PIXELS` pixels."""
    step = max(1, _BLOCK_PIXELS * len(image) // max(image.size // 3, 1))
    return (slice(start, start + step) for start in range(0, len(image), step))
