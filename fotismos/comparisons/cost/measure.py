"""Measure the ladder: the time of each method, and its error against a converged reference.

The first image of a method traces and compiles, and is reported separately. Then all methods take
turns, at several sample counts; :mod:`fotismos.comparisons.timing` makes overhead and time per
sample of it. Each round has its own seed, so the errors of the rounds are independent.
"""

import gc
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from itertools import count as count_from
from itertools import takewhile
from math import sqrt
from statistics import NormalDist
from typing import Any

import numpy as np
from msgspec import structs
from numpy.typing import ArrayLike, NDArray

from fotismos.comparisons import timing
from fotismos.comparisons.cost.methods import Ladder, Step
from fotismos.comparisons.departure.criterion import LIMIT
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import Prepared, guarded
from fotismos.comparisons.records.cost import Converged, Method, Point, TimedMethod
from fotismos.comparisons.records.departure import Viewing
from fotismos.heuristic.convention import Floats
from fotismos.heuristic.errors import InputError
from fotismos.reference.pairing.settings import film_size
from fotismos.reference.records import Interval
from fotismos.reference.rendering.passes import Progress, Stream, passes
from fotismos.reference.rendering.renderer import LARGEST_PASS, Renderer, warm
from fotismos.reference.rendering.sums import (
    Accumulator,
    DifferenceEstimate,
    DifferenceSums,
    Estimate,
)
from fotismos.reference.scene.source import Source

Size = tuple[int, int]

Key = tuple[str, int]
"""Name of a method, and samples per pixel."""

SURE = NormalDist().inv_cdf(0.975)
"""Standard errors to each side of an interval of 95 %."""

LARGEST_CERTAIN = 16
"""Most samples per pixel of methods without random numbers: only the pixel filter needs them."""

WIDTH = 128
QUICK_WIDTH = 64
"""Default width of an image in pixels: the time of a sample does not depend on it."""

REFERENCE_SPP = 64
REFERENCE_PASSES = 16
"""Samples per pixel of each pass of the converged reference, and passes at least."""

LEAST_S = 0.05
"""Seconds that the largest rendering of a method takes, at least."""

MOST_SAMPLES = 2**24
"""Samples of one image, at most."""


@dataclass(frozen=True)
class Effort:
    """How much is rendered for a study: ``rounds`` of each method, at least 2, and which methods.

    Errors are measured up to ``largest`` samples per pixel, at most :data:`LARGEST_CERTAIN` for
    methods without random numbers. The counts are powers of 4, at which the sampler stratifies
    best.
    """

    rounds: int = 7
    largest: int = 64
    is_short: bool = False

    def __post_init__(self) -> None:
        if self.rounds < 2:
            raise InputError(f"rounds = {self.rounds} is not allowed: give at least 2.")

    def counts(self, method: Method) -> tuple[int, ...]:
        """Return the sample counts at which the error of a method is measured."""
        most = self.largest if method.monte_carlo else min(self.largest, LARGEST_CERTAIN)
        powers = takewhile(lambda count: count <= most, (4**i for i in count_from(1)))
        return tuple(powers) or (most,)


QUICK = Effort(rounds=3, largest=16, is_short=True)
"""For scenes of a report."""


def requested(source: Source, options: Options) -> Size:
    """Return the requested resolution, else that of the film."""
    return options.resolution or film_size(source.parse(), options.sensor)


def reduced(source: Source, options: Options, width: int) -> Size:
    """Return the requested resolution, else that of the film, reduced to a width."""
    size = requested(source, options)
    if size[0] <= width:
        return size
    return width, max(1, round(size[1] * width / size[0]))


Judge = Callable[[Floats], tuple[float, float]]
"""Returns an image's mean ΔE2000, and the ΔE2000 that a share LIMIT of its pixels exceed."""


def judge_by(reference: Estimate, counted: NDArray[np.bool_], viewing: Viewing) -> Judge:
    """Return what measures the errors of single images against a converged reference."""
    distances = LEADING.against(reference.mean, counted, viewing)

    def judge(image: Floats) -> tuple[float, float]:
        found = distances(image)
        return LEADING.mean(found), float(np.quantile(found, 1 - LIMIT))

    return judge


