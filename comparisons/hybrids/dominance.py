"""Which effect dominates where: the one that removes most of the error there."""

from collections.abc import Mapping

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from comparisons.comparison import Comparison, ComparisonRecord
from comparisons.departure.regions import Region, means

LEAST = 1.0
"""ΔE2000: an effect that removes less cannot be seen, and does not dominate."""

ALSO = 0.5
"""Share of what the first effect removes: a second one that removes as much is named too."""

NONE, UNCOUNTED = -1, -2


def dominating(effects: Mapping[str, NDArray], counted: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return (H, W): the place of the dominating effect among ``{name: ΔE2000 removed (H, W)}``.

    :data:`NONE` if no effect removes :data:`LEAST`, :data:`UNCOUNTED` if a pixel does not count.
    """
    places = np.full(counted.shape, NONE)
    if effects:
        removed = np.stack(list(effects.values()))
        places = np.where(removed.max(axis=0) >= LEAST, removed.argmax(axis=0), NONE)
    return np.where(counted, places, UNCOUNTED)


def named(comparison: Comparison, effects: Mapping[str, NDArray]) -> ComparisonRecord:
    """Return a comparison's record in which regions, shapes and materials name their effect.

    ``effects`` are ``{name: (h, w)}``, the ΔE2000 that each removes; the maps may be smaller.
    """
    record, images = comparison.record, comparison.images
    regions = tuple(
        structs.replace(region, effect=in_region(region, record.resolution, effects))
        for region in record.regions
    )

    def each(objects, places):
        """Name the effects by the maps' cell in which each pixel of an object lies."""
        seen = places >= 0
        found = {
            name: means(_enlarged(values, places.shape)[seen], places[seen], len(objects))
            for name, values in effects.items()
        }
        return tuple(
            structs.replace(one, effect=_in_words({name: of[row] for name, of in found.items()}))
            for row, one in enumerate(objects)
        )

    return structs.replace(
        record,
        regions=regions,
        objects=each(record.objects, images.objects),
        materials=each(record.materials, images.materials),
    )


def in_region(
    region: Region, resolution: tuple[int, int], effects: Mapping[str, NDArray]
) -> str | None:
    """Return the effect that removes most in a region, in words; None if none dominates.

    ``resolution`` is ``(width, height)`` of the region's image; the maps may be smaller.
    """
    found = {}
    for name, values in effects.items():
        height, width = values.shape
        columns = _cells(region.x, region.width, width / resolution[0])
        rows = _cells(region.y, region.height, height / resolution[1])
        found[name] = float(values[rows, columns].mean())
    return _in_words(found)


def _in_words(found: Mapping[str, float]) -> str | None:
    """Return the effect of the largest mean ``{name: ΔE2000}``, and a second one that has half.

    None if no mean reaches :data:`LEAST`.
    """
    ordered = sorted(found, key=lambda name: found[name], reverse=True)
    if not ordered or found[ordered[0]] < LEAST:
        return None
    first, *others = ordered
    if others and found[others[0]] >= max(ALSO * found[first], LEAST):
        return f"{first}, then {others[0]}"
    return first


def _cells(start, length, scale):
    first = int(start * scale)
    return slice(first, max(first + 1, int(np.ceil((start + length) * scale))))


def _enlarged(values, shape):
    rows, columns = (
        np.arange(large) * small // large for large, small in zip(shape, values.shape, strict=True)
    )
    return values[np.ix_(rows, columns)]
