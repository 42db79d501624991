"""Times per sample: turns of methods, their ratios and intervals, beside other work."""

from contextlib import nullcontext

import numpy as np
import pytest

from fotismos.comparisons import turns
from fotismos.comparisons.case import open_case
from fotismos.comparisons.compare import compare
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.comparisons.steps import PRICE
from fotismos.comparisons.turns import TURNS, Time
from fotismos.reference.records import Times
from fotismos.reports import tables
from fotismos.reports.terminal.words import number

SIZE = (64, 64)
SPP = 64


class Timed:
    """A renderer whose kernels take a time per sample, and Python an overhead.

    Other work slows both halves of a turn by about the same factor, and single pictures by more.
    """

    variant = "llvm_ad_rgb"
    pass_spp = SPP

    def __init__(self, per_sample, busy, rng, burden):
        self.per_sample = per_sample
        self.busy = busy
        self.rng = rng
        self.burden = burden
        self.times = []
        self.processor_times = []
        self.kernel_times = []

    def active(self):
        return nullcontext()

    def passes(self, count, size, stream, seed):
        for turn in range(count):
            kernel = self.per_sample * SPP * size[0] * size[1] * self.rng.normal(1, 0.01)
            kernel *= self.burden[turn]
            if self.rng.random() < self.busy / 4:
                kernel *= self.rng.uniform(1, 3)
            # The half that comes first after a pause pays for it, and the first picture compiles.
            overhead = 2e-3 + self.rng.uniform(0, 5e-3) + (turn == 0)
            self.kernel_times.append(kernel * (3 if turn == 0 else 1))
            self.times.append(kernel + overhead)
            self.processor_times.append(kernel + overhead)
            yield None


def found(truth, busy, rng, per_sample=1e-8):
    """The ratio of two renderers that took turns, and the time of the first."""
    burden = 1 + busy * rng.uniform(0, 2, TURNS + 1)
    seconds = {"textbook": per_sample, "plan": truth * per_sample}
    halves = {name: Timed(time, busy, rng, burden) for name, time in seconds.items()}
    for _ in turns.in_turn(halves, 0, TURNS, size=SIZE):
        pass
    times = {name: Time.of(half, SIZE, TURNS) for name, half in halves.items()}
    return turns.ratio(times["plan"], times["textbook"]), times["textbook"]


@pytest.mark.guarantee("attribution", "Ratios of times hold beside other work on the machine.")
@pytest.mark.parametrize("busy", [0.0, 0.2, 0.5])
@pytest.mark.parametrize("truth", [0.5, 1.0, 7.0])
def test_ratios_and_their_intervals_hold_beside_other_work(busy, truth):
    """Other work adds up to the time itself to both, and up to twice the time to single ones."""
    rng = np.random.default_rng(0)
    ratios = [found(truth, busy, rng)[0] for _ in range(100)]
    assert np.mean([ratio.low < truth < ratio.high for ratio in ratios]) > 0.93
    assert np.mean([abs(ratio.value / truth - 1) < 0.1 for ratio in ratios]) > 0.95


def test_what_is_not_of_the_kernels_is_overhead():
    ratio, time = found(1.0, 0.0, np.random.default_rng(1), per_sample=1e-9)
    assert ratio.value == pytest.approx(1.0, rel=0.03)
    assert np.median(time.per_sample) == pytest.approx(1e-9, rel=0.02)
    assert 2e-3 < np.median(time.overhead) < 7e-3


@pytest.mark.parametrize("count", [2, 3, 5, 6, 7, 15])
def test_intervals_of_a_median_hold_it(count):
    rng = np.random.default_rng(2)
    held = 0
    for _ in range(2000):
        interval = turns.middle(rng.normal(5.0, 1.0, count))
        held += interval.low <= 5.0 <= interval.high
    assert held / 2000 > 0.93


def test_a_picture_of_any_size_takes_a_few_milliseconds_of_samples(rgb):
    for size in ((2, 1), (40, 30), (64, 64), (512, 384)):
        half = prepare(open_case("lambert-sphere", Options(resolution=size)).source).reference
        half.size = size
        timed, spp = turns.timed_size(half)
        assert timed == size or timed[0] * timed[1] <= turns.MOST_PIXELS
        assert turns.MOST_SAMPLES / 2 < timed[0] * timed[1] * spp <= turns.MOST_SAMPLES
        assert timed[0] / timed[1] == pytest.approx(size[0] / size[1], rel=0.02)
        assert spp & (spp - 1) == 0


def test_the_lines_and_the_record_have_the_same_ratio(rgb):
    case = open_case("lambert-sphere", Options(resolution=(24, 16), spp=16))
    record = compare(case.source, case.options, then=[PRICE]).record
    ratio = record.price.ratio
    assert ratio.low <= ratio.value <= ratio.high
    printed = "\n".join(tables.details(record))
    assert f"sample: {number(ratio.value)} times the textbook's" in printed


def test_a_median_of_passes_is_that_of_their_kernels():
    """Of whole passes, the half that comes first after a pause would be the slower one."""
    assert Times.of([9.0, 5.0, 1.0], 0.0, [0.3, 0.2, 0.1]).median_s == pytest.approx(0.15)
    assert Times.of([9.0, 5.0, 1.0], 0.0).median_s == 3.0
    half = prepare(open_case("lambert-sphere", Options(resolution=(24, 16))).source).reference
    for _ in half.passes(3):
        pass
    assert half.pass_times().median_s == pytest.approx(np.median(half.kernel_times[1:]))
    assert 0 < half.pass_times().median_s < max(half.times[1:])