@dataclass(frozen=True)
class Measurements:
    """A measured ladder: the options and effort used, methods and points.

    ``lines`` are ``{method or step: its times}``; ``images`` are ``{method: (H, W, 3)}``, one
    rendering with the most samples of each; ``size`` is that of the images. ``reference.grouped``
    holds groups of its passes, of which no other image is taken off.
    """

    options: Options
    effort: Effort
    ready: Prepared
    ladder: Ladder
    size: Size
    reference: DifferenceEstimate
    converged: Converged
    methods: tuple[TimedMethod, ...]
    points: tuple[Point, ...]
    lines: Mapping[str, timing.Line]
    steps: tuple[Step, ...]
    images: Mapping[str, Floats]


def measure_ladder(
    source: Source,
    options: Options,
    effort: Effort,
    progress: Progress,
    at: Size | None = None,
) -> Measurements:
    """Measure every method of a scene's ladder, in the current variant.

    If ``options.resolution`` is omitted, that of ``at``, or of the film, is reduced to
    :data:`WIDTH`. ``options.spp`` is the largest sample count of a Monte Carlo method.
    """
    options.require_model("a study of cost")
    if options.resolution is None:
        shaped = options.changed(resolution=at)
        options = options.changed(resolution=reduced(source, shaped, WIDTH))
    if options.spp is not None:
        effort = replace(effort, largest=options.spp)
    # The scene, its converged reference, and the ladder.
    ready = guarded(source, options.changed(spp=None, allow_empty=False))
    total = DifferenceSums(ready.counted)
    converged(ready, options.seed, progress, total=total)
    reference = total.estimate()
    judge = judge_by(reference, ready.counted, options.viewing)
    ladder = Ladder(ready, is_short=effort.is_short)
    size = ready.size
    gc.collect()  # release scenes that pairing left behind
    # Steps also need methods that are not on the ladder: they are timed, not judged.
    steps = tuple(ladder.steps())
    wanted = {method.name: method for step in steps for method in (step.before, step.after)}
    wanted |= {method.name: method for method in ladder.methods}
    counts = {name: effort.counts(method) for name, method in wanted.items()}
    renderers = tried(
        {name: ladder.renderer(method, counts[name][-1]) for name, method in wanted.items()},
        counts, pixels=size[0] * size[1], progress=progress,
    )  # fmt: skip
    judged = {(method.name, spp) for method in ladder.methods for spp in counts[method.name]}
    errors, images = rendered(
        renderers, judge, judged, effort.rounds, options.seed, progress, "timing"
    )
    found = timed(renderers, effort.rounds, size[0] * size[1], options.seed)
    methods = tuple(
        timed_method(
            method,
            found,
            textbook=steps[0].before.name,
            first=renderers[method.name, counts[method.name][-1]],
        )
        for method in ladder.methods
    )
    return Measurements(
        options=options,
        effort=effort,
        ready=ready,
        ladder=ladder,
        size=size,
        reference=reference,
        converged=Converged(
            integrator=ready.plan.integrator,
            max_depth=ready.plan.max_depth,
            spp=_reference_spp(size) * reference.passes,
            passes=reference.passes,
            noise_floor=judge(reference.mean + reference.noise)[0],
        ),
        methods=methods,
        points=tuple(
            Point(
                method=method.name,
                spp=spp,
                seconds=method.seconds(spp * size[0] * size[1]),
                error=errors[method.name, spp][0],
                tolerance=errors[method.name, spp][1],
            )
            for method in methods
            for spp in counts[method.name]
        ),
        lines=found,
        steps=steps,
        images={name: image for (name, _), image in images.items()},
    )


