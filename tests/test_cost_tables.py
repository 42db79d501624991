"""Pareto front, equal time, equal error, intervals and Shapley values, by closed forms."""

from itertools import permutations
from math import sqrt

import numpy as np
import pytest

from comparisons.cost.cost_record import Interval, Measured
from comparisons.cost.front import equal_error, equal_time, pareto
from comparisons.cost.timing import interval
from comparisons.effects import shapley
from tests.benchmarks import cost as repeats


def timed(method, spp, seconds, error, stderr=0.0, spread=0.0):
    low, high = seconds * (1 - spread), seconds * (1 + spread)
    time = Interval(seconds, low, high, low, high, 0.95, 7)
    return Measured(method, spp, seconds, 0.0, time, error, stderr, 0.0, 0.0)


NOISY = [timed("noise alone", n, 0.01 * n, 8 / sqrt(n)) for n in (1, 4, 16, 64)]
FLAT = [timed("flat", 16, 0.002, 12.0)]


def times(method, points, *errors):
    return [row for row in equal_error(points, errors) if row.method == method]


def test_the_front_is_what_nothing_beats():
    points = [
        timed("a", 1, 1.0, 5.0),
        timed("b", 1, 2.0, 5.0),  # as good as a, slower
        timed("c", 1, 3.0, 6.0),  # worse and slower
        timed("d", 1, 4.0, 1.0),
        timed("e", 1, 4.0, 2.0),  # as slow as d, worse
    ]
    assert [p.rung for p in pareto(points)] == ["a", "d"]
    assert [p.rung for p in pareto(reversed(points))] == ["a", "d"]


def test_the_front_agrees_with_its_definition_on_random_points():
    rng = np.random.default_rng(3)
    points = [timed(str(i), 1, *rng.integers(1, 8, 2).astype(float)) for i in range(60)]

    def beaten(p):
        return any(
            q.seconds.median <= p.seconds.median
            and q.error <= p.error
            and (q.seconds.median, q.error) != (p.seconds.median, p.error)
            for q in points
        )

    expected = {(p.seconds.median, p.error) for p in points if not beaten(p)}
    assert {(p.seconds.median, p.error) for p in pareto(points)} == expected


def test_the_best_within_a_time():
    rows = equal_time(NOISY + FLAT, (0.001, 0.01, 0.1, 1.0))
    assert rows[0].best is None
    assert [(row.best.rung, row.best.spp) for row in rows[1:]] == [
        ("noise alone", 1),
        ("noise alone", 4),
        ("noise alone", 64),
    ]


def test_a_time_that_gives_nothing_new_has_no_row():
    rows = equal_time(NOISY + FLAT, (1e-4, 1e-3, 0.64, 1.0, 10.0))
    assert [(row.seconds, row.best and row.best.spp) for row in rows] == [(1e-3, None), (0.64, 64)]


def test_noise_alone_reaches_an_error_on_the_slope_of_one_half():
    for row in times("noise alone", NOISY, 7.0, 3.0, 1.5, 1.0):
        assert row.seconds.value == pytest.approx(0.01 * (8 / row.error) ** 2)
        assert not row.at_most


def test_nothing_is_said_beyond_the_measured_counts():
    below, above = times("noise alone", NOISY, 0.9, 8.5)
    assert below.seconds is None
    assert above.at_most
    assert above.seconds.value == NOISY[0].seconds.median
    assert times("flat", NOISY + FLAT, 5.0)[0].seconds is None


def test_the_interval_of_a_reached_error_holds_what_times_and_errors_vary_by():
    def found(spread, stderr):
        points = [timed("noise", n, 0.01 * n, 8 / sqrt(n), stderr, spread) for n in (1, 4, 16, 64)]
        return equal_error(points, [3.0])[0].seconds

    exact, in_time, in_both = found(0.0, 0.0), found(0.1, 0.0), found(0.1, 0.1)
    assert exact.low == exact.value == exact.high
    assert (in_time.low, in_time.high) == pytest.approx((0.9 * exact.value, 1.1 * exact.value))
    assert in_both.low < in_time.low < in_time.high < in_both.high


