"""Choose the cheapest measured method whose error stays within a tolerance."""

from comparisons.cost.climbing import climb
from comparisons.cost.cost_record import LeftOut, Measured
from comparisons.cost.effort import Effort
from comparisons.cost.front import cheapest
from comparisons.cost.rungs import FULL_PLAN
from comparisons.departure.metrics import METRICS
from comparisons.options import Options
from comparisons.records import VERSION, Amount, Positive, Record, Resolution
from heuristic.errors import unknown
from reference.rendering.gbuffer import image_size
from reference.rendering.passes import Progress
from reference.scene.source import Source


class Offer(Record):
    """A method at one sample count, with its time and error.

    Attributes
    ----------
    method, spp
        Name of the rung, and samples per pixel.
    seconds, prepare_s
        Median for one image, and what preparing the scene took once.
    error, error_stderr
        The metric's mean, and its standard error over the rounds.
    """

    method: str
    spp: int
    seconds: Positive
    prepare_s: Amount
    error: Amount
    error_stderr: Amount


class Choice(Record, kw_only=True):
    """The answer of ``fotismos plan --within``.

    Attributes
    ----------
    metric, within
        Name of the metric, and the largest allowed mean.
    chosen
        The cheapest within the tolerance; None if there is none.
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
    chosen: Offer | None
    best: Offer
    full: Offer
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
    """Measure the ladder of a scene, in the current variant, and choose from it.

    Raises
    ------
    InputError
        For an unknown metric, and as :func:`comparisons.cost.climbing.climb` does.
    """
    if metric not in METRICS:
        raise unknown("metric", metric, METRICS)
    told = progress or (lambda *_: None)
    found = climb(source, options or Options(), effort or Effort(), told, METRICS[metric])
    (full,) = (rung.name for rung in found.methods.rungs if FULL_PLAN.name in rung.names)
    of_full = [point for point in found.measured if point.rung == full]
    chosen = cheapest(found.measured, within)
    return Choice(
        scene=source.name,
        resolution=image_size(found.ready.scene),
        metric=metric,
        within=within,
        chosen=_offer(chosen) if chosen else None,
        best=_offer(min(found.measured, key=lambda point: (point.error, point.seconds.median))),
        full=_offer(cheapest(of_full, within) or max(of_full, key=lambda point: point.spp)),
        left_out=tuple(LeftOut(*pair) for pair in found.methods.left_out.items()),
    )


def _offer(point: Measured) -> Offer:
    return Offer(
        method=point.rung,
        spp=point.spp,
        seconds=point.seconds.median,
        prepare_s=point.prepare_s,
        error=point.error,
        error_stderr=point.error_stderr,
    )
