"""Honest noise: intervals hold the truth as often as they say, and the floor is what is measured.

The scene is a small Cornell box; the truth is the mean of the other runs, whose own error is known.

The floor is right at any number of samples. That intervals hold the truth as often as they say
needs more: path-traced pixels are skewed, rare bright paths carrying much of the
light, and only means over many samples are near enough to a normal distribution. At the 64 samples
a pass tested here 95 % intervals hold 95 %; at 16, 93 %; at 4, 91 %.
"""

import numpy as np
import pytest
from scipy.special import stdtrit

from fotismos.comparisons.departure.metrics import METRICS
from fotismos.comparisons.departure.statistics import noise_floor
from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.reference.rendering.sums import Accumulator

pytestmark = pytest.mark.thorough

SIZE, PASSES, SPP, FEW = 12, 16, 64, 4


def runs(count, spp=SPP):
    """Independent runs of 16 passes each, as estimates."""
    options = Options(resolution=(SIZE, SIZE), spp=PASSES * spp)
    renderer = prepare(SCENES["cornell-box"].source(), options).reference
    for number in range(count):
        total = Accumulator()
        for each in range(PASSES):
            total.add(renderer.render(1000 * number + each))
        yield total.estimate()


def check_coverage(estimates, low, high):
    """Count how often ``mean ± t SE`` holds the mean of all other runs.

    That is itself noisy: the difference has the variance ``1 + 1/(n - 1)`` of one run's.
    """
    means = np.stack([estimate.mean for estimate in estimates])
    count = len(means)
    others = (means.sum(axis=0) - means) / (count - 1)
    half = stdtrit(PASSES - 1, 0.975) * np.sqrt(1 + 1 / (count - 1))
    held = [
        np.abs(estimate.mean - other) <= half * estimate.standard_error
        for estimate, other in zip(estimates, others, strict=True)
    ]
    assert low < np.mean(held) < high


def check_floor(estimates, tolerance):
    """Hold the floor that each run predicts against what runs measure between each other.

    A run differs from the truth, the mean of the others, as the noise image says.
    """
    metric, mask = METRICS["dE2000"], np.ones((SIZE, SIZE), bool)
    predicted = [noise_floor(metric, e.mean, e.noise, mask) for e in estimates]
    truth = np.mean([e.mean for e in estimates], axis=0)
    factor = 1 / np.sqrt(1 - 1 / len(estimates))  # each run is part of that mean
    measured = [factor * metric(e.mean, truth).mean() for e in estimates]
    assert np.mean(predicted) == pytest.approx(np.mean(measured), rel=tolerance)


def test_intervals_hold_the_truth_and_the_floor_is_what_runs_measure(rgb):
    # 16 runs of 432 values: the fraction is known to 0.005 or so, pixels being nearly independent.
    estimates = list(runs(16))
    check_coverage(estimates, 0.93, 0.97)
    check_floor(estimates, 0.1)


def test_the_floor_is_what_runs_measure_with_few_samples_too(rgb):
    check_floor(list(runs(12, FEW)), 0.1)


@pytest.mark.guarantee(
    "means", "Standard errors and noise floors match the scatter over a hundred seeds."
)
@pytest.mark.slow
def test_over_a_hundred_seeds(rgb):
    estimates = list(runs(100))
    check_coverage(estimates, 0.93, 0.97)
    check_floor(estimates, 0.1)
