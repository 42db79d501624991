"""Time of an image as a straight line: ``overhead + samples × time per sample``.

Other work on a machine only ever adds time, so a time is the minimum of its rounds (Chen and
Revels, *Robust benchmarking in noisy environments*, 2016). In each round all methods take turns,
each at several sample counts; a method's line goes through the minima at its smallest and its
largest count, and one between them shows how straight it is.

The slope is that of processor time, which other programs hardly change, over the number of
processors that worked at once: the median of all methods, since each of their images occupies all
threads. So ratios of methods hold on a busy machine, too. Overhead cancels in the slope, so a ratio
does not depend on the size of a picture.

Intervals come from rounds drawn again with replacement, the same for all methods, so that they hold
for ratios and differences too. What no round shows, such as where the memory of a process lies,
moves a time by :data:`UNSEEN`.

A study of cost (:mod:`fotismos.comparisons.cost.measure`) times many methods so, and a comparison
its halves, after compilation and with the processor's threads awake.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fotismos.comparisons.records.comparison import FEWEST_SPP, Price
from fotismos.heuristic.convention import Floats
from fotismos.reference.records import Interval, Missing
from fotismos.reference.rendering.gbuffer import size_of_width
from fotismos.reference.rendering.passes import Size, Stream, passes
from fotismos.reference.rendering.renderer import LARGEST_PASS, Renderer, warm

DRAWS = 400
"""Sets of rounds drawn for an interval."""

UNSEEN = 0.02
"""Half an interval of a time, at least, as a share of it: from one process to another."""

LEAST_SLOPE = 1e-3
"""Time per sample, at least, as a share of the largest image's: noise may leave less."""

Draws = NDArray[np.float64]
"""A value from all rounds, then from each set of drawn rounds: (1 + DRAWS,)."""


@dataclass(frozen=True)
class Line:
    """Overhead and time per sample of one method in seconds, and how far from straight it is.

    ``processors`` worked at once; ``shortest`` is the time of its smallest image.
    """

    overhead: Draws
    per_sample: Draws
    processors: float
    bend: float
    shortest: float


Rounds = tuple[Sequence[float], Sequence[float]]
"""Wall time and processor time of an image in each round, in seconds."""


def lines(measured: Mapping[str, Mapping[int, Rounds]], seed: int = 0) -> dict[str, Line]:
    """Return the line of each method, of ``{method: {samples over all pixels: rounds}}``."""
    # All images have the same rounds, so that one set of draws serves all.
    (rounds,) = {
        len(wall) for times_by_count in measured.values() for wall, _ in times_by_count.values()
    }
    drawn = np.random.default_rng(seed).integers(rounds, size=(DRAWS, rounds))
    # The first row is every round once: the value itself.
    drawn = np.vstack([np.arange(rounds), drawn])
    best: dict[str, tuple[Floats, Floats]] = {}
    slopes: list[Draws] = []
    work: list[Draws] = []
    for name, by_count in measured.items():
        counts = np.array(sorted(by_count), float)
        # Each (counts, 1 + DRAWS).
        wall = np.array([by_count[int(n)][0] for n in counts])[:, drawn].min(axis=2)
        processor = np.array([by_count[int(n)][1] for n in counts])[:, drawn].min(axis=2)
        best[name] = counts, wall
        span = counts[-1] - counts[0]
        for rates, times in ((slopes, wall), (work, processor)):
            # Above 0, because other times are divided by it.
            least = LEAST_SLOPE * times[-1] / counts[-1]
            rates.append(np.maximum((times[-1] - times[0]) / span, least))
    processors = np.median(np.array(work) / np.array(slopes), axis=0)
    found = {}
    for name, seconds in zip(measured, work, strict=True):
        counts, wall = best[name]
        found[name] = _line(counts, wall, seconds / processors, processors=float(processors[0]))
    return found


def _line(counts: Floats, wall: Floats, per_sample: Draws, processors: float) -> Line:
    overhead = np.maximum(wall[0] - per_sample * counts[0], 0.0)
    # The count nearest to a fourth of the largest, against the chord between the ends.
    between = int(np.argmin(np.abs(counts - counts[-1] / 4)))
    chord = np.interp(counts[between], counts[[0, -1]], wall[[0, -1], 0])
    bend = float(wall[between, 0] / chord - 1)
    return Line(
        overhead=overhead,
        per_sample=per_sample,
        processors=processors,
        bend=bend,
        shortest=float(wall[0, 0]),
    )


def interval(values: ArrayLike, unseen: float) -> Interval:
    """Return the first of some draws with a 95 % interval, at least ``unseen`` to each side."""
    values = np.asarray(values, float)
    low, high = np.quantile(values, (0.025, 0.975))
    value = float(values[0])
    below = max(value - low, 0.0)
    above = max(high - value, 0.0)
    # What draws show and what they cannot show are independent: squares add up.
    return Interval(
        value=value,
        low=value - float(np.hypot(below, unseen)),
        high=value + float(np.hypot(above, unseen)),
    )


