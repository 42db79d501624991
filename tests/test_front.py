"""Measured and predicted points on numbers: fronts, intervals, choices and extrapolations."""

from math import erf, exp, pi, sqrt

import numpy as np
import pytest
from msgspec import convert, structs

from comparisons.cost.cost_record import Forecast, Measured, Method, Seconds
from comparisons.cost.front import Choice, cheapest, equal_error, pareto
from comparisons.cost.measure import Effort, median
from comparisons.cost.predict import (
    FITTED_SPP,
    LEVEL,
    predicted,
    require,
    sizes,
)
from comparisons.cost.predict import cheapest as predicted_cheapest
from comparisons.hybrids.attribution import MeanError
from heuristic.errors import InputError
from reports.terminal import cost_tables
from tests import cost_records
from tests.benchmarks.choice import searched


def timed(method, spp, seconds, error, stderr=0.0, spread=0.0):
    seconds, error = float(seconds), float(error)
    point = convert(cost_records.point(method, spp, seconds, error, False), Measured)
    return structs.replace(
        point,
        seconds=Seconds(seconds, seconds * (1 - spread), seconds * (1 + spread)),
        error=MeanError(error, error - 2 * stderr, error + 2 * stderr),
    )


NOISY = [timed("noise alone", n, 0.01 * n, 8 / sqrt(n)) for n in (1, 4, 16, 64)]
FLAT = [timed("flat", 16, 0.002, 12.0)]


def times(method, points, *errors):
    return [row for row in equal_error(points, errors) if row.method == method]


def test_front_and_cheapest_agree_with_their_definitions_on_random_points():
    rng = np.random.default_rng(3)
    seen = set()
    for _ in range(100):
        # Few values, so that times, errors and the tolerance itself are often equal.
        points = [timed(str(i), 1, *rng.integers(1, 5, 2) / 2) for i in range(rng.integers(1, 9))]

        def beaten(p, points=points):
            return any(
                q.seconds.value <= p.seconds.value
                and q.error.mean <= p.error.mean
                and (q.seconds.value, q.error.mean) != (p.seconds.value, p.error.mean)
                for q in points
            )

        expected = {(p.seconds.value, p.error.mean) for p in points if not beaten(p)}
        assert {(p.seconds.value, p.error.mean) for p in pareto(points)} == expected
        within = float(rng.integers(1, 5)) / 2
        assert cheapest(points, within) == searched(points, within)
        seen.add(cheapest(points, within))
    assert None in seen
    assert len(seen) > 5


def test_an_error_is_reached_on_the_slope_of_one_half_within_the_measured_counts():
    for row in times("noise alone", NOISY, 7.0, 3.0, 1.5, 1.0):
        assert row.seconds.value == pytest.approx(0.01 * (8 / row.error) ** 2)
        assert not row.at_most
    below, above = times("noise alone", NOISY, 0.9, 8.5)
    assert below.seconds is None
    assert above.at_most
    assert above.seconds.value == pytest.approx(NOISY[0].seconds.value)
    assert times("flat", NOISY + FLAT, 5.0)[0].seconds is None
    biased = [timed("biased", n, 0.01 * n, sqrt(2**2 + 64 / n)) for n in (4, 16, 64)]
    early, late, never = times("biased", biased, 4.0, 2.5, 2.0)  # errors measured: 4.5, 2.8, 2.2
    assert 0.04 < early.seconds.value < 0.16 < late.seconds.value < 0.64
    assert never.seconds is None


def test_the_interval_of_a_reached_error_holds_what_times_and_errors_vary_by():
    def found(spread, stderr):
        points = [timed("noise", n, 0.01 * n, 8 / sqrt(n), stderr, spread) for n in (1, 4, 16, 64)]
        return equal_error(points, [3.0])[0].seconds

    exact, in_time, in_both = found(0.0, 0.0), found(0.1, 0.0), found(0.1, 0.1)
    assert exact.low == exact.value == exact.high
    assert (in_time.low, in_time.high) == pytest.approx((0.9 * exact.value, 1.1 * exact.value))
    assert in_both.low < in_time.low < in_time.high < in_both.high


def test_the_interval_of_a_median_holds_it_as_often_as_it_says():
    rng = np.random.default_rng(11)
    for count in (4, 7, 12):
        found = [median(row) for row in rng.exponential(size=(2000, count))]
        held = np.mean([one.low <= np.log(2) <= one.high for one, _ in found])
        level = found[0][1]
        assert held == pytest.approx(level, abs=3 * sqrt(level * (1 - level) / len(found)))
        assert level >= 0.95 or count < 6
    assert median([5.0, 1.0, 2.0, 4.0, 3.0]) == (Seconds(3.0, 1.0, 5.0), 1 - 2 / 32)


def test_sample_counts_are_powers_of_four():
    assert Effort(largest=64).counts == (4, 16, 64)
    assert Effort(largest=100).counts == (4, 16, 64)
    assert Effort(largest=2).counts == (2,)
    with pytest.raises(InputError, match="rounds"):
        Effort(rounds=1)


def sentence(chosen):
    choice = Choice(
        scene="box",
        resolution=(8, 8),
        metric="dE2000",
        within=3.0,
        chosen=chosen,
        best=timed("path 5", 16, 0.3, 2.5),
        full=timed("full plan", 16, 0.21, 2.75),
    )
    return " ".join(cost_tables.choice_lines(choice))


