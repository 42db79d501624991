"""Curves of time and error against laws that are known, and predictions as a whole."""

from dataclasses import dataclass
from math import erf, exp, pi, sqrt

import msgspec
import numpy as np
import pytest

from comparisons.case import Request, open_case
from comparisons.cost.cost import cost
from comparisons.cost.cost_record import Cost, Forecast, Prices, Range
from comparisons.cost.effort import Effort
from comparisons.cost.prediction.asked_prices import at_size
from comparisons.cost.prediction.error_curve import ErrorCurve
from comparisons.cost.prediction.error_law import LEVEL, ErrorLaw, intervals
from comparisons.cost.prediction.forecasting import cheapest
from comparisons.cost.prediction.target import require, sizes
from comparisons.cost.prediction.time_curve import TimeCurve
from comparisons.records import to_json
from heuristic.errors import InputError
from reports.terminal import cost_tables

PIXELS = np.repeat([64**2, 128**2, 256**2], 3)
SPP = np.tile([4, 16, 64], 3)


@pytest.mark.parametrize("law", [(2e-3, 1e-8, 3e-7), (2e-2, 0, 5e-8), (1e-4, 2e-7, 2e-8)])
def test_times_without_noise_give_their_law_back(law):
    def time(pixels, spp):
        return law[0] + law[1] * pixels + law[2] * pixels * spp

    curve = TimeCurve.fit(PIXELS, SPP, time(PIXELS, SPP))
    for pixels, spp in ((1920 * 1080, 16), (512**2, 1), (32**2, 4)):
        assert curve.at(pixels, spp, 0.1)[0] == pytest.approx(time(pixels, spp), rel=0.02)


@pytest.mark.parametrize("burst", [0.0, 0.2])
def test_intervals_of_time_hold_as_often_as_they_say(burst):
    """Of several methods in one run, of which bursts of other programs hit some measurements."""
    rng = np.random.default_rng(5)
    laws = [(3e-3, 2e-8, 2e-7), (1e-3, 1e-7, 2e-8), (2e-2, 1e-8, 1e-6), (5e-3, 1e-9, 5e-7)]
    pixels, spp, held, widths = 800 * 600, 32, [], []

    def noise(size=None):
        hit = rng.random(size) < burst
        return np.exp(0.1 * rng.normal(size=size)) * np.where(hit, 1.3, 1.0)

    for _ in range(150):
        exact = [a + b * PIXELS + c * PIXELS * SPP for a, b, c in laws]
        curves = [TimeCurve.fit(PIXELS, SPP, time * noise(9)) for time in exact]
        for (a, b, c), curve in zip(laws, curves, strict=True):
            later = (a + b * pixels + c * pixels * spp) * noise()
            value, low, high = curve.at(pixels, spp, curve.scatter(curves))
            held.append(low <= later <= high)
            widths.append(high / value - 1)
    # Five standard deviations of a binomial share.
    assert abs(np.mean(held) - LEVEL) < 5 * sqrt(LEVEL * (1 - LEVEL) / len(held))
    assert np.median(widths) < 0.5


def test_a_quiet_machine_gets_narrow_intervals_and_a_method_that_scatters_wider_ones():
    rng = np.random.default_rng(6)
    exact = 3e-3 + 2e-8 * PIXELS + 2e-7 * PIXELS * SPP
    quiet, loud = (
        TimeCurve.fit(PIXELS, SPP, exact * np.exp(scatter * rng.normal(size=9)))
        for scatter in (0.01, 0.2)
    )
    assert quiet.scatter([quiet]) < 0.03
    assert quiet.scatter([quiet, loud]) < 0.7 * loud.scatter([quiet, loud])


def folded(bias, spread):
    """Return the mean of ``|x|`` for a normal ``x``."""
    return spread * sqrt(2 / pi) * exp(-(bias**2) / (2 * spread**2)) + bias * erf(
        bias / (spread * sqrt(2))
    )


@pytest.mark.parametrize("bias", [0.0, 0.05, 0.5])
@pytest.mark.parametrize("spp", [1, 4, 32, 256, 1024])
def test_errors_follow_bias_and_noise_at_any_count(bias, spp):
    rng = np.random.default_rng(11)
    shape = 8, 4000, 3
    images = {s: bias + rng.normal(size=shape) / sqrt(s) for s in (4, 16, 64)}
    curve = ErrorCurve.measured(images, lambda image: float(np.abs(image).mean()))
    expected = folded(bias, 1 / sqrt(spp))
    # The mean of all rounds holds the noise of 512 samples: beyond, the bias is extrapolated.
    assert curve.at(spp) == pytest.approx(expected, rel=0.05 if spp < 512 else 0.1)


