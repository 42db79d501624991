"""Noisy passes of two pictures, and what is measured of them, in processes without Mitsuba too."""

import numpy as np

from fotismos.comparisons.departure import marks
from fotismos.comparisons.departure.metrics import METRICS, leading_distance
from fotismos.comparisons.departure.statistics import summarise
from fotismos.comparisons.records.departure import DEFAULT_VIEWING
from fotismos.reference.rendering.sums import DifferenceSums


def passes():
    """Six passes of both halves of a small picture, (6, H, W, 3), and their pixels."""
    rng = np.random.default_rng(11)
    y, x = np.mgrid[0:24, 0:32] / 32
    reference = np.stack((0.1 + x, 0.5 * y + 0.2, np.abs(x - y)), axis=-1)
    test = np.where(x[..., None] < 0.3, 1.3 * reference, reference)
    images = [image * rng.gamma(50.0, 1 / 50, (6, *image.shape)) for image in (test, reference)]
    return *(image.astype(np.float32).astype(float) for image in images), np.ones(x.shape, bool)


def measured(kind=np.asarray):
    """Return what is measured of the passes, as plain data."""
    test, reference, counted = passes()
    sums = DifferenceSums(counted)
    for one, other in zip(test, reference, strict=True):
        sums.add(kind(one), kind(other))
    difference = sums.estimate()
    mean = test.mean(axis=0)
    truth = mean - difference.mean
    found = {}
    for name, metric in METRICS.items():
        summary, image = summarise(
            metric,
            mean,
            truth,
            counted,
            noise=difference.noise,
            grouped=difference.grouped,
        )
        numbers = [summary.mean, summary.p95, summary.low, summary.high, summary.noise_floor]
        found[name] = [*numbers, float(image.max()), *(share.value for share in summary.visible)]
    marked = marks.find(difference, mean, counted, leading_distance(DEFAULT_VIEWING))
    found["marked"] = [int((marked.image == value).sum()) for value in (0, 0.5, 1)]
    found["third"] = float(np.abs(difference.third).sum())
    return found
