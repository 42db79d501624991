"""Means and shares in any noise: intervals hold, verdicts are right, and nothing contradicts."""

import numpy as np
import pytest

from fotismos.comparisons.departure.criterion import LIMIT, decide, share_above
from fotismos.comparisons.departure.estimate import Replicates, estimate
from fotismos.comparisons.departure.metrics import LEADING, METRICS, Pixelwise
from tests.shared.noisy_pairs import COUNTS, KINDS, SHARES, pair


def drawn(kind, count, share, number):
    """Return an estimate of a pair, and the true distances."""
    seed = [KINDS.index(kind), count, int(1000 * share), number]
    replicates, distances = pair(kind, count, share, np.random.default_rng(seed))
    return estimate(LEADING, replicates), distances


@pytest.mark.parametrize("kind", KINDS)
def test_mean_and_shares_of_a_record_never_contradict_each_other(kind):
    """The mean of a distance is the integral of the shares above it."""
    thresholds = np.array(LEADING.visible)
    for count in COUNTS[:3]:
        for share in SHARES:
            found, _ = drawn(kind, count, share, 0)
            ends = np.array([(one.low, one.value, one.high) for one in found.visible]).T
            assert (np.diff(ends, axis=1) <= 1e-12).all()  # never rising
            assert (np.diff(ends, axis=0) >= -1e-12).all()  # low <= value <= high
            assert 0 <= found.mean.low <= found.mean.value <= found.mean.high
            least = ends[0] @ np.diff(thresholds, prepend=0.0)
            assert found.mean.low >= least - 1e-9
            assert (ends[0] * thresholds <= found.mean.high + 1e-9).all()


@pytest.mark.guarantee(
    "means", "Intervals of mean and share hold the truth in sixteen kinds of noise."
)
def test_intervals_hold_and_verdicts_are_right_in_all_noise():
    """At most one of 40 is decided wrongly; intervals of 95 % hold in at least 93 %."""
    means, shares, wrong = [], [], []
    for kind in KINDS:
        for count in COUNTS[:3]:
            for share in SHARES:
                found, distances = drawn(kind, count, share, 1)
                true = float((distances > 2).mean())
                means.append(found.mean.low - 1e-4 <= distances.mean() <= found.mean.high + 1e-4)
                of_two = share_above(found.visible, 2.0)
                shares.append(of_two.low - 1e-9 <= true <= of_two.high + 1e-9)
                wrong.append(decide(found.visible) == ("fail" if true <= LIMIT else "pass"))
    assert np.mean(means) >= 0.93
    assert np.mean(shares) >= 0.93
    assert np.mean(wrong) <= 0.025


def test_what_is_plain_is_decided():
    """Grey noise of little size: a difference in a third of the pixels fails, none passes."""
    for number in range(6):
        found, distances = drawn("equal", 4, 0.3, number)
        assert decide(found.visible) == ("fail" if (distances > 2).mean() > LIMIT else "pass")
        found, _ = drawn("equal", 4, 0.0, number)
        assert decide(found.visible) == "pass"


PIXELWISE = [name for name in METRICS if isinstance(METRICS[name], Pixelwise)]


@pytest.mark.parametrize("name", PIXELWISE)
def test_a_large_picture_is_estimated_from_some_of_its_blocks(name):
    """A third of it is brighter: the intervals hold what that is."""
    metric = METRICS[name]
    side = 192
    random = np.random.default_rng(3)
    truth = random.uniform(0.2, 0.6, (8, side, side, 3)).mean(axis=0)
    shown = truth * np.where(np.arange(side) < side / 3, 1.5, 1.0)[None, :, None]
    passes = truth + 0.01 * random.normal(size=(8, *truth.shape))
    replicates = Replicates.of_images(shown, passes, np.ones((side, side), bool))
    assert 0 < replicates.sampled < 1
    measured = metric(shown, passes.mean(axis=0)).ravel()
    found = estimate(metric, replicates, measured=measured)
    distances = metric(shown, truth)
    assert found.mean.low <= found.mean.value <= found.mean.high
    if not metric.averages_squares:
        assert found.mean.low <= distances.mean() <= found.mean.high
    for share in found.visible:
        assert share.low <= (distances > share.threshold).mean() <= share.high
