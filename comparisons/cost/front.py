"""Compare timed and judged methods: Pareto front, cheapest, equal time, equal error.

A point is a method at one sample count, with a time in seconds and an error. Equal error is
interpolated between two counts of one method, along a straight line in logarithms: its slope is
−1/2 if the error is noise alone, and flatter near the method's own bias. Nothing is extrapolated
beyond the counts.
"""

from collections.abc import Iterable, Sequence
from itertools import groupby, pairwise
from math import log
from operator import attrgetter
from statistics import NormalDist
from typing import NamedTuple

from comparisons.cost.cost_record import Measured, Range, Reached, Within

TIMES_S = (0.01, 0.1, 1.0, 10.0)
ERRORS = (5.0, 2.0, 1.0, 0.5)

SURE = NormalDist().inv_cdf(0.975)
"""Standard errors to each side of an interval of 95 %."""


class Place(NamedTuple):
    """A place on a curve: a share of the way, in logarithms, from one point to the next."""

    number: int
    share: float

    def of(self, values: Sequence[float]) -> float:
        """Return the value there, given positive values at the points."""
        after = values[self.number + 1] if self.share else 1.0
        return values[self.number] ** (1 - self.share) * after**self.share


def reached(errors: Sequence[float], error: float) -> Place | None:
    """Return where the errors of one method, its fastest point first, fall to an error."""
    if errors[0] <= error:
        return Place(0, 0.0)
    for number, (before, after) in enumerate(pairwise(errors)):
        if after <= error < before:
            share = log(before / error) / log(before / after) if after > 0 else 1.0
            return Place(number, share)
    return None


def cheapest(points: Iterable[Measured], within: float) -> Measured | None:
    """Return the fastest point with at most this error; of equally fast ones the most accurate."""
    allowed = (point for point in points if point.error <= within)
    return min(allowed, key=lambda point: (point.seconds.median, point.error), default=None)


def pareto(points: Iterable[Measured]) -> tuple[Measured, ...]:
    """Return the points that no other point beats in time or error while matching the other."""
    front, best = [], float("inf")
    for point in sorted(points, key=lambda p: (p.seconds.median, p.error)):
        if point.error < best:
            front.append(point)
            best = point.error
    return tuple(front)


def equal_time(points: Sequence[Measured], times: Sequence[float] = TIMES_S) -> tuple[Within, ...]:
    """Return the point of smallest error within each time, for times that improve it.

    Of equal points it is the fastest. Of times that no point meets, the longest is kept.
    """
    rows = [Within(limit, _best(points, limit)) for limit in times]
    too_short = [row for row in rows if row.best is None][-1:]
    better = [next(same) for best, same in groupby(rows, attrgetter("best")) if best]
    return (*too_short, *better)


def _best(points: Iterable[Measured], limit: float) -> Measured | None:
    within = [point for point in points if point.seconds.median <= limit]
    return min(within, key=lambda p: (p.error, p.seconds.median), default=None)


def equal_error(
    points: Sequence[Measured], errors: Sequence[float] = ERRORS
) -> tuple[Reached, ...]:
    """Return when each method reaches each error, in the order of the points."""
    methods = list(dict.fromkeys(point.rung for point in points))
    return tuple(
        _reached(method, [point for point in points if point.rung == method], error)
        for method in methods
        for error in errors
    )


def _reached(method: str, points: Iterable[Measured], error: float) -> Reached:
    """Return when a method reaches an error, with an interval from its points' uncertainty."""
    ordered = sorted(points, key=lambda point: point.seconds.median)
    found = reached([point.error for point in ordered], error)
    if found is None:
        return Reached(method, error, None)
    ends = []
    for side, end in ((-1, "low"), (1, "high")):
        errors = [max(p.error + side * SURE * p.error_stderr, 0.0) for p in ordered]
        place = reached(errors, error) or Place(len(ordered) - 1, 0.0)
        ends.append(place.of([getattr(p.seconds, end) for p in ordered]))
    value = found.of([point.seconds.median for point in ordered])
    at_most = ordered[0].error <= error
    return Reached(method, error, Range(value, min(ends[0], value), max(ends[1], value)), at_most)
