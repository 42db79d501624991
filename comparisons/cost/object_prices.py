"""The price of an effect on each shape: how much of the departure there it removes.

A shape's price is the mean, over the pixels that see the shape, of what the effect removes in each
pixel (:mod:`comparisons.effects.prices`). So the prices of all shapes, weighted by their pixels,
average to the price in the whole image.
"""

from numpy.typing import NDArray

from comparisons import intervals
from comparisons.cost.cost_record import ObjectPrice
from comparisons.departure.objects import find, means
from comparisons.effects.prices import Priced
from reference.rendering.gbuffer import Owners


def object_prices(priced: Priced, counted: NDArray, owners: Owners) -> tuple[ObjectPrice, ...]:
    """Return the prices on each shape, the one with most of the departure first.

    Parameters
    ----------
    priced
        What each effect removes, by pixel and replicate.
    counted
        (H, W): the pixels that count.
    owners
        The shapes that the pixels see.
    """
    carriers, places = find(priced.departure, counted, owners)
    rows, count = places[counted], len(carriers)
    removed = [means(each, rows, count) for each in priced.removed.values()]
    left = means(priced.left[counted], rows, count)
    return tuple(
        ObjectPrice(
            name=carrier.name,
            pixels=carrier.pixels,
            share=carrier.share,
            departure=carrier.mean_dE2000,
            removes=tuple(intervals.jackknifed(each[:, row]) for each in removed),
            left=float(left[row]),
        )
        for row, carrier in enumerate(carriers)
    )