def test_counts_that_stratify_worse_are_told_from_one_of_them():
    rng = np.random.default_rng(12)
    shape = 8, 4000, 3

    def spread(spp):
        return (1 + 4 / spp if spp in (8, 32) else 1) / spp  # a share that falls with the count

    images = {s: rng.normal(size=shape) * spread(s) for s in (4, 8, 16, 64)}
    curve = ErrorCurve.measured(images, lambda image: float(np.abs(image).mean()))
    assert curve.at(32) == pytest.approx(spread(32) * sqrt(2 / pi), rel=0.05)


WIDTHS = (64, 128, 256)
ROUNDS = 6


@dataclass(frozen=True)
class Curve:
    """An error of ``bias + noise / s``, measured at some counts."""

    bias: float
    noise: float
    residuals: tuple = (4, 8, 16, 64)

    def at(self, spp):
        return self.bias + self.noise / spp

    def without(self, spp):
        return self


def law_of(bias, edges, noise, rng, chance=0.0):
    """A law whose errors hold some of edges, which meet the pixels by chance."""
    errors = {}
    for width in WIDTHS:
        met = 1 + chance * rng.normal() / sqrt(width)
        for spp in (4, 8, 16, 64):
            mean = (bias + edges / width) * met + noise / spp
            errors[width, spp] = mean * (1 + 1e-3 * rng.normal(size=ROUNDS))
    del errors[256, 8], errors[256, 64]
    return ErrorLaw(WIDTHS, errors, Curve(bias + edges / 128, noise))


def test_errors_of_edges_go_with_their_share_of_the_pixels():
    law = law_of(2.0, 64.0, 0.0, np.random.default_rng(1))
    for width in (512, 1024, 4096):
        assert law.at(width, 32) == pytest.approx(2 + 64 / width, rel=0.01)


def test_errors_of_nothing_but_edges_vanish_no_faster_than_they():
    law = law_of(0.0, 64.0, 0.0, np.random.default_rng(2), chance=3.0)
    assert law.at(4096, 16) > 0


def test_a_method_without_error_is_predicted_to_have_none():
    rng = np.random.default_rng(7)
    exact = law_of(0.0, 0.0, 0.0, rng)
    value, low, high = intervals([exact, law_of(1.0, 20.0, 0.5, rng)], 512)(exact, 32)
    assert (value, low) == (0, 0)
    assert 0 < high < 0.1


@pytest.mark.guarantee(
    "prices",
    "Intervals of predicted times and errors contain nine of ten later measurements.",
)
def test_intervals_of_errors_hold_as_often_as_they_say():
    rng = np.random.default_rng(3)
    held, widths = [], []
    for _ in range(200):
        truths = [(bias, 20.0, 0.5) for bias in (0.0, 1.0, 4.0, 12.0)]
        laws = [law_of(*truth, rng, chance=0.3) for truth in truths]
        at = intervals(laws, 512)
        for (bias, edges, noise), law in zip(truths, laws, strict=True):
            met = 1 + 0.3 * rng.normal() / sqrt(512)
            value, low, high = at(law, 32)
            held.append(low <= (bias + edges / 512) * met + noise / 32 <= high)
            widths.append((high - low) / value)
    assert 0.84 < np.mean(held) < 0.97
    assert np.median(widths) < 0.3


def test_fitted_sizes_have_the_shape_asked_for():
    for target in ((1920, 1080), (512, 512), (300, 100)):
        for width, height in sizes(target):
            assert width / height == pytest.approx(target[0] / target[1], rel=0.08)
            assert width * height <= target[0] * target[1] / 4 * 1.05
    with pytest.raises(InputError, match="12x12 is too small"):
        sizes((12, 12))


def test_a_size_of_another_shape_is_rejected():
    require("room", (1920, 1080), (128, 72), False)
    with pytest.raises(InputError, match="128x128 and 1920x1080 differ in shape"):
        require("room", (1920, 1080), (128, 128), False)


def test_a_size_that_cannot_be_is_refused_before_anything_is_rendered():
    case = open_case("fig-8-9", Request())
    told = []
    for at, words in (((12, 12), "too small"), ((4096, 3072), "too large to measure")):
        with pytest.raises(InputError, match=words):
            cost(case.source, case.options, progress=lambda *all: told.append(all), at=at,
                 is_measured=True)  # fmt: skip
    assert not told


