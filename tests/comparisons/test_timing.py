"""Ratios of times: alternating order, intervals, and the refusal to name one."""

from contextlib import nullcontext
from copy import copy

import numpy as np
import pytest

from fotismos.comparisons import timing
from fotismos.comparisons.compare import compare
from fotismos.comparisons.options import Options
from fotismos.reference.records import plain
from fotismos.reference.scene.source import Source
from fotismos.reports import tables
from fotismos.reports.terminal.words import number
from tests.shared.misplanned import DIFFUSE, lamp, scene
from tests.shared.parts import moved


class Timed:
    """A renderer whose pictures take an overhead and a time per sample, on a busy machine."""

    def __init__(self, per_sample, busy, rng, spread=0.01):
        self.per_sample = per_sample
        self.busy = busy
        self.rng = rng
        self.spread = spread
        self.scene = None
        self.size = (64, 64)
        self.variant = "llvm_ad_rgb"

    def active(self):
        return nullcontext()

    def sampled(self, pass_spp):
        other = copy(self)
        other.pass_spp = pass_spp
        other.times = []
        other.processor_times = []
        return other

    def passes(self, count, size, stream, seed):
        for _ in range(count):
            yield self.render(seed, size)

    def render(self, seed, size):
        seconds = 2e-3 + self.per_sample * self.pass_spp * size[0] * size[1]
        seconds *= 1 + abs(self.rng.normal(0, self.spread))
        other_work = self.rng.uniform(0, 2) if self.rng.random() < self.busy else 0.0
        self.times.append(seconds * (1 + other_work))
        # Other programs hardly change the time that two processors work.
        self.processor_times.append(2 * seconds)


@pytest.fixture
def unscaled(monkeypatch):
    """Renderers of a test have no film."""
    monkeypatch.setattr(timing, "size_of_width", lambda scene, size, width: (width, width))


@pytest.mark.guarantee(
    "attribution", "Ratios of a comparison's times are within their interval of 30 %, or absent."
)
@pytest.mark.parametrize("busy", [0.0, 0.2, 0.5])
@pytest.mark.parametrize("truth", [0.5, 1.0, 7.0])
def test_a_ratio_is_the_true_one_or_absent(rgb, unscaled, busy, truth):
    """Other work adds up to twice the time to a share of the pictures; overhead is the same."""
    rng = np.random.default_rng(0)
    prices = []
    for _ in range(60):
        halves = [Timed(per_sample, busy, rng) for per_sample in (1e-8, truth * 1e-8)]
        prices.append(timing.measure(*halves, everything=None, seed=0))
    ratios = [price.ratio for price in prices if price.ratio is not None]
    assert len(ratios) > 45
    assert all(ratio.high - ratio.low <= timing.WIDEST * ratio.value for ratio in ratios)
    assert np.mean([ratio.low < truth < ratio.high for ratio in ratios]) > 0.9
    assert np.mean([abs(ratio.value / truth - 1) < 0.15 for ratio in ratios]) > 0.95


def test_a_ratio_that_is_not_known_is_timed_again(rgb, unscaled, monkeypatch):
    rng = np.random.default_rng(0)

    def known():
        halves = [[Timed(1e-8, 0.0, rng, spread=0.5) for _ in range(2)] for _ in range(30)]
        prices = [timing.measure(*pair, everything=None, seed=0) for pair in halves]
        return sum(price.ratio is not None for price in prices)

    often = known()
    monkeypatch.setattr(timing, "ATTEMPTS", 1)
    assert known() < 0.7 * often


def comparison(spp=64):
    floor = {"type": "rectangle", "to_world": moved((0, 0, -1), 4), "bsdf": DIFFUSE}
    described = scene(floor=floor, lamp=lamp((0, -3, 0)))
    return compare(Source("a test", described), Options(spp=spp)).record


@pytest.mark.thorough
def test_the_record_has_the_ratio_that_is_shown(rgb):
    record = comparison()
    price = plain(record)["price"]
    assert price["reason"] == ("" if price["ratio"] else timing.TOO_WIDE.reason)
    printed = "\n".join(tables.details(record))
    if price["ratio"]:
        assert f"sample: {number(price['ratio']['value'])} times the textbook's" in printed
        assert price["ratio"]["low"] <= price["ratio"]["value"] <= price["ratio"]["high"]


def test_verbose_lines_say_why_there_is_no_ratio(rgb, monkeypatch):
    monkeypatch.setattr(timing, "WIDEST", 0.0)
    record = comparison()
    assert plain(record)["price"]["ratio"] is None
    assert f"  time of a physical sample: {timing.TOO_WIDE.reason}" in tables.details(record)
