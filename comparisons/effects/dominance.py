"""Which effect dominates where: the one that removes most of the error there."""

import numpy as np

LEAST = 1.0
"""ΔE2000: what removes less cannot be seen, and does not dominate."""

ALSO = 0.5
"""Of what the first effect removes: a second one that removes as much is named beside it."""

NONE, UNCOUNTED = -1, -2


def dominating(effects, counted):
    """Return (H, W): the place of the dominating effect among the effects.

    :data:`NONE` where none removes :data:`LEAST`, :data:`UNCOUNTED` where a pixel does not count.

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


def in_region(region, resolution, effects):
    """Return the effect that removes most in a region, in words; None where none does.

    Parameters
    ----------
    region : comparisons.departure.regions.Region
        The region.
    resolution
        ``(width, height)`` of the image that the region is of; the maps may be smaller.
    effects
        ``{name: (H, W)}``: the ΔE2000 that each removes.
    """
    return in_words({n: _mean(values, region, resolution) for n, values in effects.items()})


def in_words(means):
    """Return the effect of the largest mean ``{name: ΔE2000}``, and a second one that has half.

    None where no mean reaches :data:`LEAST`.
    """
    first, *others = sorted(means, key=means.get, reverse=True) or [None]
    if first is None or means[first] < LEAST:
        return None
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