def forecast(method, spp, seconds, error):
    return Forecast(method, spp, Range(seconds, seconds, seconds), Range(error, error, error))


def test_the_cheapest_way_is_the_fastest_that_reaches_an_error():
    rows = [
        forecast("slow", 1, 8.0, 4.0),
        forecast("slow", 4, 32.0, 2.0),
        forecast("fast", 1, 1.0, 8.0),
        forecast("fast", 4, 4.0, 4.0),
        forecast("fast", 16, 16.0, 3.0),
    ]
    found = cheapest(rows, 4.0)
    assert (found.method, found.spp, found.seconds.value) == ("fast", 4, 4.0)
    found = cheapest(rows, 2.0 * sqrt(2))  # half way from 4 to 2, in logarithms
    assert (found.method, found.spp) == ("slow", 2)
    assert found.seconds.value == pytest.approx(16.0)
    assert cheapest(rows, 1.0).method is None


@pytest.fixture(scope="module")
def predicted():
    """A study that predicts for a small size, and measures there."""
    case = open_case("fig-8-9", Request())
    effort = Effort(rounds=2, largest=4, reference_spp=4, replicates=3, replicate_spp=4)
    return cost(case.source, case.options, effort, at=(64, 48), is_measured=True).record


def test_a_study_predicts_every_method_and_measures_counts_that_were_not_fitted(predicted):
    found = predicted.prediction
    assert found.resolution == (64, 48)
    names = {rung.name for rung in predicted.rungs}
    assert {law.method for law in found.laws} == names
    assert [each.effect for each in found.prices] == [p.effect for p in predicted.prices.effects]
    assert {row.method for row in found.forecasts if row.measured} == names
    for row in found.forecasts:
        assert row.seconds.low < row.seconds.value < row.seconds.high
        assert row.error.low <= row.error.value <= row.error.high
    kernel = [row for row in found.forecasts if row.method == "Phong kernel" and row.measured]
    assert all(row.error.value == pytest.approx(row.measured.error, rel=0.1) for row in kernel)
    assert msgspec.json.decode(to_json(predicted), type=Cost).prediction == found


def test_the_terminal_names_the_cheapest_way_to_each_error(predicted):
    lines = list(cost_tables.lines(predicted))
    (title,) = (line for line in lines if line.startswith("Predicted at"))
    assert title == "Predicted at 64x48"
    cheapest_lines = [line for line in lines if line.startswith("ΔE2000 = ")]
    assert len(cheapest_lines) == len(predicted.prediction.cheapest)


def test_measuring_needs_a_size(run):
    code, _, error = run("cost", "fig-8-9", "--measure")
    assert code == 2
    assert "give one with --at" in error


def priced(width, removes, adds):
    """Prices of two effects at a width, of a scene whose every law is known."""
    height = 3 * width // 4
    effects = [
        {
            "effect": name,
            "removes": {"value": b + c / width, "low": b + c / width - 0.1,
                        "high": b + c / width + 0.1},
            "alone": 0.0, "last": 0.0, "sampling_error": 0.0,
            "adds_s": {"value": t0 + t * width * height, "low": t0 + t * width * height,
                       "high": t0 + t * width * height},
        }
        for name, (b, c), (t0, t) in zip("ab", removes, adds, strict=True)
    ]  # fmt: skip
    others = {"departure": 1.0, "floor": 0.0, "kernel_s": 1.0, "reference_s": 1.0}
    counts = {"spp": 64, "replicates": 8, "orders": 0}
    return msgspec.convert({"effects": effects, **others, **counts}, Prices)


def test_prices_at_a_size_follow_edges_and_pixels():
    laws = [(3.0, 20.0), (-1.0, 0.0)], [(0.01, 2e-7), (-0.002, -1e-8)]
    sizes, target = ((64, 48), (128, 96)), (1024, 768)
    found = at_size(*(priced(width, *laws) for width, _ in sizes), sizes, target)
    expected = priced(1024, *laws).effects
    for one, exact in zip(found, expected, strict=True):
        assert one.removes.value == pytest.approx(exact.removes.value)
        assert one.adds_s.value == pytest.approx(exact.adds_s.value)
        assert one.removes.high - one.removes.low > 0.2  # more than the study's own
