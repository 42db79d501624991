"""Which methods are worth their time: the front of time and error, and what passes.

A method passes at a tolerance t if at most 5 % of the pixels of its image exceed ΔE2000 t
(:mod:`fotismos.comparisons.departure.criterion`). Intervals decide: what lies inside one another's
is too close to call.
"""

from collections.abc import Sequence
from math import ceil, sqrt

from msgspec import structs

from fotismos.comparisons.comparison import MeanError
from fotismos.comparisons.cost.cost_record import Point, TimedMethod
from fotismos.reference.records import Estimated, Record

Interval = Estimated | MeanError


def is_below(one: Interval, other: Interval) -> bool:
    """Return whether one interval lies below another."""
    return one.high < other.low


def beats(one: Point, other: Point) -> bool:
    """Return whether a point is clearly faster or more accurate, and not clearly the opposite."""
    faster = is_below(one.seconds, other.seconds)
    better = is_below(one.error, other.error)
    slower = is_below(other.seconds, one.seconds)
    worse = is_below(other.error, one.error)
    return (faster and not worse) or (better and not slower)


def fronted(points: Sequence[Point]) -> tuple[Point, ...]:
    """Return the points, of which those that none beats are on the front, with their ties."""
    front = [one for one in points if not any(beats(other, one) for other in points)]

    def ties(one: Point) -> tuple[str, ...]:
        same = (
            other.method
            for other in front
            if other.method != one.method and not _differ(one, other)
        )
        return tuple(dict.fromkeys(same))

    return tuple(
        structs.replace(one, front=True, ties=ties(one)) if one in front else one for one in points
    )


def _differ(one: Point, other: Point) -> bool:
    pairs = ((one.seconds, other.seconds), (one.error, other.error))
    return any(is_below(a, b) or is_below(b, a) for a, b in pairs)


def sufficient(points: Sequence[Point], tolerance: float) -> Point | None:
    """Return the fastest point that surely passes at a tolerance; None if none does.

    Of those whose times are too close to call it is the most accurate; the others are its ties.
    """
    enough = [point for point in points if point.tolerance.high <= tolerance]
    if not enough:
        return None
    fastest = min(enough, key=lambda point: point.seconds.value)
    alike = [one for one in enough if not is_below(fastest.seconds, one.seconds)]
    best = min(alike, key=lambda point: point.tolerance.mean)
    ties = dict.fromkeys(one.method for one in alike if one.method != best.method)
    return structs.replace(best, ties=tuple(ties))


def at_size(
    points: Sequence[Point], methods: Sequence[TimedMethod], size: tuple[int, int]
) -> list[Point]:
    """Return points as they are at another size: with the times there, and the same errors."""
    known = {method.name: method for method in methods}
    samples = size[0] * size[1]
    return [
        structs.replace(one, seconds=known[one.method].seconds(one.spp * samples)) for one in points
    ]


class Reach(Record):
    """How near a method comes to the reference with any number of samples.

    Attributes
    ----------
    left
        ΔE2000 that 5 % of the pixels exceed without noise.
    spp
        Samples per pixel with which it should pass at a tolerance; None if too much is left.
    """

    method: str
    left: float
    spp: int | None = None


def reach(points: Sequence[Point], tolerance: float) -> Reach | None:
    """Return the method that should pass at a tolerance with the fewest more samples than measured.

    What is left without noise follows from a method's two largest counts: the tolerances T at them
    obey ``T² = left² + noise² / spp``. If too much is left with every method, the nearest one is
    returned; None if each was measured at one count.
    """
    found = []
    for name in dict.fromkeys(point.method for point in points):
        own = [one for one in points if one.method == name]
        if len(own) < 2:
            continue
        fewer, more = own[-2:]
        step = more.spp - fewer.spp
        square = more.tolerance.mean**2
        left = max(square - (fewer.tolerance.mean**2 - square) * fewer.spp / step, 0.0)
        room = tolerance**2 - left
        spp = None
        if room > 0:
            spp = max(ceil(more.spp * (square - left) / room), more.spp + 1)
        found.append(Reach(method=name, left=sqrt(left), spp=spp))
    return min(found, key=lambda one: (one.spp is None, one.spp or one.left), default=None)
