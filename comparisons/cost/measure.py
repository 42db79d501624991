"""Measure the ladder: time each method, and its error against a converged reference.

Methods are timed in turn, so a drift of the machine affects all equally. Each time is of one
rendering of the whole image, evaluated and synchronised. The first run of a method traces and
compiles, and is reported separately; the second warms caches; the rounds follow, each with its own
seed, so their errors are independent.
"""

import gc
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import count as count_from
from itertools import takewhile
from math import sqrt
from statistics import NormalDist
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from comparisons import intervals
from comparisons.cost.cost_record import Measured, Seconds
from comparisons.cost.methods import DEPTHS, Ladder
from comparisons.departure.metrics import LEADING, Metric
from comparisons.hybrids.attribution import ErrorMeter
from comparisons.hybrids.why import MeanError
from comparisons.options import Options
from comparisons.prepared import Prepared, guarded
from heuristic.errors import InputError
from reference.pairing.prepare import film_size
from reference.rendering.gbuffer import gbuffer
from reference.rendering.renderer import Progress, Renderer, Stream, passes
from reference.rendering.sums import MEAN, Accumulator, Estimate
from reference.scene.source import Source

Size = tuple[int, int]

SURE = NormalDist().inv_cdf(0.975)
"""Standard errors to each side of an interval of 95 %."""

DETERMINISTIC_SPP = (4, 16)
"""Samples per pixel of methods without random numbers; only the pixel filter needs them."""

WIDTH, QUICK_WIDTH = 128, 48
"""Default width of an image in pixels; costs are proportional to the number of pixels."""

Key = TypeVar("Key", bound=tuple)
"""Name of a method, samples per pixel, and what else tells measurements apart."""


@dataclass(frozen=True)
class Effort:
    """How much is rendered for a study.

    Parameters
    ----------
    rounds
        Timed repeats of each method, at least 2. From 6 on the median has a 95 % interval.
    largest
        Most samples per pixel of the Monte Carlo methods. Their counts are powers of 4, at which
        the sampler stratifies best.
    deterministic
        Samples per pixel of the other methods.
    depths
        Depths of ``path`` that are methods.
    stand_ins
        Whether what engines use in place of transport is measured too.
    reference_spp
        Samples per pixel of each pass of the converged reference.
    replicates, replicate_spp
        Replicates of each hybrid, at least 3, and samples per pixel of each.
    exact_effects, orders
        Largest number of effects for which every subset is rendered, and orders drawn for more.
    """

    rounds: int = 7
    largest: int = 64
    deterministic: tuple[int, ...] = DETERMINISTIC_SPP
    depths: tuple[int, ...] = DEPTHS
    stand_ins: bool = True
    reference_spp: int = 64
    replicates: int = 8
    replicate_spp: int = 64
    exact_effects: int = 6
    orders: int = 48

    def __post_init__(self) -> None:
        if self.rounds < 2:
            raise InputError(f"rounds = {self.rounds} is not allowed: give at least 2.")

    @property
    def counts(self) -> tuple[int, ...]:
        """The sample counts of the Monte Carlo methods."""
        powers = takewhile(lambda count: count <= self.largest, (4**i for i in count_from(1)))
        return tuple(powers) or (self.largest,)


QUICK = Effort(
    rounds=3,
    largest=16,
    deterministic=(16,),
    depths=(3,),
    replicates=4,
    exact_effects=4,
    orders=8,
)
"""For many scenes in one report, at :data:`QUICK_WIDTH`. There, tracing takes most of the time, so
renderings are few, with many samples each: with 16 instead of 64, skewed noise left 2 % of the
Cornell box's departure in the closure."""


def reduced(source: Source, options: Options, width: int) -> Size:
    """Return the requested resolution, else that of the film, reduced to a width."""
    given = options.resolution or film_size(source.parse(), options.sensor)
    if given[0] <= width:
        return given
    return width, max(1, round(given[1] * width / given[0]))


@dataclass(frozen=True)
class Measurements:
    """A measured ladder: the options and effort used, and the points.

    ``images`` are ``{method: (H, W, 3)}``, one rendering with the most samples of each.
    """

    options: Options
    effort: Effort
    ready: Prepared
    ladder: Ladder
    reference: Estimate
    meter: ErrorMeter
    points: tuple[Measured, ...]
    images: Mapping[str, np.ndarray]


