"""Time of a sample: methods take turns, and their kernels are timed.

A picture takes an overhead and a time per sample. The kernels of a picture, timed by Dr.Jit, are
the time of its samples; the rest of the picture's time, such as that of Python, is the overhead. So
one number of samples is enough, and its kernel serves all others.

In each turn every method renders one picture, in alternating order. Other work on the machine slows
those that are next to each other alike, so a ratio is the median of the ratios of the turns. The
first turn, which traces and compiles, is left out. Intervals are order statistics of the turns: the
median lies between the least and the largest of n with a chance of ``1 − 2^(1 − n)``. With fewer
turns than `FEWEST_TURNS` that is too little, and they are Student's. What no turn shows, such as
where the memory of a process lies, moves a time by :data:`UNSEEN`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import hypot, log2, sqrt
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fotismos.heuristic.convention import Floats
from fotismos.reference.records import Interval
from fotismos.reference.rendering.gbuffer import size_of_width
from fotismos.reference.rendering.passes import Progress, Size, Stream, passes
from fotismos.reference.rendering.renderer import Renderer
from fotismos.reference.rendering.sums import student

TURNS = 7
"""Turns that are timed."""

FEWEST_TURNS = 6
"""Turns from which on the least and the largest hold the median with 95 %."""

MOST_PIXELS = 2**12
"""Pixels of a timed picture, at most: larger films are reduced."""

MOST_SAMPLES = 2**18
"""Samples of a timed picture, unless its kernels are too short."""

LONG_S = 4e-3
"""Seconds that the shortest kernels take, about: threads take a part of one to wake up."""

MOST_LONGER = 16
"""How many times as long they may be, and how many times the samples short ones may have."""

LEAST_S = 1e-9
"""Seconds that kernels take at least."""

UNSEEN = 0.02
"""Half an interval of a time, at least, as a share of it: from one process to another."""


@dataclass(frozen=True)
class Time:
    """Seconds of a method in each of T turns, (T,): of a sample, and of a picture beside them.

    ``processors`` worked at its kernels at once, in the median of the turns; one at the rest.
    """

    per_sample: Floats
    overhead: Floats
    processors: float

    @classmethod
    def of(cls, renderer: Renderer, size: Size, turns: int) -> Time:
        """Return the time of the last turns of a renderer, with pictures of a size."""
        # Above 0, because other times are divided by it.
        kernels = np.maximum(renderer.kernel_times[-turns:], LEAST_S)
        whole = np.array(renderer.times[-turns:])
        busy = np.array(renderer.processor_times[-turns:])
        return cls(
            per_sample=kernels / (renderer.pass_spp * size[0] * size[1]),
            overhead=np.maximum(whole - kernels, 0.0),
            processors=max(float(np.median((busy - whole + kernels) / kernels)), 0.0),
        )


def timed_size(renderer: Renderer) -> tuple[Size, int]:
    """Return the size of a renderer's timed pictures, and their samples per pixel, a power of 2."""
    columns, rows = renderer.size
    size = renderer.size
    if columns * rows > MOST_PIXELS:
        width = max(1, int(sqrt(MOST_PIXELS * columns / rows)))
        size = size_of_width(renderer.scene, size, width)
    return size, timed_spp(size)


def timed_spp(size: Size) -> int:
    """Return the samples per pixel of a timed picture: powers of 2 share a kernel."""
    most = max(1, MOST_SAMPLES // (size[0] * size[1]))
    return int(2 ** (most.bit_length() - 1))


def in_turn(
    renderers: Mapping[str, Renderer],
    seed: int,
    turns: int,
    *,
    size: Size | None = None,
    progress: Progress | None = None,
) -> Iterator[dict[str, Any]]:
    """Yield the pictures of each turn, and of one before them, by the names of their methods."""
    loop = passes(
        [*renderers.values()],
        seed,
        turns + 1,
        size=size,
        stream=Stream.PRICE,
        progress=progress,
        stage="timing",
    )
    for images in loop:
        yield dict(zip(renderers, images, strict=True))


def timed(
    halves: Mapping[str, Renderer], seed: int, size: Size, progress: Progress | None = None
) -> dict[str, Time]:
    """Return the times of methods that have taken some turns, from more of them.

    The pictures have so many samples that the shortest kernels are neither too short nor far longer
    than need be; the same kernels serve all numbers of samples.
    """
    spp = min(half.pass_spp for half in halves.values())
    shortest = min(min(half.kernel_times) for half in halves.values())
    # Beside other work kernels take longer than they need, and few samples would be too few.
    wanted = min(max(shortest, LONG_S), MOST_LONGER * LONG_S)
    steps = round(log2(wanted / max(shortest, LONG_S / MOST_LONGER)))
    enough = max(1, int(spp * 2.0**steps))
    if enough != spp:
        halves = {name: half.sampled(enough) for name, half in halves.items()}
    done = min(len(half.kernel_times) for half in halves.values())
    for _ in in_turn(halves, seed, TURNS - done, size=size, progress=progress):
        pass
    return {name: Time.of(half, size, TURNS) for name, half in halves.items()}


def middle(values: ArrayLike, unseen: float = 0.0) -> Interval:
    """Return the median of turns with a 95 % interval, at least ``unseen`` to each side."""
    ordered = np.sort(np.asarray(values, float))
    count = len(ordered)
    value = float(np.median(ordered))
    below = value - float(ordered[0])
    above = float(ordered[-1]) - value
    if count < FEWEST_TURNS:
        error = float(np.std(ordered, ddof=1)) / sqrt(count)
        below = above = student(0.0, error, count).high
    # What turns show and what they cannot show are independent: squares add up.
    return Interval(
        value=value, low=value - hypot(below, unseen), high=value + hypot(above, unseen)
    )


def ratio(time: Time, to: Time) -> Interval:
    """Return a time per sample over another's, from the same turns."""
    values = time.per_sample / to.per_sample
    return middle(values, 0.0 if time is to else UNSEEN * float(np.median(values)))
