"""Find where the departure is largest: in which boxes of the image, shapes and materials.

The worth of a box is its error less `CONTRAST` times the image's mean for each of its counted
pixels. The box of greatest worth is found exactly on a grid of cells (the maximum-sum subarray in
two dimensions: Kadane's algorithm over the columns, for all pairs of rows). Its cells are then
removed, and the search repeats. So boxes never overlap, their shares add up to at most 1, and
evenly spread error has none.

Every counted pixel belongs to the first surface that the ray through its centre hits, so the shares
of all shapes add up to 1, as do the shares of all materials.
"""

from __future__ import annotations

from operator import itemgetter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fotismos.comparisons.departure.blocks import block_sums
from fotismos.comparisons.records.departure import ObjectShare, Region
from fotismos.heuristic.convention import Floats

if TYPE_CHECKING:  # pictures have no objects, and need no Mitsuba
    from fotismos.reference.rendering.gbuffer import ObjectIds

CELLS = 48
"""Cells along the longer side of the image."""

CONTRAST = 1.25
"""A region's mean error must exceed this many times the image's."""

MOST_REGIONS = 4
LEAST_SHARE = 0.04
"""Number of regions, at most, and the least share of the image's error in each."""

MOST_OBJECTS = 24
"""Rows of objects; if there are more, the last row holds all others."""


def worst_pixel(error: ArrayLike, counted: ArrayLike) -> tuple[int, int]:
    """Return column and row of the counted pixel with the largest of a map of ΔE2000 (H, W)."""
    row, column = np.unravel_index(np.argmax(np.where(counted, error, -1.0)), np.shape(error))
    return int(column), int(row)


def find(error: ArrayLike, counted: ArrayLike) -> tuple[Region, ...]:
    """Return the regions of a map of ΔE2000 (H, W) ≥ 0, of greatest worth first.

    Only pixels of `counted` (H, W) matter. Without error there are no regions.
    """
    counted = np.asarray(counted, bool)
    error = np.where(counted, np.asarray(error), 0.0)
    total = error.sum(dtype=np.float64)
    pixels = counted.sum()
    if not total > 0.0:
        return ()
    cell = -(-max(error.shape) // CELLS)
    sums = block_sums(error.astype(np.float64), cell)
    sizes = block_sums(counted.astype(np.float64), cell)
    worth = sums - CONTRAST * total / pixels * sizes
    boxes: list[Region] = []
    while len(boxes) < MOST_REGIONS:
        rows, columns, value = _best_box(worth)
        if not value > 0.0:
            break
        worth[rows, columns] = -total  # no box that touches these is worth anything
        down = slice(rows.start * cell, rows.stop * cell)
        across = slice(columns.start * cell, columns.stop * cell)
        inside = np.zeros_like(counted)
        inside[down, across] = counted[down, across]
        amount = error[down, across].sum(dtype=np.float64)
        share = float(amount / total)
        if share >= LEAST_SHARE:
            mean = float(amount / inside.sum())
            boxes.append(Region(share=share, mean_dE2000=mean, **bounds(inside)))
        elif value < LEAST_SHARE * total / MOST_REGIONS:  # only specks are left
            break
    return tuple(boxes)


def _best_box(worth: NDArray[np.float64]) -> tuple[slice, slice, float]:
    """Return the box of cells with the greatest sum, the first of equal ones, and the sum."""
    # Sums of all rows above each edge: a strip is the difference of two.
    below = np.vstack([np.zeros(worth.shape[1]), worth.cumsum(axis=0)])
    top, bottom = np.triu_indices(len(below), 1)
    strips = below[bottom] - below[top]  # a row for each pair: the sums of its columns
    running = np.full(len(strips), -np.inf)
    start = np.zeros(len(strips), int)
    best = (-np.inf, 0, 0, 0)
    # For each strip the best sum that ends at this column; after a loss it begins here.
    for column, strip in enumerate(strips.T):
        fresh = running <= 0.0
        running = np.where(fresh, strip, running + strip)
        start = np.where(fresh, column, start)
        pair = int(running.argmax())
        best = max(best, (float(running[pair]), pair, int(start[pair]), column), key=itemgetter(0))
    value, pair, first, last = best
    return slice(int(top[pair]), int(bottom[pair])), slice(first, last + 1), value


def bounds(mask: NDArray[np.bool_]) -> dict[str, Any]:
    """Return ``x, y, width, height`` of the box around a mask (H, W) of at least one pixel."""
    y = np.flatnonzero(mask.any(axis=1))
    x = np.flatnonzero(mask.any(axis=0))
    width = int(x[-1] - x[0] + 1)
    height = int(y[-1] - y[0] + 1)
    return {"x": int(x[0]), "y": int(y[0]), "width": width, "height": height}


def find_objects(
    error: Floats, counted: NDArray[np.bool_], owners: ObjectIds, materials: ObjectIds | None = None
) -> tuple[tuple[ObjectShare, ...], NDArray[np.int_]]:
    """Return each object's share in a map of ΔE2000 (H, W), largest first, and a map of them.

    The map (H, W) holds the index of each pixel's object, or -1 if the pixel does not count. If
    ``materials`` is given, the objects are shapes with their materials.
    """
    numbers = np.where(counted, owners.places, -1)
    owned = numbers >= 0
    present = np.unique(numbers[owned])
    sums = np.bincount(numbers[owned], error[owned], len(owners.names))
    ranked = sorted(present, key=lambda index: -sums[index])
    if len(ranked) > MOST_OBJECTS:
        ranked = ranked[: MOST_OBJECTS - 1]
    # The row of each owner; the last entry is what a number of −1 indexes.
    # Owners without a row of their own share the one after the ranked ones.
    rows = np.full(len(owners.names) + 1, len(ranked))
    rows[ranked] = np.arange(len(ranked))
    rows[-1] = -1
    row_of_pixel = rows[numbers]
    names = [owners.names[index] for index in ranked]
    if len(present) > len(names):
        names.append(f"{len(present) - len(names)} others")
    total = error[counted].sum(dtype=np.float64)
    return tuple(
        _object_share(name, error, mask=row_of_pixel == row, total=total, materials=materials)
        for row, name in enumerate(names)
    ), row_of_pixel


def _object_share(
    name: str, error: Floats, mask: NDArray[np.bool_], total: float, materials: ObjectIds | None
) -> ObjectShare:
    amount = error[mask].sum(dtype=np.float64)
    return ObjectShare(
        name=name,
        material=_material(mask, materials) if materials else "",
        pixels=int(mask.sum()),
        share=float(amount / total) if total > 0 else 0.0,
        mean_dE2000=float(amount / mask.sum()),
        **bounds(mask),
    )


def _material(mask: NDArray[np.bool_], materials: ObjectIds) -> str:
    here = np.unique(materials.places[mask])
    return materials.names[here[0]] if len(here) == 1 else "several"