def test_the_choice_says_time_and_error_and_what_it_is_in_place_of():
    stand_in = structs.replace(timed("constant ambient", 16, 0.004, 2.1), prepare_s=0.1)
    said = sentence(stand_in)
    assert said.startswith(
        "At 8x8: constant ambient with 16 samples per pixel: ΔE2000 2.10 at 4.00 ms and once 100"
        " ms to prepare, in place of full plan with 16 samples per pixel: ΔE2000 2.75 at 210 ms."
    )
    assert "constant ambient: Ambient light" in said
    assert said.endswith("full plan: Everything that the scene calls for.")
    same = sentence(timed("full plan", 16, 0.21, 2.75))
    assert "Nothing cheaper stays within 3." in same
    assert same.count("full plan: ") == 1
    none = "At 8x8 no measured method stays within ΔE2000 3. The nearest is path 5"
    assert sentence(None).startswith(none)


# -- Predictions -----------------------------------------------------------------------------------

TARGET = 1024, 768
METHODS = tuple(Method(name=name, family="physical", monte_carlo=True) for name in "abcdef")


def folded(bias, spread):
    """The mean distance of normal noise around a bias."""
    share = bias / spread
    near = spread * sqrt(2 / pi) * exp(-(share**2) / 2)
    return near + bias * erf(share / sqrt(2))


def seconds_of(number, width, height, spp):
    return 2e-3 * (number + 1) + width * height * (1e-8 + 4e-8 * (number + 1) * spp)


def error_of(number, width, spp):
    """A bias, which edges add to, and noise."""
    return folded(0.2 * number + 4 / width, 4 / sqrt(spp))


def forecasts(rng, scatter):
    """Predict all methods from measurements that scatter by a share of their values."""
    points = {}
    for number, method in enumerate(METHODS):
        for size, counts in zip(sizes(TARGET), FITTED_SPP, strict=True):
            for spp in counts:
                time = seconds_of(number, *size, spp) * exp(scatter * rng.normal())
                error = error_of(number, size[0], spp) * exp(scatter / 4 * rng.normal())
                points[method.name, spp, size] = timed(method.name, spp, time, error)
    return predicted(METHODS, points, TARGET, sizes(TARGET), 3).forecasts


def test_without_scatter_times_are_exact_and_errors_follow_bias_and_noise():
    for row in forecasts(np.random.default_rng(1), 0.0):
        number = "abcdef".index(row.method)
        assert row.seconds.value == pytest.approx(seconds_of(number, *TARGET, row.spp), rel=1e-3)
        assert row.error.mean == pytest.approx(error_of(number, TARGET[0], row.spp), rel=0.2)
        assert row.seconds.high < 1.1 * row.seconds.value


@pytest.mark.guarantee(
    "attribution",
    "Intervals of predicted times and errors hold later measurements about as often as they say.",
)
def test_intervals_of_predictions_hold_as_often_as_they_say():
    rng, held, widths = np.random.default_rng(5), [], []
    for _ in range(25):
        for row in forecasts(rng, 0.05):
            number = "abcdef".index(row.method)
            later = seconds_of(number, *TARGET, row.spp) * exp(0.05 * rng.normal())
            error = error_of(number, TARGET[0], row.spp)
            held.append(
                (
                    row.seconds.low <= later <= row.seconds.high,
                    row.error.low <= error <= row.error.high,
                )
            )
            widths.append(row.seconds.high / row.seconds.value)
    shares = np.mean(held, axis=0)
    assert (shares > LEVEL - 0.07).all(), shares
    assert np.median(widths) < 1.5


def test_the_cheapest_way_is_the_fastest_that_reaches_an_error():
    rows = [
        Forecast(
            method=method,
            spp=spp,
            seconds=Seconds(seconds, seconds, seconds),
            error=MeanError(error, error, error),
        )
        for method, spp, seconds, error in [
            ("slow", 1, 8.0, 4.0),
            ("slow", 4, 32.0, 2.0),
            ("fast", 1, 1.0, 8.0),
            ("fast", 4, 4.0, 4.0),
            ("fast", 16, 16.0, 3.0),
        ]
    ]
    found = predicted_cheapest(rows, 4.0)
    assert (found.method, found.spp, found.seconds.value) == ("fast", 4, 4.0)
    found = predicted_cheapest(rows, 2.0 * sqrt(2))  # half way from 4 to 2, in logarithms
    assert (found.method, found.spp) == ("slow", 2)
    assert found.seconds.value == pytest.approx(16.0)
    assert predicted_cheapest(rows, 1.0).seconds is None


def test_sizes_that_cannot_be_predicted_or_measured_are_refused():
    assert sizes((1920, 1080)) == ((85, 48), (171, 96), (341, 192))
    assert sizes((64, 48)) == ((8, 6), (16, 12), (32, 24))
    with pytest.raises(InputError, match="too small for a prediction"):
        sizes((16, 8))
    require("box", (640, 480), (64, 48), is_measured=False)
    with pytest.raises(InputError, match="differ in shape"):
        require("box", (640, 480), (64, 64), is_measured=False)
    with pytest.raises(InputError, match="too large to measure"):
        require("box", (10_000, 10_000), None, is_measured=True)
