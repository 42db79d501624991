"""Statistics over an image: summaries, the best exposure and the noise floor.

"How far" has two meanings, and both are reported: the plain distance, and the smallest distance
with an exposure factor on the test image. The second is the *shape* of the departure; the
difference of the two is its *level*.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fotismos.comparisons.departure.colour import Array, linear
from fotismos.comparisons.departure.estimate import (
    Estimate,
    NoiseShown,
    Replicates,
    by_floor,
    estimate,
)
from fotismos.comparisons.departure.metrics import (
    Metric,
    Pixelwise,
    checked_pair,
    log2_luminance_ratio,
)
from fotismos.comparisons.departure.minimum import minimum
from fotismos.comparisons.records.departure import (
    DEFAULT_VIEWING,
    Exposed,
    RatioSummary,
    Summary,
    Viewing,
)
from fotismos.heuristic.convention import Floats
from fotismos.reference.rendering.sums import Grouped

# Pixels measured at a time, to keep temporaries small.
_BLOCK_PIXELS = 2**18


def summarise(
    metric: Metric,
    test: ArrayLike,
    reference: ArrayLike,
    mask: ArrayLike,
    viewing: Viewing = DEFAULT_VIEWING,
    noise: ArrayLike | None = None,
    grouped: Grouped | None = None,
    noise_shown: NoiseShown = "all",
) -> tuple[Summary, NDArray[np.float32]]:
    """Return the numbers of `metric` over `mask`, and its map over the whole image.

    The best exposure is used only if it lowers the mean over all counted pixels, so
    ``after_exposure.mean <= mean`` always.

    ``test`` and ``reference`` are linear (H, W, 3), and ``mask`` (H, W) holds the pixels that
    count; without any, all numbers are 0 and the factor is 1. ``noise`` is as for `noise_floor`;
    without it, the floor is 0. ``grouped`` are groups of passes of the difference, for the
    interval; without them, it is wider. ``noise_shown`` says whose noise they show.
    """
    test, reference = checked_pair(test, reference)
    mask = np.asarray(mask, bool)
    factor = best_exposure(metric, test, reference=reference, mask=mask, viewing=viewing)
    grain = np.asarray(noise) if noise is not None and np.any(noise) else None
    # Of the test image, after exposure, and of noise alone, the last two of the mask only. Single
    # precision keeps seven digits of a distance, in half the memory.
    maps: NDArray[np.float32] = np.zeros((3, *mask.shape), np.float32)
    is_pixelwise = isinstance(metric, Pixelwise)
    wide = np.float64 if is_pixelwise else test.dtype
    for rows in _blocks(metric, test):
        images = {0: test[rows]}
        if factor != 1.0:
            images[1] = np.multiply(test[rows], factor, dtype=wide)
        if grain is not None:
            images[2] = np.add(reference[rows], grain[rows], dtype=wide)
        # Equal pixels are 0 apart: the surroundings of a figure's objects cost nothing.
        measured = mask[rows]
        if is_pixelwise and not measured.all():
            measured = measured | (test[rows] != reference[rows]).any(axis=-1)
        where = measured if is_pixelwise and not measured.all() else ...
        distances = metric.of_several([*images.values()], reference[rows], where, viewing)
        for number, values in zip(images, distances, strict=True):
            maps[number][rows][where] = values
    values = maps[0][mask]
    exposed = maps[1][mask]
    noise_alone = maps[2][mask]
    numbers: dict[str, Any] = _numbers(metric, values)
    after = numbers
    if factor != 1.0:
        after = _numbers(metric, exposed)
        # A factor of a sample, or of least squares, may be worse over all pixels.
        if after["mean"] > numbers["mean"]:
            factor = 1.0
            after = numbers
    clean: Estimate
    if isinstance(metric, Pixelwise) and grouped is not None:
        replicates = Replicates.of(test, grouped, noise_shown)
        clean = estimate(metric, replicates, viewing, measured=values)
    else:
        clean = by_floor(metric, values, noise_alone)
    summary = Summary(
        **numbers,
        noise_floor=metric.mean(noise_alone),
        after_exposure=Exposed(exposure=factor, **after),
        psnr=metric.psnr(numbers["mean"]),
        debiased=clean.mean.value,
        low=clean.mean.low,
        high=clean.mean.high,
        visible=clean.visible,
    )
    return summary, maps[0]


def summarise_log2_luminance(
    test: ArrayLike, reference: ArrayLike, mask: ArrayLike
) -> tuple[RatioSummary, NDArray[np.float32]]:
    """Return a summary of `log2_luminance_ratio` over `mask`, and the map (H, W) in stops."""
    test, reference = checked_pair(test, reference)
    ratio: NDArray[np.float32] = np.empty(test.shape[:-1], np.float32)
    for rows in _rows(test):
        ratio[rows] = log2_luminance_ratio(test[rows], reference[rows])
    values = ratio[np.asarray(mask, bool)]
    if not values.size:
        return RatioSummary(mean=0.0, p05=0.0, p50=0.0, p95=0.0), ratio
    p05, p50, p95 = map(float, np.percentile(values, (5, 50, 95)))
    return RatioSummary(mean=float(values.mean(dtype=np.float64)), p05=p05, p50=p50, p95=p95), ratio


def noise_floor(
    metric: Metric,
    reference: ArrayLike,
    noise: ArrayLike,
    mask: ArrayLike,
    viewing: Viewing = DEFAULT_VIEWING,
) -> float:
    """Return the mean of `metric` over `mask` between the reference and itself with noise added.

    `noise` (H, W, 3) is distributed like the error of the reference, such as the mean of its
    independent passes with alternating signs. A result near this is indistinguishable from 0.
    """
    reference, noise = checked_pair(reference, noise)
    mask = np.asarray(mask, bool)
    if not mask.any() or not noise.any():
        return 0.0
    values = [
        metric.against(reference[rows], mask[rows], viewing)(
            np.add(reference[rows], noise[rows], dtype=np.float64)
        )
        for rows in _blocks(metric, reference)
    ]
    return metric.mean(np.concatenate(values))


def _numbers(metric: Metric, values: Floats) -> dict[str, float]:
    if not values.size:
        return dict.fromkeys(("mean", "p50", "p95", "max"), 0.0)
    p50, p95 = map(float, np.percentile(values, (50, 95)))
    return {"mean": metric.mean(values), "p50": p50, "p95": p95, "max": float(values.max())}


def share(marked: Array) -> float:
    """Return the share of pixels that are marked; 0 if there are no pixels."""
    return float(marked.mean()) if marked.size else 0.0


def _blocks(metric: Metric, image: Array) -> Iterator[slice]:
    """Yield slices of about `_BLOCK_PIXELS` pixels; all rows unless the metric is pixelwise."""
    return _rows(image) if isinstance(metric, Pixelwise) else iter([slice(0, len(image))])


def _rows(image: Array) -> Iterator[slice]:
    # In a list of pixels (N, 3) each one is a row.
    step = max(1, _BLOCK_PIXELS * len(image) // max(image.size // 3, 1))
    return (slice(start, start + step) for start in range(0, len(image), step))


EXPOSURE_STOPS = 6.0
"""Largest exposure in stops, up or down, in the search for the best one."""

# Pixels for the search of the best exposure, and for bracketing it.
_SEARCH_PIXELS = 16_384
_BRACKET_PIXELS = 2_048


def best_exposure(
    metric: Metric,
    test: ArrayLike,
    reference: ArrayLike,
    mask: ArrayLike,
    viewing: Viewing = DEFAULT_VIEWING,
) -> float:
    """Return the factor on `test`, within ±6 stops, of the smallest mean of `metric` over `mask`.

    For a root mean square of light it is the factor of least squares, and also for a metric of
    neighbourhoods, which would need whole images. For others, the mean is over at most 16,384
    counted pixels, drawn with a fixed seed. Whole stops bracket the minimum, a bounded scalar
    search (Brent) finds it to 0.001 stop, and the factors 1 and least squares compete with it, so a
    multiple of the reference gives that multiple exactly. 1 if no pixel counts or if either image
    has no positive value.
    """
    test, reference = checked_pair(test, reference)
    mask = np.asarray(mask, bool)
    if not isinstance(metric, Pixelwise) or (
        metric.averages_squares and metric.coordinates is linear
    ):
        counted = ... if mask.all() else mask
        return least_squares_factor(test[counted], reference[counted])
    lit = [((image > 0.0) & mask[..., None]).any() for image in (test, reference)]
    if not all(lit):
        return 1.0
    # A random draw, not every n-th pixel: a stride would fall in step with the columns.
    places = np.flatnonzero(mask)
    count = min(len(places), _SEARCH_PIXELS)
    chosen = np.random.default_rng(0).choice(len(places), count, replace=False)
    drawn = np.unravel_index(places[chosen], mask.shape)
    shown = test[drawn].astype(np.float64)
    truth = reference[drawn].astype(np.float64)
    distances = metric.against(truth, ..., viewing)

    def mean_at(stops: float) -> float:
        return metric.mean(distances(2.0**stops * shown))

    # The bracket: all whole stops at once, (13, n, 3), on fewer pixels.
    whole_stops = np.arange(-EXPOSURE_STOPS, EXPOSURE_STOPS + 1.0)
    bracketing = 2.0 ** whole_stops[:, None, None] * shown[:_BRACKET_PIXELS]
    at_stops = metric.against(truth[:_BRACKET_PIXELS], ..., viewing)(bracketing)
    start = whole_stops[np.argmin([metric.mean(at_stop) for at_stop in at_stops])]
    low = max(start - 1.0, -EXPOSURE_STOPS)
    high = min(start + 1.0, EXPOSURE_STOPS)
    finest, _ = minimum(mean_at, low, high, tolerance=1e-3)
    least_squares = np.log2(least_squares_factor(shown, truth))
    candidates = [0.0, float(np.clip(least_squares, -EXPOSURE_STOPS, EXPOSURE_STOPS)), finest]
    return float(2.0 ** min(candidates, key=mean_at))


def least_squares_factor(test: Array, reference: Array) -> float:
    """Return ``Σ test·reference / Σ test²``, or 1 if that is not positive."""
    energy = overlap = 0.0
    for rows in _rows(test):
        shown = np.asarray(test[rows], np.float64).reshape(-1, 3)
        truth = np.asarray(reference[rows], np.float64).reshape(-1, 3)
        # Not a product of BLAS, whose threads wait at full load.
        energy += float(np.einsum("nc,nc->", shown, shown))
        overlap += float(np.einsum("nc,nc->", shown, truth))
    return overlap / energy if energy > 0.0 and overlap > 0.0 else 1.0
