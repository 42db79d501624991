"""What a check calls moved, and how: false alarms at the stated rate, and what is said of a change.

Passes are drawn here, by NumPy, so that hundreds of checks take a second. Alarms are counted
against bounds that a right statistic leaves once in a thousand runs.
"""

import re

import numpy as np
import pytest
from scipy import stats

from fotismos.comparisons.check.measured import Measured, picture
from fotismos.comparisons.check.moved import check
from fotismos.comparisons.departure.drift import Run, blocks, drift, whole
from fotismos.comparisons.pictures import Pictures
from fotismos.comparisons.records.check import HALVES
from fotismos.reference.rendering.gbuffer import ObjectIds

SHAPE = (32, 48, 3)
PARTS = (whole(SHAPE), blocks(SHAPE))


def normal(rng, image):
    return image * (1 + 0.05 * rng.normal(size=(8, *SHAPE)))


def fireflies(rng, image):
    """One sample in a thousand is a hundred times as bright as the others."""
    return normal(rng, image) + 100 * (rng.random((8, *SHAPE)) < 1e-3)


def skewed(rng, image):
    return image * rng.lognormal(mean=-0.5, sigma=1.0, size=(8, *SHAPE))


# --- False alarms ----------------------------------------------------------------------------


@pytest.mark.guarantee("checks", "Heavy-tailed noise raises alarms no more often than stated.")
@pytest.mark.parametrize("noise", [normal, fireflies, skewed])
@pytest.mark.parametrize("are_paired", [False, True])
def test_unchanged_passes_alarm_no_more_often_than_stated(noise, are_paired):
    """Pairs share nine tenths of their noise, as other versions of a sampler may."""
    rng = np.random.default_rng(11)
    level = 0.1
    alarms = 0
    for _ in range(120):
        first, second = noise(rng, 0.5), noise(rng, 0.5)
        if are_paired:
            second = 0.9 * first + 0.1 * second
        runs = Run.of(first), Run.of(second)
        alarms += any(drift(*runs, parts).moved(level / 2).any() for parts in PARTS)
    assert alarms <= stats.binom.ppf(0.999, 120, level)


# --- The statistic ---------------------------------------------------------------------------


@pytest.mark.parametrize(("after", "moves"), [(1.0, 0), (1 + 9e-6, 0), (1 + 2e-5, 7)])
def test_without_noise_what_exceeds_rounding_moved(after, moves):
    sides = [picture(Pictures.of("p", [np.full(SHAPE, value)] * 8)) for value in (1.0, after)]
    found = check(sides[0].halves, sides[1]).moves
    assert len(found) == 3 * moves
    assert all(move.p == 0 and move.standard_errors is None for move in found)


def test_errors_by_images_and_pairs_are_those_of_scipy():
    rng = np.random.default_rng(5)
    first, second = rng.normal(1, 0.1, (2, 8, *SHAPE))
    found = drift(Run.of(first), Run.of(second), blocks(SHAPE))
    part = blocks(SHAPE) == 4
    ours, theirs = (side[:, part].mean(axis=1)[:, 1] for side in (first, second))
    welch = stats.ttest_ind(theirs, ours, equal_var=False)
    paired = stats.ttest_rel(theirs, ours)
    for way, known in ((1, welch), (2, paired)):
        t = (found.after - found.before)[4, 1] / found.errors[way, 4, 1]
        assert t == pytest.approx(known.statistic, rel=1e-6)
        assert found.freedom[way, 4, 1] == pytest.approx(known.df, rel=1e-6)


def test_common_random_numbers_show_a_change_far_below_the_noise():
    rng = np.random.default_rng(6)
    passes = normal(rng, 0.5)
    changed = passes.copy()
    changed[:, :8, :8] *= 1.001
    found = drift(Run.of(passes), Run.of(changed), blocks(SHAPE))
    assert found.moved(0.01).any(axis=1).tolist() == [True, *[False] * 5]
    assert (found.limit(0.01)[0] > 10 * np.abs(found.after - found.before)[0]).all()


# --- In words --------------------------------------------------------------------------------


def changed(heuristic=lambda image: image, reference=lambda image: image):
    """Return a check of halves that were changed by functions of passes (8, H, W, 3)."""
    rng = np.random.default_rng(0)
    places = np.repeat([[0] * 24 + [2] * 24], SHAPE[0], axis=0)
    before = [normal(rng, rng.uniform(0.3, 0.7, SHAPE)) for _ in HALVES]
    after = [
        change(passes.copy()) for change, passes in zip((heuristic, reference), before, strict=True)
    ]
    sides = [
        Measured(
            halves={name: Pictures.of(name, half) for name, half in zip(HALVES, side, strict=True)},
            counted=np.ones(SHAPE[:2], bool),
            shapes=ObjectIds(places, ("matte", "hidden", "wall")),
        )
        for side in (before, after)
    ]
    return check(sides[0].halves, sides[1])


def less_red(passes):
    passes[:, :, :24, 0] *= 0.943
    return passes


def brighter_block(passes):
    passes[:, 16:32, 16:32] *= 1.5
    return passes


@pytest.mark.parametrize(
    ("changes", "headline", "causes"),
    [
        ({}, "", ""),
        (
            {"heuristic": less_red, "reference": less_red},
            "`matte`: red -5.7 % in both halves",
            "Both halves moved: look at what",
        ),
        (
            {"reference": less_red},
            "`matte`: red -5.7 % in the physical half",
            "Only the physical half moved: .* in 4 of 6 blocks, most in row ., column 1,",
        ),
        (
            {"heuristic": lambda passes: 1.3 * passes},
            "whole picture: light +30 % in the textbook half",
            "The textbook half moved by a constant factor of 1.3.* Nothing else moved",
        ),
        (
            {"heuristic": less_red, "reference": lambda passes: passes + 0.1},
            "`matte`: red -5.7 % in the textbook half, light +20 % in the physical half",
            "The physical half moved by .*constant offset of 0.1",
        ),
    ],
)
def test_a_change_is_told_by_shape_colour_size_and_half(changes, headline, causes):
    found = changed(**changes)
    assert found.headline() == headline
    assert re.search(causes, " ".join(found.causes()))


def test_moves_are_listed_by_shape_then_block_and_the_largest_first():
    found = changed(reference=brighter_block)
    kinds = ["shape" if m.shape else "block" if m.block else "whole" for m in found.moves]
    assert kinds == sorted(kinds, key=["shape", "block", "whole"].index)
    assert {"shape", "block", "whole"} == set(kinds)
    sizes = [abs(m.after - m.before) for m in found.moves if m.block]
    assert sizes == sorted(sizes, reverse=True)
    assert next(m for m in found.moves if m.block).block == (2, 2)
    assert found.tested == 2 * 3 * (1 + 6 + 2)
    error = found.halves[1].error
    assert (error[16:32, 16:32] > 1).all(), "what moved is shown"
    brighter = changed(reference=lambda passes: 1.1 * passes)
    assert [m.block or m.shape for m in brighter.moves[:3]] == [None] * 3, "as in the headline"
