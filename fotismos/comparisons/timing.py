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

A study of cost (:mod:`fotismos.comparisons.cost.measure`) times methods so.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fotismos.heuristic.convention import Floats
from fotismos.reference.records import Interval

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
