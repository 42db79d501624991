"""Compare measured methods: Pareto front, cheapest, equal error.

A point is a method at one sample count, with a time in seconds and an error. Equal error is
interpolated between two counts of one method, along a straight line in logarithms: its slope is
−1/2 if the error is noise alone, and flatter near the method's own bias. Nothing is extrapolated
beyond the counts.
"""

from collections.abc import Iterable, Sequence
from itertools import pairwise
from math import log

import numpy as np

from comparisons.cost.cost_record import LeftOut, Measured, Reached, Seconds
from comparisons.cost.measure import Effort, measure_ladder
from comparisons.cost.methods import FULL_PLAN
from comparisons.departure.metrics import METRICS
from comparisons.options import Options
from heuristic.errors import unknown
from reference.records import VERSION, Positive, Record, Resolution
from reference.rendering.gbuffer import image_size
from reference.rendering.renderer import Progress
from reference.scene.source import Source

ERRORS = (5.0, 2.0, 1.0, 0.5)


def reached(errors: Sequence[float], error: float) -> float | None:
    """Return where the errors of one method, its fastest point first, fall to an error.

    As a place for :func:`at`: 1.5 is half way from the second point to the third, in logarithms.
    """
    if errors[0] <= error:
        return 0.0
    for number, (before, after) in enumerate(pairwise(errors)):
        if after <= error < before:
            share = log(before / error) / log(before / after) if after > 0 else 1.0
            return number + share
    return None


def at(values: Sequence[float], place: float) -> float:
    """Return the value at a place on a curve, given positive values at the points."""
    return float(np.exp(np.interp(place, range(len(values)), np.log(values))))


def cheapest(points: Iterable[Measured], within: float) -> Measured | None:
    """Return the fastest point with at most this error; of equally fast ones the most accurate."""
    allowed = (point for point in points if point.error.mean <= within)
    return min(allowed, key=lambda point: (point.seconds.value, point.error.mean), default=None)


def pareto(points: Iterable[Measured]) -> tuple[Measured, ...]:
    """Return the points that no other point beats in time or error while matching the other."""
    front, best = [], float("inf")
    for point in sorted(points, key=lambda p: (p.seconds.value, p.error.mean)):
        if point.error.mean < best:
            front.append(point)
            best = point.error.mean
    return tuple(front)


def equal_error(
    points: Sequence[Measured], errors: Sequence[float] = ERRORS
) -> tuple[Reached, ...]:
    """Return when each method reaches each error, in the order of the points."""
    methods = list(dict.fromkeys(point.method for point in points))
    return tuple(
        _reached(method, [point for point in points if point.method == method], error)
        for method in methods
        for error in errors
    )


def _reached(method: str, points: Iterable[Measured], error: float) -> Reached:
    """Return when a method reaches an error, with an interval from its points' uncertainty."""
    ordered = sorted(points, key=lambda point: point.seconds.value)
    found = reached([point.error.mean for point in ordered], error)
    if found is None:
        return Reached(method=method, error=error, seconds=None)
    ends = []
    for end in ("low", "high"):
        errors = [max(getattr(p.error, end), 0.0) for p in ordered]
        place = reached(errors, error)
        place = len(ordered) - 1 if place is None else place
        ends.append(at([getattr(p.seconds, end) for p in ordered], place))
    value = at([point.seconds.value for point in ordered], found)
    seconds = Seconds(value=value, low=min(ends[0], value), high=max(ends[1], value))
    at_most = ordered[0].error.mean <= error
    return Reached(method=method, error=error, seconds=seconds, at_most=at_most)


class Choice(Record, kw_only=True):
    """The answer of ``fotismos plan --within``.

    Attributes
    ----------
    metric, within
        Name of the metric, and the largest allowed mean.
    chosen
        The cheapest point within the tolerance; None if there is none.
    best
        The one with the smallest error.
    full
        The full plan with the fewest samples within the tolerance, else with the most samples.
    left_out
        Methods that the scene cannot have.
    """

    scene: str
    resolution: Resolution
    metric: str
    within: Positive
    chosen: Measured | None
    best: Measured
    full: Measured
    left_out: tuple[LeftOut, ...] = ()
    record_version: int = VERSION


def choose(
    source: Source,
    within: float,
    options: Options | None = None,
    effort: Effort | None = None,
    metric: str = "dE2000",
    progress: Progress | None = None,
) -> Choice:
    """Measure the ladder of a scene, in the current variant, and choose from it."""
    if metric not in METRICS:
        raise unknown("metric", metric, METRICS)
    shown = progress or (lambda *_: None)
    found = measure_ladder(source, options or Options(), effort or Effort(), shown, METRICS[metric])
    full = next(one.name for one in found.ladder.methods if FULL_PLAN.name in one.names)
    of_full = [point for point in found.points if point.method == full]
    return Choice(
        scene=source.name,
        resolution=image_size(found.ready.scene),
        metric=metric,
        within=within,
        chosen=cheapest(found.points, within),
        best=min(found.points, key=lambda point: (point.error.mean, point.seconds.value)),
        full=cheapest(of_full, within) or max(of_full, key=lambda point: point.spp),
        left_out=tuple(
            LeftOut(name=name, reason=reason) for name, reason in found.ladder.left_out.items()
        ),
    )
