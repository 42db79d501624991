"""Whether intervals hold what many more samples show, in scenes that are hard to sample.

Of each scene of :mod:`tests.shared.noisy_scenes`, comparisons with default options and different
seeds give intervals: of the mean ΔE2000, of the share of visible pixels, of what effects remove,
and of the closure, whose true value is 0. The true mean and share come from Mitsuba's own
integrator, which shares no plan with the reference, and the true effects from hybrids, each with
:data:`FINER` times the samples.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from unittest import mock

import fotismos  # noqa: F401  isort: skip  it finds LLVM before Mitsuba is imported

import mitsuba as mi
import numpy as np

from fotismos.comparisons import attribution
from fotismos.comparisons.case import open_case
from fotismos.comparisons.compare import compare
from fotismos.comparisons.departure.criterion import share_above
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.comparisons.records.comparison import Attribution
from fotismos.comparisons.steps import steps

SEEDS = 8
FINER = 100
"""Comparisons of a scene, and samples of the true values, over those of one comparison."""

TRUE_SEED = 1000
"""Of the true values: no comparison has it."""

MOST = 8
"""Effects up to which true values take all subsets, in place of drawn orders."""

PASS = 1024
"""Samples per pixel of one pass of Mitsuba's own integrator."""

MEAN = "mean"
SHARE = "share"
CLOSURE = "closure"
NUMBERS = (MEAN, SHARE, CLOSURE)
"""What is measured beside the effects, which go by their labels."""


@dataclass(frozen=True)
class Measured:
    """The intervals of one number of a scene over seeds, and what is true.

    ``intervals`` are ``[low, high]``, one for each seed.
    """

    number: str
    truth: float
    intervals: list[list[float]]

    @property
    def held(self) -> int:
        """How many intervals hold the true value."""
        return sum(low <= self.truth <= high for low, high in self.intervals)


@dataclass(frozen=True)
class SceneMeasured:
    """All numbers of a scene; ``departure`` is its true mean ΔE2000."""

    scene: str
    departure: float
    numbers: list[Measured]

    def held(self, *numbers: str) -> tuple[int, int]:
        """Return how many intervals of some numbers hold their truth, and how many there are."""
        chosen = [measured for measured in self.numbers if measured.number in numbers]
        held = sum(measured.held for measured in chosen)
        return held, sum(len(measured.intervals) for measured in chosen)

    @property
    def effects(self) -> list[str]:
        """The labels of its effects."""
        return [one.number for one in self.numbers if one.number not in NUMBERS]


def measured(make) -> SceneMeasured:
    """Compare a scene with different seeds, and find its true values."""
    intervals: dict[str, list[list[float]]] = {}
    kernels = []
    for seed in range(SEEDS):
        case = open_case(make, Options(seed=seed))
        comparison = compare(case.source, case.options, then=steps(why=True))
        record = comparison.record
        kernels.append(comparison.images.heuristic)
        for number, low, high in _intervals(record):
            intervals.setdefault(number, []).append([float(low), float(high)])
    true = {CLOSURE: 0.0}
    if record.why is not None:
        true |= _true_effects(make)
    picture = _own_picture(make, FINER * record.plan.spp)
    counted = comparison.images.counted
    kernel = np.mean(kernels, axis=0)
    distances = LEADING(kernel, picture, record.viewing)[counted]
    share = share_above(record.metrics[LEADING.name].visible)
    true[MEAN] = float(distances.mean())
    true[SHARE] = float(np.mean(distances > share.threshold))
    return SceneMeasured(
        scene=make.__name__.replace("_", " "),
        departure=true[MEAN],
        numbers=[
            Measured(number, true.get(number, 0.0), found) for number, found in intervals.items()
        ],
    )


def _intervals(record) -> Iterator[tuple[str, float, float]]:
    """Yield each number of a record with the ends of its interval."""
    summary = record.metrics[LEADING.name]
    share = share_above(summary.visible)
    yield MEAN, summary.low, summary.high
    yield SHARE, share.low, share.high
    why = record.why
    if why is None:  # in fog, where no image of some effects can be rendered
        return
    yield CLOSURE, why.closure.low, why.closure.high
    for contribution in why.effects:
        # Drawn orders have an error of their own, which a record states beside the interval.
        drawn = 1.96 * contribution.sampling_error
        removes = contribution.removes
        yield contribution.effect, removes.low - drawn, removes.high + drawn


def _true_effects(make) -> dict[str, float]:
    """Return what each effect removes, by hybrids of many samples and all their subsets."""
    case = open_case(make, Options(seed=TRUE_SEED))
    ready = prepare(case.source, case.options)
    more = {name: FINER * getattr(attribution, name) for name in ("SPP", "FEW_SPP", "EXACT_SPP")}
    with mock.patch.multiple(attribution, **more, EXACT_EFFECTS=MOST):
        record: Attribution = attribution.find(ready).record
    return {item.effect: item.removes.value for item in record.effects}


def _own_picture(make, spp: int) -> np.ndarray:
    """Return the scene (H, W, 3) as Mitsuba renders it, without a plan."""
    scene = mi.load_dict(make())
    passes = max(1, round(spp / PASS))
    total = 0.0
    for seed in range(passes):
        total = total + np.array(mi.render(scene, spp=PASS, seed=TRUE_SEED + seed), float)
    return total[..., :3] / passes


HEAD = ("scene", "true mean ΔE2000", "mean", "share", "effects", "closure")


def table(results: Sequence[SceneMeasured]) -> Iterator[tuple[str, ...]]:
    """Yield how many intervals hold their true values, by scene and number."""
    yield HEAD
    for result in results:
        counts = (
            result.held(MEAN),
            result.held(SHARE),
            result.held(*result.effects),
            result.held(CLOSURE),
        )
        cells = (f"{held} of {count}" if count else "–" for held, count in counts)
        yield result.scene, f"{result.departure:.2f}", *cells
