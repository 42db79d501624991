"""Prices of effects at a requested size, from those at the study's size and at half of it.

The ΔE2000 that an effect removes is linear in ``1 / width``, as errors are; the time that it adds
is linear in the number of pixels.
"""

from collections.abc import Sequence
from math import hypot

from comparisons.cost.cost_record import AskedPrice, Prices
from comparisons.cost.prediction.target import Size
from comparisons.records import Estimated


def at_size(
    smaller: Prices, larger: Prices, sizes: tuple[Size, Size], target: Size
) -> tuple[AskedPrice, ...]:
    """Return the price of each effect at a size.

    Parameters
    ----------
    smaller, larger
        Prices with the same samples per pixel at the two ``sizes``.
    target
        The requested width and height.
    """
    edges, pixels = (
        _reach([1 / width for width, _ in (*sizes, target)]),
        _reach([width * height for width, height in (*sizes, target)]),
    )
    return tuple(
        AskedPrice(
            effect=after.effect,
            removes=_continued(before.removes, after.removes, edges, uncertainty=0.5),
            adds_s=_continued(before.adds_s, after.adds_s, pixels),
        )
        for before, after in zip(smaller.effects, larger.effects, strict=True)
    )


def _reach(places: Sequence[float]) -> float:
    """Return how far the last place is beyond the second, in steps from first to second."""
    first, second, last = places
    return (last - second) / (second - first)


def _continued(
    before: Estimated, after: Estimated, reach: float, uncertainty: float = 0.0
) -> Estimated:
    """Continue a line through two values and their intervals.

    ``uncertainty`` is a share of the step beyond the second.
    """
    moved = reach * (after.value - before.value)
    halves = [(one.high - one.low) / 2 for one in (before, after)]
    half = hypot(reach * halves[0], (1 + reach) * halves[1], uncertainty * moved)
    return Estimated(after.value + moved, after.value + moved - half, after.value + moved + half)
