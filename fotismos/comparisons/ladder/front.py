"""Which methods are worth their time: the front of time and error, and what passes.

A method passes at a tolerance t if at most 5 % of the pixels of its image exceed ΔE2000 t
(:mod:`fotismos.comparisons.departure.criterion`). Intervals decide: what lies inside one another's
is too close to call.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, TypeVar

from msgspec import structs

from fotismos.comparisons.records.engine import FrontPoint
from fotismos.reference.records import Interval

if TYPE_CHECKING:  # pictures have no methods
    from fotismos.comparisons.records.cost import Point

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


def cheapest(points: Sequence[Point], tolerance: float) -> Point | None:
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
