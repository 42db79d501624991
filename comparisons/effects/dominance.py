"""Which effect dominates where: the one that removes most of the error there."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from comparisons.departure.regions import Region

LEAST = 1.0
"""ΔE2000: an effect that removes less cannot be seen, and does not dominate."""

ALSO = 0.5
"""Share of what the first effect removes: a second one that removes as much is named too."""

NONE, UNCOUNTED = -1, -2


def dominating(effects: Mapping[str, NDArray], counted: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return (H, W): the place of the dominating effect among the effects.

    :data:`NONE` if no effect removes :data:`LEAST`, :data:`UNCOUNTED` if a pixel does not count.

    Parameters
    ----------
    effects
        ``{name: (H, W)}``: the ΔE2000 that each removes.
    counted
        (H, W): the pixels that count.
    """
    places = np.full(counted.shape, NONE)
    if effects:
        removed = np.stack(list(effects.values()))
        places = np.where(removed.max(axis=0) >= LEAST, removed.argmax(axis=0), NONE)
    return np.where(counted, places, UNCOUNTED)


def in_region(
    region: Region, resolution: tuple[int, int], effects: Mapping[str, NDArray]
) -> str | None:
    """Return the effect that removes most in a region, in words; None if none dominates.

    Parameters
    ----------
    region
        The region.
    resolution
        ``(width, height)`` of the region's image; the maps may be smaller.
    effects
        ``{name: (H, W)}``: the ΔE2000 that each removes.
    """
    return in_words({n: _mean(values, region, resolution) for n, values in effects.items()})


def in_words(means: Mapping[str, float]) -> str | None:
    """Return the effect of the largest mean ``{name: ΔE2000}``, and a second one that has half.

    None if no mean reaches :data:`LEAST`.
    """
    ordered = sorted(means, key=lambda name: means[name], reverse=True)
    if not ordered or means[ordered[0]] < LEAST:
        return None
    first, *others = ordered
    if others and means[others[0]] >= max(ALSO * means[first], LEAST):
        return f"{first}, then {others[0]}"
    return first


def _mean(values, region, resolution):
    """Mean of a map over a region, by the cells that it touches."""
    height, width = values.shape
    columns = _cells(region.x, region.width, width / resolution[0])
    rows = _cells(region.y, region.height, height / resolution[1])
    return float(values[rows, columns].mean())


def _cells(start, length, scale):
    first = int(start * scale)
    return slice(first, max(first + 1, int(np.ceil((start + length) * scale))))