def test_an_error_is_reached_only_where_the_measured_errors_pass_it():
    biased = [timed("biased", n, 0.01 * n, sqrt(2**2 + 64 / n)) for n in (4, 16, 64)]
    early, late = times("biased", biased, 4.0, 2.5)  # errors measured: 4.5, 2.8, 2.2
    assert 0.04 < early.seconds.value < 0.16 < late.seconds.value < 0.64
    assert times("biased", biased, 2.0)[0].seconds is None


def test_the_interval_of_a_median_holds_it_as_often_as_it_says():
    rng = np.random.default_rng(11)
    for count in (4, 7, 12):
        drawn = rng.exponential(size=(4000, count))
        found = [interval(row) for row in drawn]
        held = np.mean([i.low <= np.log(2) <= i.high for i in found])
        error = 3 * sqrt(found[0].level * (1 - found[0].level) / len(found))
        assert held == pytest.approx(found[0].level, abs=error)
        assert found[0].level >= 0.95 or count < 6


def test_quartiles_and_median_of_repeats():
    found = interval([5.0, 1.0, 2.0, 4.0, 3.0])
    assert (found.p25, found.median, found.p75) == (2.0, 3.0, 4.0)
    assert (found.low, found.high, found.level) == (1.0, 5.0, 1 - 2 / 32)


def by_definition(players, value):
    """Shapley's value as the mean gain over all orders, written out."""
    gains = {player: [] for player in players}
    for order in permutations(players):
        for place, player in enumerate(order):
            before = frozenset(order[:place])
            gains[player].append(value(before | {player}) - value(before))
    return [np.mean(gains[player], axis=0) for player in players]


def game(players, seed=5, shape=()):
    rng = np.random.default_rng(seed)
    table = {subset: rng.normal(size=shape) for subset in shapley.subsets(players)}
    return table.__getitem__


@pytest.mark.parametrize("shape", [(), (3, 4)])
def test_shares_are_the_mean_gains_over_all_orders(shape):
    players = "abcd"
    value = game(players, shape=shape)
    np.testing.assert_allclose(
        shapley.shares(players, value).values, by_definition(players, value), atol=1e-12
    )


def test_shares_add_up_exactly_and_when_sampled():
    for count in (1, 3, 6, 8):
        players = "abcdefgh"[:count]
        value = game(players, shape=(5,))
        found = shapley.shares(players, value)
        whole = value(frozenset(players)) - value(frozenset())
        np.testing.assert_allclose(sum(found.values), whole, atol=1e-12)
        assert (found.orders == 0) == (count <= shapley.EXACT_PLAYERS)


def test_sampled_shares_lie_within_their_error():
    players = "abcdefg"
    value = game(players)
    found = shapley.shares(players, value)
    expected = by_definition(players, value)
    for share, error, truth in zip(found.values, found.sampling_error, expected, strict=True):
        assert 0 < error < 1
        assert abs(share - truth) < 4 * error


def test_a_player_without_influence_gets_nothing_and_equals_share_alike():
    def value(subset):
        return 6.0 if {"a", "b"} <= subset else 0.0

    assert shapley.shares("abc", value).values == pytest.approx((3.0, 3.0, 0.0))


def test_no_effects_no_shares():
    assert shapley.shares((), lambda subset: 1.0).values == ()


def test_fewer_orders_than_asked_for_by_default_still_add_up():
    players = "abcde"
    value = game(players, shape=(3,))
    found = shapley.shares(players, value, exact_players=4, orders=4)
    whole = value(frozenset(players)) - value(frozenset())
    np.testing.assert_allclose(sum(found.values), whole, atol=1e-12)
    assert found.orders == 4
    assert all(error > 0 for error in found.sampling_error)


def test_the_benchmark_of_repeats_sees_a_pair_that_changes_places_and_no_other():
    def run(**spans):
        return {
            name: {"seconds": {"low": low, "high": high}} for name, (low, high) in spans.items()
        }

    first = run(a=(1, 2), b=(3, 4), c=(3.5, 5))
    assert repeats.reordered(first, first, repeats.times) == []
    swapped = run(a=(5, 6), b=(3, 4), c=(1, 2))
    assert repeats.reordered(first, swapped, repeats.times) == [("a", "b"), ("a", "c")]
    overlapping = run(a=(3, 4), b=(3, 4), c=(3, 4))
    assert repeats.reordered(first, overlapping, repeats.times) == []
