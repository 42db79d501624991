"""How long a sample of the physical half takes, compared with one of the textbook half.

The halves of a pass are rendered one after the other, and the order alternates: after a pause the
processor's threads are asleep, and whichever half comes first pays for waking them.
"""

from collections.abc import Sequence

import numpy as np

from fotismos.reference.records import Interval, Missing
from fotismos.reference.rendering.renderer import Renderer, passes
from fotismos.reference.rendering.sums import student

WARM = 1
"""Passes that do not count: the first one compiles, or wakes the threads."""

FEWEST = 3
MOST = 48
"""Pairs of passes that make a ratio."""

BATCHES = 6
"""Groups of pairs, of each of which the shortest passes count: other work only ever adds time."""

BUDGET_S = 1.0
"""If enough pairs take less, they are timed again without a pause in between."""

WIDEST = 0.3
"""The widest interval that a ratio may have, over the ratio."""

TOO_FEW = Missing("too few passes to time")
TOO_WIDE = Missing("passes too short, or the machine too busy, to time within 30 %")
NOT_TIMED = Missing("a picture's time is not known")


def measure(heuristic: Renderer, reference: Renderer, seed: int) -> Interval | Missing:
    """Return the ratio of the times of both halves, physical over textbook.

    Both have rendered the same passes in turns
    (:func:`fotismos.reference.rendering.renderer.passes`).
    """
    halves = (heuristic, reference)
    count = min(MOST, int(BUDGET_S / np.add(heuristic.times, reference.times).min()))
    if count >= FEWEST:
        halves = (heuristic.sampled(heuristic.pass_spp), reference.sampled(reference.pass_spp))
        for _ in passes(halves, seed, WARM + count):
            pass
    return ratio(halves[0].times[WARM:], halves[1].times[WARM:])


def ratio(heuristic: Sequence[float], reference: Sequence[float]) -> Interval | Missing:
    """Return the geometric mean of the batches' ratios with its interval."""
    if len(heuristic) < FEWEST:
        return TOO_FEW
    count = min(BATCHES, len(heuristic))
    shortest_h = [batch.min() for batch in np.array_split(np.array(heuristic), count)]
    shortest_r = [batch.min() for batch in np.array_split(np.array(reference), count)]
    logarithms = np.log(np.divide(shortest_r, shortest_h))
    error = float(logarithms.std(ddof=1)) / len(logarithms) ** 0.5
    interval = student(float(logarithms.mean()), error, len(logarithms))
    value, low, high = np.exp([interval.value, interval.low, interval.high]).tolist()
    if high - low > WIDEST * value:
        return TOO_WIDE
    return Interval(value=value, low=low, high=high)
