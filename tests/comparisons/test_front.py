"""Times, fronts, and choices on numbers: a clock and renderers that are made up."""

from contextlib import nullcontext
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from msgspec import structs

from fotismos.comparisons import timing
from fotismos.comparisons.cost.front import beats, fronted, reach, sufficient
from fotismos.comparisons.cost.measure import timed, tried
from fotismos.comparisons.records.cost import Point
from fotismos.reference.records import Interval
from fotismos.reference.rendering.passes import passes

PIXELS = 64 * 64
KERNEL = 15e-9
"""Seconds per sample."""


@dataclass
class Clock:
    """A renderer that takes a made-up time: two threads, of which other programs take a share."""

    overhead: float
    per_sample: float
    rng: np.random.Generator
    taken: float = 0.0
    pass_spp: int = 64
    bend: float = 0.0
    variant: str = "llvm_ad_rgb"
    times: list = field(default_factory=list)
    processor_times: list = field(default_factory=list)

    def active(self):
        return nullcontext()

    def passes(self, count, size, stream, seed):
        return map(self.render, range(count))

    def render(self, seed, size=None):
        samples = self.pass_spp * PIXELS
        work = self.overhead + samples * self.per_sample * (1 + self.bend * samples)
        # Others only ever add time; now and then a burst adds much.
        slower = 1 + self.taken + self.rng.gamma(1.0, 0.02) + (self.rng.random() < 0.1)
        self.times.append(work * slower)
        busy = 2 * samples * self.per_sample * (1 + self.rng.gamma(1.0, 0.02))
        self.processor_times.append(self.overhead + busy)
        return np.zeros((1, 1, 3))

    def sampled(self, pass_spp):
        return replace(self, pass_spp=pass_spp, times=[], processor_times=[])


def lines_of(per_sample, rng, rounds=7, taken=0.0, overhead=6e-3, **more):
    """The lines of made-up methods, measured as real ones are."""
    firsts = {name: Clock(overhead, time, rng, taken, **more) for name, time in per_sample.items()}
    renderers = tried(firsts, dict.fromkeys(firsts, (4, 16, 64)), PIXELS)
    for _ in passes([*renderers.values()], 0, rounds + 2):
        pass
    return timed(renderers, rounds, PIXELS), renderers


# -- Times -----------------------------------------------------------------------------------------


def test_overhead_and_time_per_sample_are_found_beside_bursts(rgb):
    lines, _ = lines_of({"kernel": KERNEL, "plan": 10 * KERNEL}, np.random.default_rng(1))
    kernel, plan = lines["kernel"], lines["plan"]
    assert plan.overhead[0] == pytest.approx(6e-3, rel=0.2)
    assert plan.per_sample[0] == pytest.approx(10 * KERNEL, rel=0.03)
    assert plan.processors == pytest.approx(2, rel=0.03)
    assert abs(plan.bend) < 0.05
    own = timing.ratio(kernel, kernel)
    assert (own.low, own.value, own.high) == (1.0, 1.0, 1.0)


def test_times_that_are_no_straight_line_are_told(rgb):
    bent, _ = lines_of({"plan": 10 * KERNEL}, np.random.default_rng(2), bend=2e-6)
    assert abs(bent["plan"].bend) > 0.1


@pytest.mark.guarantee("attribution", "Ratios of times stay within 10 % on a busy machine.")
def test_ratios_and_times_of_a_busy_machine(rgb):
    rng = np.random.default_rng(3)
    slow = {"kernel": KERNEL, "direct": 4 * KERNEL, "plan": 22 * KERNEL}
    for taken in (0.0, 0.5, 1.0):
        lines, _ = lines_of(slow, rng, taken=taken)
        for name, time in slow.items():
            found = timing.ratio(lines[name], lines["kernel"])
            assert found.value == pytest.approx(time / KERNEL, rel=0.1)
        assert lines["plan"].processors == pytest.approx(2 / (1 + taken), rel=0.12)


@pytest.mark.guarantee(
    "attribution", "An effect that adds a tenth of the kernel's time is found in 9 of 10 runs."
)
def test_a_tenth_of_the_kernel_is_detected_and_nothing_is_not(rgb):
    rng, found, false = np.random.default_rng(4), 0, 0
    for _ in range(60):
        slow = {"kernel": KERNEL, "same": KERNEL, "more": 1.1 * KERNEL}
        lines, _ = lines_of(slow, rng)
        more = timing.difference([(1.0, lines["kernel"], lines["more"])], 1_000_000)
        none = timing.difference([(1.0, lines["kernel"], lines["same"])], 1_000_000)
        found += more.low > 0
        false += not none.low <= 0 <= none.high
        assert more.value == pytest.approx(1.5e-3, rel=0.7)
    assert found >= 54
    assert false <= 3


def test_intervals_hold_the_time_and_what_steps_add_is_the_whole(rgb):
    rng, held = np.random.default_rng(5), 0
    slow = {name: ratio * KERNEL for name, ratio in zip("abcd", (1, 4, 9, 22), strict=True)}
    for _ in range(40):
        a, b, c, d = lines_of(slow, rng)[0].values()
        steps = [(0.5, a, b), (0.5, b, d), (0.5, a, c), (0.5, c, d)]
        parts = [timing.difference([step], 1000).value for step in steps]
        whole = timing.difference(steps, 1000)
        assert sum(parts) == pytest.approx(whole.value)
        assert whole.value == pytest.approx(timing.difference([(1.0, a, d)], 1000).value)
        per_sample = timing.interval(d.per_sample, timing.UNSEEN * d.per_sample[0])
        held += per_sample.low <= 22 * KERNEL <= per_sample.high
    assert held >= 34


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
    assert sufficient(points, 7.0).method == "kernel"
    found = sufficient(points, 6.5)  # the kernel's 6 may be 6.6
    assert (found.method, found.ties) == ("path", ("direct",))
    assert sufficient(points, 1.0).method == "plan"
    assert sufficient(points, 0.1) is None


def by_law(name, left, noise, per_sample, counts=(4, 16, 64)):
    """Points of a method whose tolerance is left and noise, added in squares."""
    found = []
    for spp in counts:
        tolerance = np.hypot(left, noise / np.sqrt(spp))
        point = made(name, spp, per_sample * spp, 1.0, 0.01)
        near = Interval(value=tolerance, low=0.99 * tolerance, high=1.01 * tolerance)
        found.append(structs.replace(point, tolerance=near))
    return found


def test_the_samples_that_a_tolerance_takes_follow_from_two_counts():
    for seed in range(50):
        left, noise, tolerance = np.random.default_rng(seed).uniform((0, 30, 2), (1.5, 60, 3))
        slow, biased = by_law("slow", left, noise, 2.0), by_law("biased", 9.0, noise, 0.1)
        fast = by_law("fast", 0.9 * left, 0.9 * noise, 1.0)
        found = reach([*slow, *biased, *fast], tolerance)
        expected = (0.9 * noise) ** 2 / (tolerance**2 - (0.9 * left) ** 2)
        assert found.method == "fast"
        assert expected <= found.spp <= max(expected + 1.001, 65)
        assert found.left == pytest.approx(0.9 * left, abs=1e-3)


def test_bias_is_told_from_noise():
    near, far = by_law("near", 4.0, 3.0, 1.0), by_law("far", 9.0, 3.0, 1.0)
    found = reach([*far, *near], 2.0)
    assert (found.method, found.spp) == ("near", None)
    assert found.left == pytest.approx(4.0)
    assert reach(by_law("one", 0.0, 30.0, 1.0, (4,)), 2.0) is None
