"""Which methods are worth their time: the front of time and error, and what suffices.

A method suffices at a tolerance t if at most 5 % of the pixels of its image exceed ΔE2000 t
(:mod:`comparisons.departure.criterion`). Intervals decide: what lies inside one another's is too
close to call.
"""

from collections.abc import Sequence

from msgspec import structs

from comparisons.cost.cost_record import Point, TimedMethod
from comparisons.cost.measure import Effort, Size, measure_ladder
from comparisons.cost.methods import FULL_PLAN
from comparisons.departure.criterion import checked_threshold
from comparisons.hybrids.why import MeanError
from comparisons.options import Options
from reference.pairing.prepare import film_size
from reference.records import VERSION, Estimated, Positive, Record, Resolution
from reference.rendering.renderer import Progress
from reference.scene.source import Source

Interval = Estimated | MeanError


def is_below(one: Interval, other: Interval) -> bool:
    """Return whether one interval lies below another."""
    return one.high < other.low


def beats(one: Point, other: Point) -> bool:
    """Return whether a point is clearly faster or more accurate, and not clearly the opposite."""
    faster, better = is_below(one.seconds, other.seconds), is_below(one.error, other.error)
    slower, worse = is_below(other.seconds, one.seconds), is_below(other.error, one.error)
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
    """Return the fastest point that surely suffices at a tolerance; None if none does.

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


def at_size(points: Sequence[Point], methods: Sequence[TimedMethod], size: Size) -> list[Point]:
    """Return points as they are at another size: with the times there, and the same errors."""
    known = {method.name: method for method in methods}
    samples = size[0] * size[1]
    return [
        structs.replace(one, seconds=known[one.method].seconds(one.spp * samples)) for one in points
    ]


class Choice(Record, kw_only=True):
    """The answer of ``fotismos plan --within``.

    Attributes
    ----------
    resolution, measured
        Size of the times, and of the images in which errors were measured.
    within
        The tolerance, ΔE2000.
    chosen
        The fastest point that suffices; None if none does.
    best
        The one that suffices at the smallest tolerance.
    full
        The full plan with the fewest samples that suffice, else with the most samples.
    left_out
        Methods that the scene cannot have, and why.
    """

    scene: str
    resolution: Resolution
    measured: Resolution
    within: Positive
    chosen: Point | None
    best: Point
    full: Point
    left_out: dict[str, str]
    record_version: int = VERSION


def choose(
    source: Source,
    within: float,
    options: Options | None = None,
    effort: Effort | None = None,
    progress: Progress | None = None,
) -> Choice:
    """Measure the ladder of a scene, in the current variant, and choose from it."""
    checked_threshold(within)
    options = options or Options()
    found = measure_ladder(source, options, effort or Effort(), progress or (lambda *_: None))
    size = options.resolution or film_size(source.parse(), options.sensor)
    points = at_size(found.points, found.methods, size)
    full = next(one.name for one in found.methods if FULL_PLAN.name in one.names)
    of_full = [point for point in points if point.method == full]
    return Choice(
        scene=source.name,
        resolution=size,
        measured=found.size,
        within=within,
        chosen=sufficient(points, within),
        best=min(points, key=lambda point: (point.tolerance.mean, point.seconds.value)),
        full=sufficient(of_full, within) or max(of_full, key=lambda point: point.spp),
        left_out=found.ladder.left_out,
    )
