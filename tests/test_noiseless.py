"""Errors without the part of noise, on images whose true departure is known."""

import numpy as np
import pytest

from comparisons.cost.judging import Judge
from comparisons.departure.metrics import LEADING
from comparisons.departure.spaces import DEFAULT_VIEWING
from comparisons.effects.noiseless import Noiseless
from reference.rendering.sums import Estimate

SIZE, REPLICATES, NOISE = 32, 8, 0.05
"""Noise of one replicate, linear, on a grey of 0.3: ΔE2000 of some 4."""


def noisy(rng, value, draw):
    noise = draw(rng, (REPLICATES, SIZE, SIZE, 1))
    return np.broadcast_to(value, (SIZE, SIZE, 3)) + NOISE * noise * np.ones(3)


def normal(rng, shape):
    return rng.normal(size=shape)


def skewed(rng, shape):
    return rng.exponential(size=shape) - 1


def judged(rng, draw, value):
    """Return errors (R + 1,) of images of a value, against a noisy reference of 0.3."""
    groups = noisy(rng, 0.3, draw)
    error = groups.std(axis=0, ddof=1) / np.sqrt(REPLICATES)
    reference = Estimate(groups.mean(axis=0), error, error, REPLICATES)
    judge = Judge(reference, np.ones((SIZE, SIZE), bool), DEFAULT_VIEWING)
    return Noiseless(judge, groups).errors(noisy(rng, value, draw)).mean(axis=1), judge


def true(value):
    pixel = LEADING(np.full((1, 1, 3), value), np.full((1, 1, 3), 0.3), DEFAULT_VIEWING)
    return float(pixel[0, 0])


@pytest.mark.guarantee(
    "prices",
    "Errors behind prices exclude noise: none of it remains where nothing differs, and at "
    "most two fifths near the noise.",
)
@pytest.mark.parametrize("draw", [normal, skewed])
@pytest.mark.parametrize("value", [0.3, 0.31, 0.36])
def test_noise_is_taken_out_at_any_departure(draw, value):
    """Departures of 0, under the noise, and far above it; two fifths are left at most."""
    rng = np.random.default_rng(3)
    found = np.array([judged(rng, draw, value)[0][0] for _ in range(12)])
    raw = judged(rng, draw, 0.3)[1].floor
    assert raw > 1
    left = abs(found.mean() - true(value))
    assert left < (0.4 if value == 0.31 else 0.25) * raw


def test_the_jackknife_tells_the_spread():
    rng = np.random.default_rng(5)
    repeats = [judged(rng, normal, 0.33)[0] for _ in range(40)]
    found = np.array([values[0] for values in repeats])
    told = [np.sqrt((REPLICATES - 1) * values[1:].var()) for values in repeats]
    assert 0.8 * found.std() < np.sqrt(np.mean(np.square(told))) < 2.5 * found.std()


def test_without_noise_errors_are_the_metrics():
    flat = np.full((REPLICATES, SIZE, SIZE, 3), 0.3)
    zero = np.zeros((SIZE, SIZE, 3))
    judge = Judge(
        Estimate(flat[0], zero, zero, REPLICATES), np.ones((SIZE, SIZE), bool), DEFAULT_VIEWING
    )
    found = Noiseless(judge, flat).errors(1.2 * flat)
    np.testing.assert_allclose(found, true(0.36), rtol=1e-6)
