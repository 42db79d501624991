"""Find where the departure is largest: the few boxes of an image with most of its error.

The worth of a box is its error less `CONTRAST` times the image's mean for each of its counted
pixels. The box of greatest worth is found exactly on a grid of cells (the maximum-sum subarray in
two dimensions: Kadane's algorithm over the columns, for all pairs of rows). Its cells are then
removed, and the search repeats. So boxes never overlap, their shares add up to at most 1, and
evenly spread error has none.
"""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from msgspec import Meta
from numpy.typing import ArrayLike, NDArray

from comparisons.effects.nearness import Nearest
from comparisons.records import Amount, Count, Record, Share, Size

CELLS = 48
"""Cells along the longer side of the image."""

CONTRAST = 1.25
"""A region's mean error must exceed this many times the image's."""

MOST, LEAST_SHARE = 4, 0.04
"""Number of regions, at most, and the least share of the image's error in each."""


class Region(Record):
    """A box of pixels: x, y count from the top left, and include the first pixel."""

    x: Count
    y: Count
    width: Size
    height: Size
    share: Annotated[Share, Meta(description="Of the sum of dE2000 over the counted pixels.")]
    mean_dE2000: Annotated[Amount, Meta(description="Over the box's counted pixels.")]
    effect: Annotated[
        str | None, Meta(description="The dominant effect there, in words, if known.")
    ] = None
    nearest: Annotated[
        Nearest | None, Meta(description="The rendering that a picture is nearest to there.")
    ] = None


def find(error: ArrayLike, counted: ArrayLike) -> tuple[Region, ...]:
    """Return the regions of a map of ΔE2000 (H, W) ≥ 0, of greatest worth first.

    Only pixels of `counted` (H, W) matter. Without error there are no regions.
    """
    counted = np.asarray(counted, bool)
    error = np.where(counted, np.asarray(error), 0.0)
    total, pixels = error.sum(dtype=np.float64), counted.sum()
    if not total > 0.0:
        return ()
    cell = -(-max(error.shape) // CELLS)
    worth = _cells(error, cell) - CONTRAST * total / pixels * _cells(counted, cell)
    found: list[Region] = []
    while len(found) < MOST:
        rows, columns, value = _best_box(worth)
        if not value > 0.0:
            break
        worth[rows, columns] = -total  # no box that touches these is worth anything
        region = _region(error, counted, _pixels(rows, cell), _pixels(columns, cell), total)
        if region.share >= LEAST_SHARE:
            found.append(region)
        elif value < LEAST_SHARE * total / MOST:  # only specks are left
            break
    return tuple(found)


def _cells(image: NDArray, side: int) -> NDArray[np.float64]:
    """Return sums over square cells; those at the right and the bottom may be smaller."""
    rows = np.add.reduceat(image.astype(np.float64), np.arange(0, image.shape[0], side), axis=0)
    return np.add.reduceat(rows, np.arange(0, image.shape[1], side), axis=1)


def _best_box(worth: NDArray[np.float64]) -> tuple[slice, slice, float]:
    """Return the box of cells with the greatest sum, the first of equal ones, and the sum."""
    below = np.vstack([np.zeros(worth.shape[1]), worth.cumsum(axis=0)])
    top, bottom = np.triu_indices(len(below), 1)
    strips = below[bottom] - below[top]  # a row for each pair: the sums of its columns
    running = np.full(len(strips), -np.inf)
    start = np.zeros(len(strips), int)
    best = (-np.inf, 0, 0, 0)
    for column, strip in enumerate(strips.T):
        fresh = running <= 0.0
        running, start = np.where(fresh, strip, running + strip), np.where(fresh, column, start)
        pair = int(running.argmax())
        best = max(best, (float(running[pair]), pair, int(start[pair]), column), key=_first)
    value, pair, first, last = best
    return slice(int(top[pair]), int(bottom[pair])), slice(first, last + 1), value


def _first(candidate: tuple) -> float:
    return candidate[0]


def _pixels(cells: slice, side: int) -> slice:
    return slice(cells.start * side, cells.stop * side)


def _region(error: NDArray, counted: NDArray, rows: slice, columns: slice, total: float) -> Region:
    """Return the region of a box, shrunk to its counted pixels."""
    inside = np.zeros_like(counted)
    inside[rows, columns] = counted[rows, columns]
    held = error[rows, columns].sum(dtype=np.float64)
    return Region(
        share=float(held / total), mean_dE2000=float(held / inside.sum()), **bounds(inside)
    )


def bounds(mask: NDArray) -> dict[str, Any]:
    """Return ``x, y, width, height`` of the box around a mask (H, W) of at least one pixel."""
    y, x = (np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0))
    width, height = int(x[-1] - x[0] + 1), int(y[-1] - y[0] + 1)
    return {"x": int(x[0]), "y": int(y[0]), "width": width, "height": height}
