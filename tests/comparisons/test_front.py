"""Fronts and choices on made-up numbers."""

import numpy as np

from fotismos.comparisons.ladder.front import beats, cheapest, fronted
from fotismos.comparisons.records.cost import Point
from fotismos.reference.records import Interval

# -- Fronts and choices ----------------------------------------------------------------------------


def about(value, share=0.0, kind=Interval):
    return kind(value=value, low=value * (1 - share), high=value * (1 + share))


def made(method, spp, seconds, error, spread=0.0):
    return Point(
        method=method,
        spp=spp,
        seconds=about(float(seconds), spread),
        error=about(float(error), spread, Interval),
        tolerance=about(3.0 * error, spread, Interval),
    )


def test_the_front_of_exact_points_is_what_nothing_is_as_good_as():
    rng = np.random.default_rng(3)
    for _ in range(100):
        # Few values, so that times, errors and the tolerance itself are often equal.
        values = rng.integers(1, 5, (rng.integers(1, 9), 2)) / 2
        points = [made(str(number), 1, *each) for number, each in enumerate(values)]
        for one, own in zip(fronted(points), values, strict=True):
            is_beaten = ((values <= own).all(axis=1) & (values < own).any(axis=1)).any()
            assert one.front == (not is_beaten)


def test_what_is_too_close_to_call_is_not_ranked():
    amounts = {"slow": (1.04, 2.0), "fast": (1.0, 2.02), "exact": (5.0, 0.1), "bad": (1.5, 2.0)}
    found = fronted([made(name, 4, *each, 0.05) for name, each in amounts.items()])
    assert [one.front for one in found] == [True, True, True, False]
    assert [one.ties for one in found[:3]] == [("fast",), ("slow",), ()]
    for seed in range(50):
        rng = np.random.default_rng(seed)
        points = [made(str(n), 1, *rng.uniform(1, 2, 2), rng.uniform(0, 0.3)) for n in range(8)]
        assert any(one.front for one in fronted(points))
        assert not any(beats(a, b) and beats(b, a) for a in points for b in points)


def test_the_fastest_that_surely_passes_is_chosen():
    points = [
        made("kernel", 4, 0.01, 2.0, 0.1),  # passes at 6.6
        made("direct", 4, 0.1, 0.6, 0.1),  # at 1.98
        made("path", 4, 0.11, 0.5, 0.1),  # too close to call, and more accurate
        made("plan", 16, 1.0, 0.1, 0.1),
    ]
    assert cheapest(points, 7.0).method == "kernel"
    found = cheapest(points, 6.5)  # the kernel's 6 may be 6.6
    assert (found.method, found.ties) == ("path", ("direct",))
    assert cheapest(points, 1.0).method == "plan"
    assert cheapest(points, 0.1) is None
