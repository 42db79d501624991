"""What a check calls moved: false alarms at the stated rate, and values of the statistic.

Passes are drawn here, by NumPy, so that hundreds of checks take a second. Alarms are counted
against bounds that a right statistic leaves once in a thousand runs.
"""

import numpy as np
import pytest
from msgspec import structs
from scipy import stats

from fotismos.comparisons.check import measurement as measuring
from fotismos.comparisons.check import moved as moving
from fotismos.comparisons.check.measurement import measurement
from fotismos.comparisons.departure.metrics import METRICS, RATIO
from fotismos.comparisons.records.check import Block, Half, Measurement, MetricAmount
from fotismos.comparisons.records.departure import DEFAULT_VIEWING

PASSES = 16


def half(mean, error):
    """Colours (51,) of a half: the whole image's, then those of 4 by 4 blocks."""
    rows = np.stack([mean, error])[:, 3:].reshape(2, 4, 4, 3)
    blocks = [[Block(mean=tuple(m), error=tuple(e)) for m, e in zip(*row, strict=True)]
              for row in zip(*rows.tolist(), strict=True)]  # fmt: skip
    return Half(mean=tuple(mean[:3]), error=tuple(error[:3]), blocks=tuple(map(tuple, blocks)))


def measured(passes):
    """A measurement of drawn passes (n, 102), as if they were colours; metrics are 0."""
    mean, error = passes.mean(axis=0), passes.std(axis=0, ddof=1) / np.sqrt(len(passes))
    halves = [half(*one) for one in zip(mean.reshape(2, 51), error.reshape(2, 51), strict=True)]
    nothing = MetricAmount(value=0.0, error=0.0, noise_floor=0.0)
    metrics = dict.fromkeys((*METRICS, RATIO.name), nothing)
    colours = dict(zip(measuring.HALVES, halves, strict=True))
    return Measurement(passes=len(passes), metrics=metrics, **colours)


def normal(rng):
    return 1 + 0.01 * rng.normal(size=(PASSES, 102))


def fireflies(rng):
    """One sample in fifty is a hundred times as bright as the others."""
    return 1 + 0.01 * rng.normal(size=(PASSES, 102)) + (rng.random((PASSES, 102)) < 0.02)


def skewed(rng):
    return rng.lognormal(sigma=1.0, size=(PASSES, 102))


def alarms(draw, checks, level):
    """Count the checks that alarm though both sides are drawn alike."""
    rng = np.random.default_rng(11)
    return sum(
        bool(moving.moved(moving.differences(measured(draw(rng)), measured(draw(rng))), level))
        for _ in range(checks)
    )


def bounds(checks, level):
    return stats.binom.interval(0.999, checks, level)


# --- False alarms ----------------------------------------------------------------------------


def test_normal_noise_alarms_at_the_stated_rate():
    level = 0.2
    least, most = bounds(400, level * 102 / (103 + len(METRICS)))
    assert least <= alarms(normal, 400, level) <= most


@pytest.mark.guarantee("checks", "Heavy-tailed noise raises alarms no more often than stated.")
@pytest.mark.parametrize("draw", [fireflies, skewed])
def test_noise_of_heavy_tails_alarms_no_more_than_stated(draw):
    assert alarms(draw, 500, 0.05) <= bounds(500, 0.05)[1]


def test_shared_significance_is_that_of_all_checks():
    level = moving.level_of_each(0.01, 27)
    assert 1 - (1 - level) ** 27 == pytest.approx(0.01)


# --- Values ----------------------------------------------------------------------------------


def test_the_p_value_is_scipys_of_welchs_test():
    rng = np.random.default_rng(3)
    sides = normal(rng), 1.002 + 0.03 * rng.normal(size=(PASSES, 102))
    moves = moving.differences(*map(measured, sides))[len(METRICS) + 1 :]
    expected = stats.ttest_ind(sides[1], sides[0], equal_var=False)
    names = [move.quantity for move in moves]
    assert names[:4] == ["heuristic R", "heuristic G", "heuristic B", "reference R"]
    order = np.r_[0:3, 51:54, 3:51, 54:102]
    np.testing.assert_allclose([m.p for m in moves], expected.pvalue[order], rtol=1e-9)
    t = [m.standard_errors for m in moves]
    np.testing.assert_allclose(t, expected.statistic[order], rtol=1e-9)
    corrected = [m.p_corrected for m in moves]
    np.testing.assert_allclose(
        corrected, 1 - (1 - expected.pvalue[order]) ** (103 + len(METRICS)), rtol=1e-6
    )


def exact(value):
    return measured(np.full((PASSES, 102), value))


@pytest.mark.parametrize(("after", "moves"), [(1.0, 0), (1 + 9e-6, 0), (1 + 2e-5, 102)])
def test_without_noise_what_exceeds_rounding_moved(after, moves):
    found = moving.moved(moving.differences(exact(1.0), exact(after)))
    assert len(found) == moves
    assert all(move.p == 0 and move.standard_errors is None for move in found)


def test_the_surest_of_the_widest_comes_first():
    before = exact(1.0)
    mean = np.ones(51)
    mean[[1, 3 + 3 * (1 * 4 + 2)]] = 1.1, 1.5  # green, and red of block 2,3
    rmse = MetricAmount(value=0.1, error=0.0, noise_floor=0.0)
    after = structs.replace(before, reference=half(mean, np.zeros(51)),
                            metrics=before.metrics | {"rmse": rmse})  # fmt: skip
    names = [move.quantity for move in moving.moved(moving.differences(before, after))]
    assert names == ["rmse", "reference G", "reference R, block 2,3"]


# --- Measurement -----------------------------------------------------------------------------


@pytest.mark.thorough
def test_jackknife_errors_are_those_of_metrics_drawn_again():
    """The spread of a metric over independent measurements is the error that each reports."""
    rng = np.random.default_rng(6)
    truth = rng.uniform(0.2, 0.6, (2, 8, 8, 3))
    counted = np.ones((8, 8), bool)
    drawn = [
        measurement(truth + 0.05 * rng.normal(size=(8, *truth.shape)), counted, DEFAULT_VIEWING)
        for _ in range(30)
    ]
    for name in (*METRICS, RATIO.name):
        values = [one.metrics[name].value for one in drawn]
        errors = [one.metrics[name].error for one in drawn]
        # 30 draws know their own spread to 13 %.
        assert np.std(values, ddof=1) == pytest.approx(np.sqrt(np.mean(np.square(errors))), rel=0.4)


def test_metrics_are_those_of_the_mean_image_over_counted_pixels():
    rng = np.random.default_rng(7)
    images = rng.uniform(0.1, 0.9, (4, 2, 10, 12, 3))
    counted = rng.random((10, 12)) < 0.5
    found = measurement(images, counted, DEFAULT_VIEWING)
    test, reference = images.mean(axis=0)[:, counted]
    assert found.metrics["rmse"].value == pytest.approx(np.sqrt(np.mean((test - reference) ** 2)))
