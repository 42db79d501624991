"""Which methods are worth their time: the front of time and error, and what passes.

A method passes at a tolerance t if at most 5 % of the pixels of its image exceed ΔE2000 t
(:mod:`fotismos.comparisons.departure.criterion`). Intervals decide: what lies inside one another's
is too close to call.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, sqrt
from typing import TYPE_CHECKING, TypeVar

from msgspec import structs

from fotismos.comparisons.records.engine import FrontPoint, Reach
from fotismos.reference.records import Interval

if TYPE_CHECKING:  # pictures have no methods
    from fotismos.comparisons.records.cost import Point, TimedMethod

OnFront = TypeVar("OnFront", bound=FrontPoint)


def is_below(first: Interval, other: Interval) -> bool:
    """Return whether one interval lies below another."""
    return first.high < other.low


def beats(first: FrontPoint, other: FrontPoint) -> bool:
    """Return whether a point is clearly faster or more accurate, and not clearly the opposite."""
    faster = is_below(first.seconds, other.seconds)
    better = is_below(first.error, other.error)
    slower = is_below(other.seconds, first.seconds)
    worse = is_below(other.error, first.error)
    return (faster and not worse) or (better and not slower)


def fronted(points: Sequence[OnFront]) -> tuple[OnFront, ...]:
    """Return the points, of which those that none beats are on the front, with their ties."""
    front = [point for point in points if not any(beats(other, point) for other in points)]

    def ties(point: FrontPoint) -> tuple[str, ...]:
        same = (
            other.method
            for other in front
            if other.method != point.method and not _differ(point, other)
        )
        return tuple(dict.fromkeys(same))

    return tuple(
        structs.replace(point, front=True, ties=ties(point)) if point in front else point
        for point in points
    )


def _differ(first: FrontPoint, other: FrontPoint) -> bool:
    pairs = ((first.seconds, other.seconds), (first.error, other.error))
    return any(is_below(a, b) or is_below(b, a) for a, b in pairs)


def sufficient(points: Sequence[Point], tolerance: float) -> Point | None:
    """Return the fastest point that surely passes at a tolerance; None if none does.

    Of those whose times are too close to call it is the most accurate; the others are its ties.
    """
    enough = [point for point in points if point.tolerance.high <= tolerance]
    if not enough:
        return None
    fastest = min(enough, key=lambda point: point.seconds.value)
    alike = [point for point in enough if not is_below(fastest.seconds, point.seconds)]
    best = min(alike, key=lambda point: point.tolerance.value)
    ties = dict.fromkeys(point.method for point in alike if point.method != best.method)
    return structs.replace(best, ties=tuple(ties))


def at_size(
    points: Sequence[Point], methods: Sequence[TimedMethod], size: tuple[int, int]
) -> list[Point]:
    """Return points as they are at another size: the times are those there."""
    known = {method.name: method for method in methods}
    samples = size[0] * size[1]
    return [
        structs.replace(point, seconds=known[point.method].seconds(point.spp * samples))
        for point in points
    ]


def reach(points: Sequence[Point], tolerance: float) -> Reach | None:
    """Return the method that should pass at a tolerance with the fewest more samples than measured.

    What is left without noise follows from a method's two largest counts: the tolerances T at them
    obey ``T² = left² + noise² / spp``. If too much is left with every method, the nearest one is
    returned; None if each was measured at one count.
    """
    found = []
    for name in dict.fromkeys(point.method for point in points):
        of_method = [point for point in points if point.method == name]
        if len(of_method) < 2:
            continue
        # Points of a method come in order of their counts.
        fewer, more = of_method[-2:]
        step = more.spp - fewer.spp
        square = more.tolerance.value**2
        # `noise^2 / more.spp` is the squares' difference times `fewer.spp / step`.
        left = max(square - (fewer.tolerance.value**2 - square) * fewer.spp / step, 0.0)
        # `left` is still a square here: noise may take the rest of the tolerance's.
        room = tolerance**2 - left
        spp = None
        if room > 0:
            spp = max(ceil(more.spp * (square - left) / room), more.spp + 1)
        found.append(Reach(method=name, left=sqrt(left), spp=spp))
    return min(found, key=lambda point: (point.spp is None, point.spp or point.left), default=None)
