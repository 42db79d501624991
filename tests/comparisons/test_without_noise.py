"""Means without noise: their bias, how often their intervals hold the truth, and what is said."""

import numpy as np
import pytest

from fotismos.comparisons.departure import criterion, statistics
from fotismos.comparisons.departure.estimate import Replicates, estimate
from fotismos.comparisons.departure.metrics import LEADING, METRICS
from fotismos.comparisons.records.departure import VisibleShare
from fotismos.heuristic.errors import InputError
from fotismos.reference.records import Interval
from fotismos.reference.rendering import sums
from tests.shared import noisy

GREY = np.full((32, 32, 3), 0.2)


def summary(test, passes, metric=LEADING, counted=None):
    """Summarise a test image against passes (n, H, W, 3) of a reference."""
    counted = np.ones(test.shape[:2], bool) if counted is None else counted
    found = noisy.estimate(test - passes, counted)
    return statistics.summarise(
        metric, test, test - found.mean, counted, noise=found.noise, grouped=found.grouped
    )[0]


def passes_of(truth, count, spread, rng):
    """Return skewed passes of a reference: lognormal, of one relative deviation in a mean."""
    sigma = np.sqrt(np.log1p(spread**2 * count))
    factors = np.exp(sigma * rng.normal(size=(count, *truth.shape[:2], 1)) - sigma**2 / 2)
    return truth * factors


def without_noise(test, passes):
    """Return the mean as it is and the debiased one, with its interval."""
    found = noisy.estimate(test - passes)
    raw = LEADING(test, test - found.mean).ravel()
    return raw.mean(), estimate(LEADING, Replicates.of(test, found.grouped), measured=raw)


@pytest.mark.guarantee("means", "Intervals of mean ΔE2000 contain the truth at 0, 1 and 5.")
@pytest.mark.parametrize("count", [4, 16])
@pytest.mark.parametrize(("factor", "about"), [(1.0, 0), (1.045, 1), (1.245, 5)])
def test_the_mean_without_noise_has_little_bias_and_an_honest_interval(rgb, factor, about, count):
    """Noise alone gives a mean of 1.2 or so. Intervals of 95 % hold the truth 16 times of 20.

    They would fail to do so once in 3,000 times.
    """
    rng = np.random.default_rng(count)
    test = factor * GREY
    true = LEADING(test, GREY).mean()
    assert true == pytest.approx(about, abs=0.3)
    results = [without_noise(test, passes_of(GREY, count, 0.07, rng)) for _ in range(20)]
    assert sum(one.mean.low <= true <= one.mean.high for _, one in results) >= 16
    raw = np.mean([raw for raw, _ in results]) - true
    clean = np.mean([one.mean.value for _, one in results]) - true
    assert abs(clean) < 0.4 * abs(raw) + 0.06
    if not about:
        assert raw > 1.0
        assert np.mean([one.mean.high for _, one in results]) < raw


@pytest.mark.guarantee(
    "means", "Intervals of the visible share contain the truth, in skewed noise too."
)
@pytest.mark.parametrize("kind", ["lognormal", "poisson", "rare"])
def test_shares_of_visible_pixels_are_within_their_intervals(rgb, kind):
    """Intervals of 95 %, over thresholds that noise leaves any doubt about.

    Departures are even, a ramp, in patches on a twentieth of the image, or in single pixels.
    """
    rng = np.random.default_rng(3)
    truth, size = noisy.truth(), (noisy.SIZE, noisy.SIZE, 1)
    patches = (rng.random((5, 5)) < 0.08).repeat(8, 0).repeat(8, 1)[..., None]
    factors = (
        np.ones(size),
        np.linspace(1.0, 1.3, noisy.SIZE)[:, None, None],
        np.where(patches, 1.2, 1.01),
        np.where(rng.random(size) < 0.05, 1.25, 1.01),
        np.exp(0.06 * rng.normal(size=size)),
    )
    inside = []
    for factor in factors:
        departures = LEADING(truth * factor, truth)
        for count in (4, 8) * 3:
            spread = noisy.skewed(kind, count, 256, rng) - 1.0
            passes = truth * (1.0 + 0.05 * np.sqrt(count) * spread / spread.std())
            _, found = without_noise(truth * factor, passes)
            inside += [
                share.low <= (departures > share.threshold).mean() <= share.high
                for share in found.visible
                if share.low < share.high
            ]
    assert np.mean(inside) >= 0.93


