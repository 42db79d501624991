"""The departure of two images, or of two sets of directions, as the columns of a row."""

import numpy as np

from comparisons.departure import statistics
from comparisons.departure.metrics import METRICS, checked_pair

ITP, CAM16 = METRICS["dE_ITP"], METRICS["dE_CAM16UCS"]


def measure(heuristic, reference, counted, noise=None):
    """Return the columns that all scenes have, over the pixels ``counted`` (H, W).

    heuristic, reference, noise
        Linear images (H, W, 3); the noise is that of their difference.

    Raises
    ------
    NonFiniteError
        For a NaN or an infinity.
    """
    summary, _ = statistics.summarise(METRICS["dE2000"], heuristic, reference, counted, noise=noise)
    ratio, _ = statistics.summarise_log2_luminance(heuristic, reference, counted)
    test, truth = heuristic[counted], reference[counted]
    return {
        "heuristic": float(test.mean()) if test.size else 0.0,
        "reference": float(truth.mean()) if truth.size else 0.0,
        "dE2000": summary.mean,
        "dE2000_p95": summary.p95,
        "dE2000_noise": summary.noise_floor,
        "dE2000_shape": summary.after_exposure.mean,
        "exposure": summary.after_exposure.exposure,
        "dE_ITP": float(ITP(test, truth).mean()) if test.size else 0.0,
        "dE_CAM16UCS": float(CAM16(test, truth).mean()) if test.size else 0.0,
        "rmse": statistics.rmse(heuristic, reference, counted),
        "log2_luminance": ratio.mean,
    }


def largest_miss(misses):
    """Return the largest relative miss of a pairing, 0 where nothing is missed."""
    return max((abs(miss.reached / miss.wanted - 1) for miss in misses if miss.wanted), default=0.0)


def measure_each(heuristic, reference):
    """Return the columns of single values (N,) of grey, one array each.

    There is no shape to a single value; what a best exposure would leave is nothing.

    Raises
    ------
    NonFiniteError
        For a NaN or an infinity.
    """
    test, truth = checked_pair(*(np.repeat(v[:, None], 3, axis=1) for v in (heuristic, reference)))
    return {
        "heuristic": heuristic,
        "reference": reference,
        **{name: metric(test, truth) for name, metric in METRICS.items()},
        "rmse": np.abs(heuristic - reference),
        "log2_luminance": statistics.log2_luminance_ratio(test, truth),
    }
