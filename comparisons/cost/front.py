"""What a set of timed and judged methods says: Pareto front, equal time, equal error.

A point is a method at one sample count: a time in seconds and an error. Equal error is read off
between two measured counts of one method only, along the straight line between them in logarithms:
its slope is −1/2 where the error is noise alone, and flatter towards the method's own bias. Beyond
the measured counts nothing is said.
"""

from itertools import pairwise
from math import exp, log

from comparisons.cost.cost_record import Reached, Within

TIMES_S = (0.01, 0.1, 1.0, 10.0)
ERRORS = (5.0, 2.0, 1.0, 0.5)


def pareto(points):
    """Return the points that no other one beats: none is as fast and as good, and better in one."""
    front, best = [], float("inf")
    for point in sorted(points, key=lambda p: (p.seconds, p.error)):
        if point.error < best:
            front.append(point)
            best = point.error
    return tuple(front)


def equal_time(points, times=TIMES_S):
    """Return the point of least error within each time; of equal ones the fastest."""
    rows = []
    for limit in times:
        within = [point for point in points if point.seconds <= limit]
        best = min(within, key=lambda p: (p.error, p.seconds)) if within else None
        rows.append(Within(limit, best))
    return tuple(rows)


def equal_error(points, errors=ERRORS):
    """Return when each method reaches each error, methods in the order of the points."""
    methods = list(dict.fromkeys(point.method for point in points))
    return tuple(
        _reached(method, sorted((p for p in points if p.method == method), key=_time), error)
        for method in methods
        for error in errors
    )


def _time(point):
    return point.seconds


def _reached(method, points, error):
    if points[0].error <= error:
        return Reached(method, error, points[0].seconds, at_most=True)
    for before, after in pairwise(points):
        if after.error <= error < before.error:
            return Reached(method, error, _between(before, after, error))
    return Reached(method, error, None)


def _between(before, after, error):
    """Interpolate the time between two points, linearly in logarithms."""
    if after.error <= 0:
        return after.seconds
    slope = log(after.seconds / before.seconds) / log(after.error / before.error)
    return before.seconds * exp(slope * log(error / before.error))
