"""The departure of two images, or of two sets of directions, as the columns of a row."""

from collections.abc import Iterable

import numpy as np
from msgspec.structs import replace

from comparisons.departure import statistics
from comparisons.departure.metric import Pixelwise, checked_pair
from comparisons.departure.metrics import LEADING, METRICS, RATIO, log2_luminance_ratio
from comparisons.departure.spaces import DEFAULT_VIEWING
from comparisons.study.columns import DIMMED
from reference.pairing.factors import Miss


def measure(
    heuristic: np.ndarray,
    reference: np.ndarray,
    counted: np.ndarray,
    noise: np.ndarray | None = None,
) -> dict[str, float]:
    """Return the columns that all scenes have.

    Parameters
    ----------
    heuristic, reference
        Linear images (H, W, 3).
    counted
        Pixels (H, W) that count.
    noise
        Noise (H, W, 3) of the difference.
    """
    summary, _ = statistics.summarise(LEADING, heuristic, reference, counted, noise=noise)
    ratio, _ = statistics.summarise_log2_luminance(heuristic, reference, counted)
    test, truth = heuristic[counted], reference[counted]
    checked_pair(heuristic, reference)
    means = {
        name: metric.mean(metric.against(reference, counted, DEFAULT_VIEWING)(heuristic))
        for name, metric in METRICS.items()
    }
    dimmed = _dimmed(test, truth) if test.size else dict.fromkeys(DIMMED, np.zeros(1))
    return {
        "heuristic": float(test.mean()) if test.size else 0.0,
        "reference": float(truth.mean()) if truth.size else 0.0,
        **means,
        f"{LEADING.name}_p95": summary.p95,
        f"{LEADING.name}_noise": summary.noise_floor,
        f"{LEADING.name}_shape": summary.after_exposure.mean,
        **{f"{LEADING.name}_{part}": float(values.mean()) for part, values in dimmed.items()},
        "exposure": summary.after_exposure.exposure,
        RATIO.name: ratio.mean,
    }


def largest_miss(misses: Iterable[Miss]) -> float:
    """Return the largest relative miss of a pairing, 0 if it is exact."""
    return max((abs(miss.reached / miss.wanted - 1) for miss in misses if miss.wanted), default=0.0)


def measure_each(heuristic: np.ndarray, reference: np.ndarray) -> dict[str, np.ndarray]:
    """Return the columns of single grey values (N,), one array each.

    The shape column is missing: the best exposure would remove all departure of a single value.
    """
    test, truth = checked_pair(*(np.repeat(v[:, None], 3, axis=1) for v in (heuristic, reference)))
    pixelwise = {n: metric for n, metric in METRICS.items() if isinstance(metric, Pixelwise)}
    return {
        "heuristic": heuristic,
        "reference": reference,
        **{name: metric(test, truth) for name, metric in pixelwise.items()},
        **{f"{LEADING.name}_{part}": values for part, values in _dimmed(test, truth).items()},
        RATIO.name: log2_luminance_ratio(test, truth),
    }


def _dimmed(test: np.ndarray, truth: np.ndarray) -> dict[str, np.ndarray]:
    """Return the leading metric of each pixel (N, 3) under the light levels :data:`DIMMED`.

    Both models are linear in the light: less light is a lower exposure on both images.
    """
    return {
        part: LEADING(test, truth, replace(DEFAULT_VIEWING, exposure=factor))
        for part, factor in DIMMED.items()
    }