def ratio(line: Line, to: Line) -> Interval:
    """Return a time per sample over another's."""
    values = line.per_sample / to.per_sample
    return interval(values, 0.0 if line is to else UNSEEN * float(values[0]))


def difference(steps: Iterable[tuple[float, Line, Line]], samples: int) -> Interval:
    """Return the seconds that steps ``(weight, before, after)`` add to an image of some samples."""
    total = np.zeros(1 + DRAWS)
    unseen = []
    for weight, before, after in steps:
        total = total + weight * (after.per_sample - before.per_sample)
        unseen += [weight * line.per_sample[0] for line in (before, after)]
    return interval(samples * total, UNSEEN * samples * float(np.linalg.norm(unseen)))


# --- The halves of a comparison -----------------------------------------------------------------

WIDTH = 128
"""Width of the pictures that are timed, whatever the film's is: a ratio is the same everywhere."""

LONG_S = 0.015
"""Seconds that the picture with more samples takes, at least, if the film allows so many."""

BUDGET_S = 0.4
FEWEST = 6
MOST = 15
ATTEMPTS = 4
"""Seconds that all rounds take, their number, and how often they are repeated, if need be."""

WIDEST = 0.3
"""The widest interval that a ratio may have, over the ratio."""

TOO_WIDE = Missing("passes too short, or the machine too busy, to time within 30 %")
NOT_TIMED = Missing("a picture's time is not known")


def measure(
    heuristic: Renderer,
    reference: Renderer,
    everything: Renderer | None,
    seed: int,
    alone: AbstractContextManager[Any] | None = None,
) -> Price:
    """Return the times of both halves, their ratio, and what pruning saves.

    ``everything`` renders the physical half with everything simulated, if its plan leaves out
    something. Times are taken within the context ``alone``.
    """
    halves = {"heuristic": heuristic, "reference": reference}
    if everything is not None:
        halves["everything"] = everything
    width, height = reference.size
    size = size_of_width(reference.scene, reference.size, WIDTH)
    pairs = {name: _pair(half, size) for name, half in halves.items()}
    # Compiling is over: only what is timed needs the machine alone.
    with alone or nullcontext():
        found, of_halves = _of_pairs(pairs, size, seed)
    is_known = _is_narrow(of_halves)
    return Price(
        ratio=of_halves if is_known else None,
        reason="" if is_known else TOO_WIDE.reason,
        heuristic_s=float(found["heuristic"].per_sample[0]),
        reference_s=float(found["reference"].per_sample[0]),
        everything_s=float(found["everything"].per_sample[0]) if everything else None,
        pixels=width * height,
    )


def untimed(reference: Renderer) -> Price:
    """Return the price of a physical half beside a picture, whose time is not known."""
    width, height = reference.size
    pixels = width * height
    return Price(
        ratio=None,
        reason=NOT_TIMED.reason,
        heuristic_s=None,
        reference_s=min(reference.times) / (reference.pass_spp * pixels),
        pixels=pixels,
    )


def _of_pairs(
    pairs: Mapping[str, tuple[Renderer, Renderer]], size: Size, seed: int
) -> tuple[dict[str, Line], Interval]:
    """Time pairs of renderers until the ratio of the halves is known, or the machine too busy.

    Returns the time of each pair as a line over samples, and the ratio.
    """
    renderers = [renderer for pair in pairs.values() for renderer in pair]
    # What a round takes tells how many there are.
    round_s = sum(renderer.times[-1] for renderer in renderers)
    rounds = int(np.clip(BUDGET_S / round_s, FEWEST, MOST))
    for renderer in renderers:
        renderer.times.clear()
        renderer.processor_times.clear()
    for _ in range(ATTEMPTS):
        for _ in passes(renderers, seed, rounds, size=size, stream=Stream.PROBE):
            pass
        found = lines(
            {
                name: {
                    renderer.pass_spp * size[0] * size[1]: (
                        renderer.times,
                        renderer.processor_times,
                    )
                    for renderer in pair
                }
                for name, pair in pairs.items()
            }
        )
        of_halves = ratio(found["reference"], found["heuristic"])
        if _is_narrow(of_halves):
            break
    return found, of_halves


def _is_narrow(found: Interval) -> bool:
    """Return whether a ratio is known well enough to be stated."""
    return found.high - found.low <= WIDEST * found.value


def _pair(half: Renderer, size: Size) -> tuple[Renderer, Renderer]:
    """Return a half with few and with more samples, at a size, both warm."""
    fewer = more = _warm(half, FEWEST_SPP, size)
    most = LARGEST_PASS // (size[0] * size[1])
    # Powers of 4: each new count compiles.
    while more.times[-1] < LONG_S:
        steps = math.ceil(math.log(LONG_S / more.times[-1], 4))
        spp = more.pass_spp * 4**steps
        if spp > most:
            break
        more = _warm(half, spp, size)
    if more is fewer:  # a slow scene, or a large film
        more = _warm(half, 4 * FEWEST_SPP, size)
    return fewer, more


def _warm(half: Renderer, spp: int, size: Size) -> Renderer:
    """Return a half with some samples per pixel, which is warm."""
    renderer = half.sampled(spp)
    warm(renderer, size)
    return renderer