def measure_ladder(
    source: Source,
    options: Options,
    effort: Effort,
    progress: Progress,
    metric: Metric = LEADING,
    at: Size | None = None,
) -> Measurements:
    """Measure every method of a scene's ladder, in the current variant.

    If ``options.resolution`` is omitted, that of ``at``, or of the film, is reduced to
    :data:`WIDTH`. ``options.spp`` is the largest sample count of a Monte Carlo method. Errors are
    means of ``metric``.
    """
    options.require_model("a study of cost")
    if options.resolution is None:
        shaped = options.changed(resolution=at)
        options = options.changed(resolution=reduced(source, shaped, WIDTH))
    if options.spp is not None:
        effort = replace(effort, largest=options.spp)
    ready = guarded(source, options.changed(spp=None, allow_empty=False))
    reference, groups = converged(ready, effort, options.seed, progress)
    meter = ErrorMeter(reference, ready.counted, options.viewing, metric, groups)
    ladder = Ladder(source, options, ready, effort.depths, effort.stand_ins)
    renderers = {
        (method.name, spp): ladder.renderer(method, spp)
        for method in ladder.methods
        for spp in (effort.counts if method.monte_carlo else effort.deterministic)
    }
    gc.collect()  # release scenes that pairing left behind
    points, images = measure(
        renderers, lambda _: meter, effort.rounds, options.seed, progress, "timing"
    )
    ladder.forget()  # its scenes would slow later work
    return Measurements(
        options=options,
        effort=effort,
        ready=ready,
        ladder=ladder,
        reference=reference,
        meter=meter,
        points=tuple(points.values()),
        images={name: image for (name, _), image in images.items()},
    )


def converged(
    ready: Prepared,
    effort: Effort,
    seed: int,
    progress: Progress | None,
    size: Size | None = None,
) -> tuple[Estimate, np.ndarray]:
    """Render the reference, with seeds that no method has.

    Returns its estimate, and the means (R, H, W, 3) of as many groups of its passes as a hybrid has
    replicates, with an even number of passes each.
    """
    groups = effort.replicates
    integrator = ready.reference.integrator
    renderer = Renderer(ready.scene, integrator, effort.reference_spp, "reference image", size)
    total, means = Accumulator(), [Accumulator(MEAN) for _ in range(groups)]
    count, stream = 2 * groups * -(-ready.plan.passes // (2 * groups)), Stream.OTHER_SIDE
    for one in passes([renderer], seed, count, stream=stream, progress=progress, stage="reference"):
        total.add(one.images[0])
        means[one.number % groups].add(one.images[0])
    return total.estimate(), np.stack([mean.mean() for mean in means])


def meter_at(
    ladder: Ladder, effort: Effort, seed: int, progress: Progress, size: Size
) -> ErrorMeter:
    """Return the error meter of a ladder's scene at another size."""
    ready = ladder.ready
    reference, _ = converged(ready, effort, seed, progress, size)
    return ErrorMeter(reference, gbuffer(ready.scene, *size).hit, ladder.viewing)


def measure(
    renderers: Mapping[Key, Renderer],
    meter_of: Callable[[Key], ErrorMeter],
    rounds: int,
    seed: int,
    progress: Progress | None,
    stage: str,
) -> tuple[dict[Key, Measured], dict[Key, np.ndarray]]:
    """Time renderers in turn, at least twice, and measure their errors.

    Returns one record per renderer, in order, and the last round's image (H, W, 3) of each.
    """
    errors: dict[Key, list[tuple[float, float]]] = {key: [] for key in renderers}
    images: dict[Key, np.ndarray] = {}
    loop = passes([*renderers.values()], seed, rounds + 2, progress=progress, stage=stage)
    for one in loop:
        images = dict(zip(renderers, map(np.array, one.images), strict=True))
        if one.number > 1:
            for key, image in images.items():
                errors[key].append(meter_of(key).errors(image))
    points = {}
    for key, renderer in renderers.items():
        error, mse = np.mean(errors[key], axis=0).tolist()
        half = SURE * float(np.std(errors[key], axis=0, ddof=1)[0]) / sqrt(rounds)
        points[key] = Measured(
            method=key[0],
            spp=key[1],
            seconds=median(renderer.times[2:])[0],
            error=MeanError(mean=error, low=error - half, high=error + half),
            mse=mse,
            first_s=renderer.times[0],
            compile_s=renderer.compilation,
            prepare_s=getattr(renderer.integrator, "preparation", 0.0),
        )
    return points, images


def median(values: ArrayLike) -> tuple[Seconds, float]:
    """Return the median of at least two repeats, with an interval, and the interval's level.

    With fewer than six repeats even the extremes hold the true median with a chance below 95 %.
    """
    ordered = np.sort(np.asarray(values, float))
    low, high, level = intervals.median_ranks(len(ordered))
    ends = {"low": float(ordered[low]), "high": float(ordered[high])}
    return Seconds(value=float(np.median(ordered)), **ends), level
