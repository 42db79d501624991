"""The minimum of a function of one number within bounds.

Brent, *Algorithms for Minimization without Derivatives* (1973), chapter 5. SciPy's bounded search
has the same steps; importing it takes as long as a comparison of two small pictures.
"""

from collections.abc import Callable
from math import copysign, sqrt

GOLDEN = (3.0 - sqrt(5.0)) / 2.0
"""Share of the larger part of the bounds at which the next value is taken."""

RELATIVE = sqrt(2.2e-16)
"""Relative distance below which values of a smooth function cannot be told apart; as SciPy's."""


def minimum(
    function: Callable[[float], float], low: float, high: float, tolerance: float = 1e-5
) -> tuple[float, float]:
    """Return where a function is smallest between two bounds, and its value there.

    If it has one minimum there, the place is within about ``tolerance`` of it.
    """
    # The best place, the second and the third best, with their values.
    best = second = third = low + GOLDEN * (high - low)
    least = next_least = third_least = function(best)
    step = 0.0
    earlier = 0.0
    while True:
        middle = (low + high) / 2.0
        near = RELATIVE * abs(best) + tolerance / 3.0
        if abs(best - middle) <= 2.0 * near - (high - low) / 2.0:
            return best, least
        # The vertex of the parabola through the three: `best + above / below`.
        above = below = limit = 0.0
        if abs(earlier) > near:
            left = (best - second) * (least - third_least)
            right = (best - third) * (least - next_least)
            below = 2.0 * (right - left)
            above = (best - second) * left - (best - third) * right
            above = copysign(1.0, below) * above
            below = abs(below)
            limit = abs(below * earlier / 2.0)
            earlier = step
        is_inside = below * (low - best) < above < below * (high - best)
        if abs(above) < limit and is_inside:
            step = above / below
            place = best + step
            if place - low < 2.0 * near or high - place < 2.0 * near:
                step = copysign(near, middle - best)
        else:
            earlier = (low if best >= middle else high) - best
            step = GOLDEN * earlier
        place = best + copysign(max(abs(step), near), step)
        value = function(place)
        if value <= least:
            low, high = (best, high) if place >= best else (low, best)
            third, third_least = second, next_least
            second, next_least = best, least
            best, least = place, value
        else:
            low, high = (place, high) if place < best else (low, place)
            if value <= next_least or second == best:
                third, third_least = second, next_least
                second, next_least = place, value
            elif value <= third_least or third in (best, second):
                third, third_least = place, value