def _reference_spp(size: Size) -> int:
    """Return the samples per pixel of a pass of the reference, which large images reduce."""
    return min(REFERENCE_SPP, LARGEST_PASS // (size[0] * size[1]))


def converged(
    ready: Prepared,
    seed: int,
    progress: Progress | None,
    total: Accumulator | None = None,
) -> Estimate:
    """Render the reference into a sum, with seeds that no method has."""
    renderer = ready.reference.sampled(_reference_spp(ready.size))
    total = total or Accumulator()
    count = max(REFERENCE_PASSES, ready.plan.passes)
    stream = Stream.OTHER_SIDE
    for rendered in passes(
        [renderer],
        seed,
        count,
        size=ready.size,
        stream=stream,
        progress=progress,
        stage="reference",
    ):
        total.add(rendered[0])
    return total.estimate()


def tried(
    firsts: Mapping[str, Renderer],
    counts: Mapping[str, Collection[int]],
    pixels: int,
    progress: Progress = lambda *_: None,
) -> dict[Key, Renderer]:
    """Return ``{(name, samples per pixel): renderer}`` for ``counts``, and some for the time.

    The largest takes at least :data:`LEAST_S`, and one a fourth of its samples. ``firsts``
    have the most samples of the method's counts. All are warm.
    """
    renderers: dict[Key, Renderer] = {}
    for number, (name, first) in enumerate(firsts.items()):
        progress("compiling", number, len(firsts))
        by_spp = {first.pass_spp: first}
        last = first
        # More samples, until one image takes long enough to time.
        while True:
            warm(last)
            seconds = last.times[-1]
            if seconds >= LEAST_S or 4 * last.pass_spp * pixels > MOST_SAMPLES:
                break
            # With a fourth of these samples it would take less than LEAST_S: counts are skipped.
            most = MOST_SAMPLES / (last.pass_spp * pixels)
            more = 4
            while more * seconds < LEAST_S and 4 * more <= most:
                more *= 4
            last = first.sampled(more * last.pass_spp)
            by_spp[last.pass_spp] = last
        # The line through the largest needs a smallest, and one between them that shows a bend.
        fewer = {max(1, last.pass_spp // 4), max(1, last.pass_spp // 16)}
        for spp in {*counts[name], *fewer} - by_spp.keys():
            by_spp[spp] = first.sampled(spp)
            warm(by_spp[spp])
        renderers |= {(name, spp): by_spp[spp] for spp in sorted(by_spp)}
    progress("compiling", len(firsts), len(firsts))
    return renderers


def rendered(
    renderers: Mapping[Key, Renderer],
    judge: Judge,
    judged: Collection[Key],
    rounds: int,
    seed: int,
    progress: Progress | None,
    stage: str,
) -> tuple[dict[Key, tuple[Interval, Interval]], dict[Key, Floats]]:
    """Render in turn, at least twice; the renderers note their times.

    Returns the errors of those that are ``judged``, mean and tolerance, and their last images.
    """
    errors: dict[Key, list[tuple[float, float]]] = {key: [] for key in renderers if key in judged}
    images: dict[Key, Floats] = {}
    loop = passes([*renderers.values()], seed, rounds, progress=progress, stage=stage)
    for images_of_pass in loop:
        for key, image in zip(renderers, images_of_pass, strict=True):
            if key in judged:
                images[key] = np.array(image)
                errors[key].append(judge(images[key]))
    return {key: _mean_errors(values) for key, values in errors.items()}, images


def _mean_errors(errors: ArrayLike) -> tuple[Interval, Interval]:
    values = np.asarray(errors)
    # Rows are rounds; columns are the mean error and the tolerance.
    means = values.mean(axis=0)
    halves = SURE * values.std(axis=0, ddof=1) / sqrt(len(values))
    lows = means - halves
    highs = means + halves
    error = Interval(value=float(means[0]), low=float(lows[0]), high=float(highs[0]))
    tolerance = Interval(value=float(means[1]), low=float(lows[1]), high=float(highs[1]))
    return error, tolerance


def timed(
    renderers: Mapping[Key, Renderer], rounds: int, pixels: int, seed: int = 0
) -> dict[str, timing.Line]:
    """Return the time of each method from the last rounds of its renderers."""
    seconds: dict[str, dict[int, tuple[Any, Any]]] = {}
    for (name, spp), renderer in renderers.items():
        # The first images, which warmed up, are not among the last rounds.
        both_times = renderer.times[-rounds:], renderer.processor_times[-rounds:]
        seconds.setdefault(name, {})[spp * pixels] = both_times
    return timing.lines(seconds, seed)


def timed_method(
    method: Method, found: Mapping[str, timing.Line], textbook: str, first: Renderer
) -> TimedMethod:
    """Return a method with its times; ``first`` rendered its first image."""
    line = found[method.name]
    return TimedMethod(
        **structs.asdict(method),
        # A difference from the shortest image's time, whose unseen share it inherits.
        overhead_s=timing.interval(line.overhead, timing.UNSEEN * line.shortest),
        per_sample_s=timing.interval(line.per_sample, timing.UNSEEN * float(line.per_sample[0])),
        ratio=timing.ratio(line, found[textbook]),
        processor_s=float(line.per_sample[0]) * line.processors,
        bend=line.bend,
        first_s=first.times[0],
        prepare_s=getattr(first.integrator, "preparation", 0.0),
    )
