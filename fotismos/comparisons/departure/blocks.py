"""Blocks of pixels: sums, neighbourhoods, and values spread over the pixels again."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from fotismos.comparisons.departure.colour import Array
from fotismos.reference.rendering.sums import BLOCK

# Rows processed at a time, in whole blocks, to keep temporaries small.
_ROWS = 32 * BLOCK


def bands(height: int) -> Iterator[slice]:
    """Yield slices of rows, all but the last of whole blocks."""
    return (slice(start, min(start + _ROWS, height)) for start in range(0, height, _ROWS))


def block_sums(image: NDArray[Any], side: int = BLOCK) -> Array:
    """Return block sums (h, w, ...) of an image (H, W, ...); edge blocks may be smaller."""
    rest = len(image) % side
    whole = image[: len(image) - rest].reshape(-1, side, *image.shape[1:])
    # Whole rows first: adding them needs no gathering.
    rows = whole.sum(axis=1, dtype=np.float64)
    if rest:
        last = image[-rest:].sum(axis=0, keepdims=True, dtype=np.float64)
        rows = np.concatenate([rows, last])
    return np.add.reduceat(rows, np.arange(0, image.shape[1], side), axis=1)


def neighbourhood(values: Array, first: int = 0) -> Array:
    """Return sums of each block (h, w, ...) and its eight neighbours; `first` is the row axis."""
    around = [(0, 0)] * values.ndim
    around[first : first + 2] = [(1, 1), (1, 1)]
    # A frame of zeros: blocks at the edge have fewer neighbours in their sum.
    padded = np.pad(values, around)
    windows = np.lib.stride_tricks.sliding_window_view(padded, (3, 3), (first, first + 1))
    return np.asarray(windows.sum(axis=(-2, -1)))


def spread_out(values: NDArray[Any], shape: tuple[int, ...]) -> NDArray[Any]:
    """Return an image of this shape (H, W, ...) with each block's value (h, w, ...)."""
    return values.repeat(BLOCK, axis=0).repeat(BLOCK, axis=1)[: shape[0], : shape[1]]


def ratio(above: Array, below: Array) -> Array:
    """Return ``above / below``, 0 where ``below`` is not positive."""
    above, below = np.broadcast_arrays(above, below)
    return np.divide(above, below, out=np.zeros(above.shape), where=below > 0.0)


def shrunk(sides: Sequence[int], longest: int) -> tuple[int, int]:
    """Return two sides of the same shape, of which the longer one is at most ``longest``."""
    scale = min(1.0, longest / max(sides))
    first, second = sides
    return max(1, round(scale * first)), max(1, round(scale * second))


def averaged(image: NDArray[np.floating], shape: Sequence[int]) -> Array:
    """Average an image (H, W, 3) down to ``shape``, whose first sides are height and width."""
    height, width = shape[:2]
    # Pillow resizes single channels of floats, but no images of three.
    planes = [Image.fromarray(image[..., channel].astype(np.float32)) for channel in range(3)]
    small = [plane.resize((width, height), Image.Resampling.BOX) for plane in planes]
    return np.stack([np.asarray(plane, float) for plane in small], axis=-1)