@pytest.mark.guarantee("means", "A brightness error of a tenth does not pass as noise.")
@pytest.mark.parametrize("spread", [0.3, 0.45])
def test_a_tenth_more_brightness_is_no_noise_on_a_plain_grey(rgb, spread):
    """The mean is at its floor, up to 1.1 times, which says nothing: noise hides the departure."""
    grey = np.full((96, 96, 3), 0.2)
    noise = 4 * spread * np.random.default_rng(4).normal(size=(16, 96, 96, 1))
    found = summary(1.1 * grey, grey * (1 + noise))
    assert found.mean < 1.1 * found.noise_floor
    assert found.high > LEADING(1.1 * grey, grey).mean()


def test_without_noise_the_mean_is_its_own_interval(rgb):
    found = summary(1.2 * GREY, np.stack([GREY] * 4))
    assert found.low == found.debiased == found.high == found.mean > 1
    assert all(share.low == share.value == share.high for share in found.visible)
    assert found.visible[4].value == 1
    empty = summary(1.2 * GREY, np.stack([GREY] * 4), counted=np.zeros((32, 32), bool))
    assert empty.low == empty.high == 0


def test_the_interval_of_the_share_decides():
    for low, high, verdict in (
        (0.0, 0.05, "pass"), (0.04, 0.0501, "undecided"), (0.05, 0.9, "undecided"),
        (0.051, 1, "fail"),
    ):  # fmt: skip
        shares = [VisibleShare(threshold=t, value=low, low=low, high=high) for t in (2.0, 2.25)]
        assert criterion.decide(shares) == criterion.decide(shares, 2.25) == verdict


def test_only_thresholds_with_recorded_shares_are_allowed():
    assert criterion.checked_threshold(2.25) == 2.25
    for threshold in (0.75, 2.1, 10.25, np.nan):
        with pytest.raises(InputError, match=r"give 1 to 10 in steps of 0\.25, such as 2"):
            criterion.checked_threshold(threshold)
    with pytest.raises(InputError, match=r"give one of none"):
        criterion.decide((), 2.0)


# --- By closed forms ------------------------------------------------------------------------------


def test_the_jackknife_of_a_mean_is_its_standard_error():
    values = np.random.default_rng(2).normal(size=(9, 3))
    left_out = [np.delete(values, place, axis=0).mean(axis=0) for place in range(9)]
    expected = values.std(axis=0, ddof=1) / 3
    np.testing.assert_allclose(sums.jackknife_error(left_out), expected, rtol=1e-12)


def test_the_interval_of_a_mean_is_that_of_students_table():
    error = np.std([1, 2, 3, 4], ddof=1) / 2
    found, half = sums.student(2.5, error, 4), 3.182446 * error  # t(0.975, 3) = 3.182446
    assert (found.value, found.low) == (2.5, pytest.approx(2.5 - half, rel=1e-6))
    assert found.high - 2.5 == pytest.approx(2.5 - found.low, rel=1e-12)
    assert sums.student(0.25, 0.0, 16) == Interval(value=0.25, low=0.25, high=0.25)


@pytest.mark.parametrize("name", ["rmse", "relmse", "smape", "srgb_rmse"])
def test_errors_of_the_literature_lose_their_noise(name):
    """By skewed noise of up to 30 %, of images that are equal, alike or apart."""
    rng = np.random.default_rng(6)
    metric = METRICS[name]
    held = []
    for spread in (0.02, 0.1, 0.3):
        for apart in (0.0, 0.1, 0.5):
            left = []
            for _ in range(12):
                truth = rng.lognormal(-1.5, 1, 3) * rng.lognormal(0, 0.3, (32, 32, 3))
                test = truth * (1 + apart * rng.normal(size=truth.shape))
                found = summary(test, passes_of(truth, 16, spread, rng), metric)
                expected = metric.mean(metric(test, truth))
                held.append(found.low - 1e-12 <= expected <= found.high + 1e-12)
                left.append((found.debiased - expected) / found.noise_floor)
            assert abs(np.mean(left)) < 0.6, (spread, apart)
    assert np.mean(held) > 0.9
