"""Passes of several sources in turn: renderers, or pictures that were read.

Both halves of a pair are rendered pass by pass, in turn, with the same sampler and seed: their
camera rays, pixel filter and edges cancel in the difference, and a drift of the machine affects
both. Passes are independent, and give the standard errors.
"""

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import AbstractContextManager
from enum import IntEnum
from typing import Any, Protocol

import numpy as np

from fotismos.heuristic.errors import NonFiniteError
from fotismos.reference.records import Times

LARGEST_VALUE = 1e18
"""In units of display white: squares of differences must not overflow in single precision."""

Size = tuple[int, int]
"""Width and height in pixels."""

Progress = Callable[[str, int, int], None]
"""Called as ``progress(stage, done, total)``."""


class Stream(IntEnum):
    """The purpose of passes; passes of different streams are independent at any seed."""

    COMPARED = 0
    OTHER_SIDE = 1
    REPLICATES = 2
    PROBE = 3
    PRICE = 4


class PassSource(Protocol):
    """A source of passes: independent images of one half, each (H, W, 3), linear."""

    @property
    def variant(self) -> str:
        """The Mitsuba variant in which it renders, empty if it does not."""

    @property
    def size(self) -> Size:
        """Width and height of its passes in pixels, unless another size is asked for."""

    @property
    def times(self) -> list[float]:
        """The seconds of the passes so far."""

    @property
    def preparation(self) -> float:
        """The seconds in which it was prepared, which are not of a pass."""

    def active(self) -> AbstractContextManager[None]:
        """Return a context in which its passes need no other preparation."""

    def passes(
        self, count: int, size: Size | None = None, stream: Stream = Stream.COMPARED, seed: int = 0
    ) -> Iterator[Any]:
        """Yield ``count`` passes of a size, which is its own if omitted."""

    def pass_times(self) -> Times:
        """Return the times of the passes so far."""


def pass_seed(seed: int, number: int, stream: Stream = Stream.COMPARED) -> int:
    """Return the seed of a pass: 32 bits, hashed from a run's seed, the stream and the pass.

    Both halves take the same, so their camera rays cancel; runs of other seeds share no pass.
    """
    sequence = np.random.SeedSequence(seed, spawn_key=(int(stream), number))
    return int(sequence.generate_state(1)[0])


def passes(
    sources: Sequence[PassSource],
    seed: int,
    count: int,
    *,
    size: Size | None = None,
    stream: Stream = Stream.COMPARED,
    progress: Progress | None = None,
    stage: str = "rendering",
) -> Generator[tuple[Any, ...], None, None]:
    """Yield ``count`` passes of all sources, each as it is done: an image of each source.

    The order of the sources alternates, so that none always pays for a pause before a pass.
    ``progress`` is called before each pass, and once more when all are done or the caller stops.
    """
    streams = [source.passes(count, size, stream, seed) for source in sources]
    done = 0
    try:
        for number in range(count):
            if progress:
                progress(stage, number, count)
            images = _images(sources, streams, backwards=number % 2 == 1)
            done = number + 1
            yield images
            del images  # else they would stay alongside the next ones
    finally:
        if progress:
            progress(stage, done, done)


def _images(
    sources: Sequence[PassSource], streams: Sequence[Iterator[Any]], backwards: bool
) -> tuple[Any, ...]:
    """Take the next image of each, grouped by variant: a change takes as long as a small image."""
    order = list(range(len(sources)))
    if backwards:
        order.reverse()
    groups: dict[str, list[int]] = {}
    for index in order:
        groups.setdefault(sources[index].variant, []).append(index)
    images: dict[int, Any] = {}
    for group in groups.values():
        with sources[group[0]].active():
            for index in group:
                images[index] = next(streams[index])
    return tuple(images[index] for index in range(len(sources)))


def require_finite(image: np.ndarray, layer: str, warnings: Sequence[str] = ()) -> None:
    """Raise `NonFiniteError` if an image (H, W) or (H, W, C) holds a NaN or an infinity.

    ``warnings`` of the scene come first as causes.
    """
    if not np.isfinite(image).all():
        wrong = wrong_pixels(image, np.isfinite(image), "NaN or infinite")
        usual = (
            "Look at the surface and the lights seen there: an infinite light or a degenerate mesh"
            " is the usual cause."
        )
        raise NonFiniteError(f"{layer}: {wrong}. {' '.join(warnings) or usual}")


def wrong_pixels(image: Any, right: Any, what: str) -> str:
    """Return how many pixels are wrong, and the first as (x, y), in reading order from top left."""
    wrong = ~right if right.ndim == 2 else ~right.all(axis=-1)
    pixel = np.unravel_index(np.argmax(wrong), wrong.shape)
    return (
        f"{np.count_nonzero(wrong)} of {wrong.size} pixels are {what}, the first at (x, y) ="
        f" ({', '.join(str(index) for index in reversed(pixel))}): {np.asarray(image)[pixel]}"
    )
