"""The one loop that renders: passes of several renderers in turn.

In turn, so a drift of the machine affects all equally. All renderers take the same seed for a pass:
their camera rays are the same, and pixel filter and edges cancel in a difference.
"""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np

from reference.rendering.renderer import Renderer, variant

Progress = Callable[[str, int, int], None]
"""Called as ``progress(stage, done, total)``."""


class Stream(IntEnum):
    """The purpose of passes; passes of different streams are independent at any seed."""

    COMPARED = 0
    OTHER_SIDE = 1
    REPLICATES = 2
    PROBE = 3


def pass_seed(seed: int, number: int, stream: Stream = Stream.COMPARED) -> int:
    """Return the seed of a pass: 32 bits, hashed from a run's seed, the stream and the pass.

    Both halves, and all compared methods, take the same seed for a pass. So their camera rays
    cancel, while runs of different seeds have no pass in common.
    """
    sequence = np.random.SeedSequence(seed, spawn_key=(int(stream), number))
    return int(sequence.generate_state(1)[0])


@dataclass(frozen=True)
class Pass:
    """One pass: its number from 0, its seed, and an image (H, W, 3) of each renderer."""

    number: int
    seed: int
    images: tuple


def passes(
    renderers: Sequence[Renderer],
    seed: int,
    count: int,
    *,
    stream: Stream = Stream.COMPARED,
    progress: Progress | None = None,
    stage: str = "rendering",
) -> Generator[Pass, None, None]:
    """Render ``count`` passes of each renderer, in its own variant, and yield each as it is done.

    ``progress`` is called before each pass, and once more when all are done or the caller stops.
    """
    done = 0
    try:
        for number in range(count):
            if progress:
                progress(stage, number, count)
            own = pass_seed(seed, number, stream)
            made = Pass(number, own, _images(renderers, own))
            done = number + 1
            yield made
            del made  # else its images would stay alongside the next ones
    finally:
        if progress:
            progress(stage, done, done)


def _images(renderers: Sequence[Renderer], seed: int) -> tuple:
    """Render one pass, grouped by variant: a change takes as long as a small image."""
    images: dict[int, Any] = {}
    for name in dict.fromkeys(renderer.variant for renderer in renderers):
        with variant(name):
            for place, renderer in enumerate(renderers):
                if renderer.variant == name:
                    images[place] = renderer.render(seed)
    return tuple(images[place] for place in range(len(renderers)))
