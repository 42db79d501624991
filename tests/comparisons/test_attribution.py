"""Attribution on numbers: Shapley values, errors without noise, and dominating effects."""

from itertools import combinations
from math import comb

import numpy as np
import pytest

from fotismos.comparisons.attribution import (
    LEAST,
    NONE,
    UNCOUNTED,
    ErrorMeter,
    dominating,
    in_words,
    shares,
)
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.records.departure import DEFAULT_VIEWING

# -- Shapley values --------------------------------------------------------------------------------


def by_definition(players, value):
    """Shapley's value as the sum over all subsets without a player."""
    found, last = [], len(players) - 1
    for player in players:
        without = [each for each in subsets(players) if player not in each]
        gains = [value(each | {player}) - value(each) for each in without]
        weights = [1 / (len(players) * comb(last, len(each))) for each in without]
        found.append(np.tensordot(weights, gains, 1))
    return found


def subsets(players):
    sizes = range(len(players) + 1)
    return [frozenset(chosen) for size in sizes for chosen in combinations(players, size)]


def game(players, shape=()):
    rng = np.random.default_rng(5)
    return {subset: rng.normal(size=shape) for subset in subsets(players)}.__getitem__


def of(players, value, exact=6, orders=48):
    return shares(players, value, 0, exact, orders)


def test_shares_are_the_mean_gains_over_all_orders():
    for shape in ((), (3, 4)):
        value = game("abcd", shape)
        found, errors, orders = of("abcd", value)
        np.testing.assert_allclose(found, by_definition("abcd", value), atol=1e-12)
        assert (errors, orders) == ((0.0,) * 4, 0)


def test_drawn_shares_lie_within_their_error_and_add_up():
    players = "abcdefg"
    value = game(players)
    found, errors, drawn = of(players, value, orders=48)
    assert drawn == 48
    whole = value(frozenset(players)) - value(frozenset())
    assert sum(found) == pytest.approx(whole)
    assert min(errors) > 0
    missed = np.abs(np.subtract(found, by_definition(players, value)))
    assert (missed < 4 * np.array(errors)).all()


# -- Errors without noise --------------------------------------------------------------------------

SIZE, REPLICATES, NOISE = 20, 8, 0.05
"""Noise of one replicate, linear, on a grey of 0.3: ΔE2000 of some 4."""

DRAWN = {
    "normal": lambda rng, shape: rng.normal(size=shape),
    "skewed": lambda rng, shape: rng.exponential(size=shape) - 1,
}


def without_noise(rng, draw, value):
    """Return errors (R + 1,) of images of a value, against a noisy reference of 0.3."""

    def noisy(value):
        noise = draw(rng, (REPLICATES, SIZE, SIZE, 1))
        return np.broadcast_to(value, (SIZE, SIZE, 3)) + NOISE * noise * np.ones(3)

    groups = noisy(0.3)
    mean, error = groups.mean(axis=0), groups.std(axis=0, ddof=1) / np.sqrt(REPLICATES)
    floor = LEADING(mean, mean + error, DEFAULT_VIEWING).mean()
    meter = ErrorMeter(groups, np.ones((SIZE, SIZE), bool), DEFAULT_VIEWING)
    return meter.without_noise(noisy(value)).mean(axis=1), floor


def true(value):
    pixel = LEADING(np.full((1, 1, 3), value), np.full((1, 1, 3), 0.3), DEFAULT_VIEWING)
    return float(pixel[0, 0])


@pytest.mark.guarantee(
    "attribution", "Attributed errors exclude noise; near its size, two fifths of it may remain."
)
@pytest.mark.parametrize("draw", DRAWN.values(), ids=DRAWN)
def test_noise_is_taken_out_at_any_departure(draw):
    """Departures of 0, under the noise, and far above it; two fifths are left at most."""
    rng = np.random.default_rng(3)
    for value, share in ((0.3, 0.25), (0.31, 0.4), (0.36, 0.25)):
        found = [without_noise(rng, draw, value) for _ in range(12)]
        floor = found[0][1]
        assert floor > 1
        left = abs(np.mean([errors[0] for errors, _ in found]) - true(value))
        assert left < share * floor, value


def test_random_numbers_in_common_leave_no_noise():
    """Two images of paths that are alike differ by what the paths do not share: here, nothing."""
    rng = np.random.default_rng(3)
    paths = 0.3 + NOISE * rng.normal(size=(REPLICATES, SIZE, SIZE, 3))
    meter = ErrorMeter(paths, np.ones((SIZE, SIZE), bool), DEFAULT_VIEWING)
    assert (meter.without_noise(paths) == 0).all()
    brighter = meter.without_noise(1.2 * paths).mean(axis=1)
    expected = LEADING(*(np.full((1, 1, 3), value) for value in (0.36, 0.3)), DEFAULT_VIEWING)
    assert brighter[0] == pytest.approx(expected.item(), rel=0.02)


def test_without_noise_errors_are_the_metrics():
    found, floor = without_noise(np.random.default_rng(1), lambda rng, shape: np.zeros(shape), 0.36)
    np.testing.assert_allclose(found, true(0.36), rtol=1e-6)
    assert floor == 0


# -- Dominating effects ----------------------------------------------------------------------------

ALL = np.ones((4, 6), bool)


def maps(**values):
    return {name: np.full((4, 6), value, float) for name, value in values.items()}


def test_the_largest_dominates_where_it_can_be_seen():
    effects = maps(shadow=2.0, gloss=1.5)
    effects["gloss"][:, 3:] = 3.0
    effects["shadow"][0] = effects["gloss"][0] = LEAST / 2
    counted = ALL.copy()
    counted[3] = False
    found = dominating(effects, counted)
    assert (found[0] == NONE).all()
    assert (found[1:3] == [0, 0, 0, 1, 1, 1]).all()
    assert (found[3] == UNCOUNTED).all()
    assert (dominating(maps(shadow=-9.0, gloss=1.1), ALL) == 1).all()
    assert (dominating({}, ALL) == NONE).all()


def test_a_second_effect_is_named_where_it_removes_half_as_much():
    for values, expected in (
        ({"a": 4.0, "b": 2.0, "c": 1.0}, "a, then b"),
        ({"a": 4.0, "b": 1.9}, "a"),
        ({"a": 1.2, "b": 0.9}, "a"),  # what cannot be seen is not named
        ({"a": 0.9}, None),
        ({}, None),
    ):
        assert in_words(values) == expected
