"""Climb the ladder of a scene: time and error of each method, with more samples until one passes.

All methods take turns with one number of samples, which gives their times
(:mod:`fotismos.comparisons.turns`), and then with fewer: each picture is compared with a
converged reference, and has its own seed. If none passes, methods whose error still falls take four
times as many samples, as long as the result could be the cheapest.

The noise of a picture is a part of its error, and that of the reference is not. It is added to the
reference once more, and what it adds to the square of the error is taken off
(:mod:`fotismos.comparisons.departure.estimate`).
"""

import gc
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np
from msgspec import structs

from fotismos.comparisons import turns
from fotismos.comparisons.departure.criterion import LIMIT, TOLERANCE
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.ladder.front import cheapest
from fotismos.comparisons.ladder.methods import Ladder
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import Prepared, guarded
from fotismos.comparisons.records.comparison import FEWEST_SPP
from fotismos.comparisons.records.cost import Converged, Method, Point, TimedMethod
from fotismos.comparisons.turns import TURNS, UNSEEN, Time
from fotismos.heuristic.convention import Floats
from fotismos.heuristic.errors import InputError
from fotismos.reference.pairing.settings import film_size
from fotismos.reference.records import Interval
from fotismos.reference.rendering.passes import Progress, Size, Stream, pass_seed, passes
from fotismos.reference.rendering.renderer import LARGEST_PASS, Renderer
from fotismos.reference.rendering.sums import (
    Accumulator,
    DifferenceEstimate,
    DifferenceSums,
    student,
)
from fotismos.reference.scene.source import Source

LARGEST_CERTAIN_SPP = 16
"""Most samples per pixel of methods without random numbers: only the pixel filter needs them."""

LARGEST_SPP = 64
"""Samples per pixel with which all others are measured; more only until one passes."""

WIDTH = 128
QUICK_WIDTH = 64
"""Default width of an image in pixels: the time of a sample does not depend on it."""

REFERENCE_SPP = 64
REFERENCE_PASSES = 16
"""Samples per pixel of each pass of the converged reference, and passes at least."""

NEAR_TOLERANCE = 1.25
"""Factor by which the tolerance without noise, predicted from two counts, may be too large."""

FEW_PICTURES = 3
"""Pictures with more samples than :data:`LARGEST_SPP`, at most: their errors hardly scatter."""

MOST_SAMPLES = 2**24
MOST_S = 60.0
"""Samples of one image, and predicted seconds of a number of samples, beyond which none follows."""


@dataclass(frozen=True)
class Effort:
    """How much is rendered for a study: ``rounds`` of each method, at least 2, and which methods.

    Errors are measured up to ``largest`` samples per pixel, at most :data:`LARGEST_CERTAIN_SPP` for
    methods without random numbers. The counts are powers of 4, at which the sampler stratifies
    best. If it ``goes_on``, more follow until a method passes.
    """

    rounds: int = TURNS
    largest: int = LARGEST_SPP
    is_short: bool = False
    goes_on: bool = True

    def __post_init__(self) -> None:
        if self.rounds < 2:
            raise InputError(f"rounds = {self.rounds} is not allowed: give at least 2.")

    def counts(self, method: Method) -> tuple[int, ...]:
        """Return the sample counts at which the error of a method is measured."""
        most = self.largest if method.monte_carlo else min(self.largest, LARGEST_CERTAIN_SPP)
        counts = [FEWEST_SPP]
        while 4 * counts[-1] <= most:
            counts.append(4 * counts[-1])
        return tuple(counts) if most >= FEWEST_SPP else (most,)


QUICK = Effort(rounds=3, largest=16, is_short=True, goes_on=False)
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


Errors = tuple[Interval, Interval]
"""Of some pictures: their mean ΔE2000, and what a share LIMIT of the pixels exceeds."""


class Climb:
    """A prepared scene whose ladder is measured: its methods, their times and their errors.

    ``steps`` also need methods that are not on the ladder: they are timed, not judged. ``images``
    are ``{method: (H, W, 3)}``, a rendering with the most samples of each. ``stopped`` says why no
    more samples were taken, in words, where more may help. ``total`` sums the passes of the
    reference, of which no other image is taken off.
    """

    def __init__(self, ready: Prepared, effort: Effort, progress: Progress) -> None:
        self.ready = ready
        self.effort = effort
        self.ladder = Ladder(ready, is_short=effort.is_short)
        self.steps = tuple(self.ladder.steps())
        self.total = DifferenceSums(ready.counted)
        self.images: dict[str, Floats] = {}
        self.stopped = ""
        self._progress = progress
        self._times: dict[str, Time] = {}
        self._renderers: dict[str, Renderer] = {}
        self._errors: dict[str, dict[int, Errors]] = {
            method.name: {} for method in self.ladder.methods
        }
        converge(ready, self.total, REFERENCE_PASSES, progress)
        self._errors_of = self._against_reference()
        gc.collect()  # release scenes that pairing left behind

    @property
    def size(self) -> Size:
        """Width and height of the images."""
        return self.ready.size

    @property
    def reference(self) -> DifferenceEstimate:
        """The converged reference."""
        return self.total.estimate()

    @property
    def textbook(self) -> Time:
        """The time of the textbook kernel as requested."""
        return self._times[self.steps[0].before.name]

    def processors(self) -> float:
        """Return how many processors worked at once: each picture occupies all threads."""
        return float(np.median([time.processors for time in self._times.values()]))

    def time(self, method: Method) -> Time:
        """Return the time of a method of the ladder, or of a step."""
        return self._times[method.name]

    def methods(self) -> tuple[TimedMethod, ...]:
        """Return the methods with their times."""
        return tuple(self._timed(method) for method in self.ladder.methods)

    def points(self, at: Size | None = None) -> tuple[Point, ...]:
        """Return all methods with the samples that they were measured with, error and time.

        The time is that of an image ``at`` a size; the study's own if omitted.
        """
        width, height = at or self.size
        return tuple(
            Point(
                method=method.name,
                spp=spp,
                seconds=method.seconds(spp * width * height),
                error=error,
                tolerance=tolerance,
            )
            for method in self.methods()
            for spp, (error, tolerance) in sorted(self._errors[method.name].items())
        )

    def converged(self) -> Converged:
        """Return what the reference is."""
        reference = self.reference
        return Converged(
            integrator=self.ready.plan.integrator,
            max_depth=self.ready.plan.max_depth,
            spp=_reference_spp(self.size) * reference.passes,
            passes=reference.passes,
            noise_floor=float(self._plain_errors()(reference.mean + reference.noise)[0]),
        )

    def measure(self, tolerance: float) -> None:
        """Measure all methods, and with more samples until the cheapest that passes is known."""
        of_steps = [method for step in self.steps for method in (step.before, step.after)]
        wanted = {method.name: method for method in (*of_steps, *self.ladder.methods)}
        spp = self._timed_spp()
        self._renderers = {
            name: self.ladder.renderer(method, spp) for name, method in wanted.items()
        }
        counts = {method.name: self.effort.counts(method) for method in self.ladder.methods}
        # The first turn compiles: its times do not count.
        judged = [name for name, of_method in counts.items() if spp in of_method]
        self._render(self._renderers, judged, spp, self.effort.rounds + 1)
        self._times = {
            name: Time.of(renderer, self.size, self.effort.rounds)
            for name, renderer in self._renderers.items()
        }
        others = {count for of_method in counts.values() for count in of_method} - {spp}
        for count in sorted(others):
            names = [name for name, of_method in counts.items() if count in of_method]
            self._judge(names, count, self.effort.rounds)
        if self.effort.goes_on:
            self._go_on(tolerance)

    def _timed_spp(self) -> int:
        """Return the samples per pixel with which times are measured."""
        width, height = self.size
        most = LARGEST_PASS // (width * height)
        return min(max(self.effort.largest, turns.timed_spp(self.size)), most)

    def _go_on(self, tolerance: float) -> None:
        """Take more samples with each method that may pass, and then be the cheapest."""
        spp = self.effort.largest
        pixels = self.size[0] * self.size[1]
        while True:
            spp *= 4
            best = cheapest(self.points(), tolerance)
            seconds = {
                method.name: method.seconds(spp * pixels).value
                for method in self.methods()
                if method.monte_carlo and self._may_pass(method, tolerance)
            }
            if best is not None:
                limit = best.seconds.value
                seconds = {name: time for name, time in seconds.items() if time < limit}
            if not seconds:
                return
            rounds = min(self.effort.rounds, FEW_PICTURES)
            reason = ""
            if sum(seconds.values()) * rounds > MOST_S:
                reason = f"{spp:,} samples would take more than {MOST_S:g} s"
            elif spp * pixels > MOST_SAMPLES:
                reason = f"{spp:,} samples are more than an image of this size is given"
            if reason:
                self.stopped = "" if best else reason
                return
            more = spp // _reference_spp(self.size) - self.total.count
            if more > 0:
                converge(self.ready, self.total, more + more % 2, self._progress)
                self._errors_of = self._against_reference()
            self._judge(list(seconds), spp, rounds)

    def _may_pass(self, method: Method, tolerance: float) -> bool:
        """Return whether a method fails, and noise may be why.

        The tolerances T with two numbers of samples n obey ``T² = left² + noise² / n``.
        """
        known = self._errors[method.name]
        *fewer, most = sorted(known)
        if known[most][1].high <= tolerance:
            return False
        if not fewer:
            return True
        few = fewer[-1]
        square = known[most][1].value ** 2
        left: float = square - (known[few][1].value ** 2 - square) * few / (most - few)
        return left <= (NEAR_TOLERANCE * tolerance) ** 2

    def _judge(self, names: Sequence[str], spp: int, rounds: int) -> None:
        """Measure the errors of methods with some samples."""
        renderers = {name: self._renderers[name].sampled(spp) for name in names}
        self._render(renderers, names, spp, rounds)

    def _render(
        self, renderers: Mapping[str, Renderer], judged: Sequence[str], spp: int, rounds: int
    ) -> None:
        """Render in turn, and note the errors of the methods that are judged."""
        measured: dict[str, list[Floats]] = {name: [] for name in judged}
        seed = self.ready.options.seed
        for images in turns.in_turn(renderers, seed, rounds - 1, progress=self._progress):
            for name, errors in measured.items():
                image = np.array(images[name])
                errors.append(self._errors_of(image))
                if spp >= max(self._errors[name], default=0):
                    self.images[name] = image
        for name, errors in measured.items():
            mean, tolerance = np.transpose(errors)
            self._errors[name][spp] = _mean_error(mean), _mean_error(tolerance)

    def _against_reference(self) -> Callable[[Floats], Floats]:
        """Return what measures an image's mean ΔE2000, and what a share LIMIT of pixels exceed."""
        plain = self._plain_errors()
        noisier = self._plain_errors(self.total.noise())

        def errors(image: Floats) -> Floats:
            squares: Floats = np.maximum(2 * plain(image) ** 2 - noisier(image) ** 2, 0.0)
            return np.sqrt(squares)

        return errors

    def _plain_errors(self, noise: Floats | float = 0.0) -> Callable[[Floats], Floats]:
        """Return what measures both errors (2,), with the reference's noise, and more noise."""
        ready = self.ready
        reference = self.total.mean() + noise
        distances = LEADING.against(reference, ready.counted, ready.options.viewing)

        def errors(image: Floats) -> Floats:
            pixels = distances(image)
            return np.array([LEADING.mean(pixels), np.quantile(pixels, 1 - LIMIT)])

        return errors

    def _timed(self, method: Method) -> TimedMethod:
        """Return a method with its times."""
        time = self._times[method.name]
        first = self._renderers[method.name]
        return TimedMethod(
            **structs.asdict(method),
            overhead_s=turns.middle(time.overhead, UNSEEN * float(np.median(time.overhead))),
            per_sample_s=turns.middle(time.per_sample, UNSEEN * float(np.median(time.per_sample))),
            ratio=turns.ratio(time, self.textbook),
            first_s=first.times[0],
            prepare_s=first.preparation,
        )


def climbed(
    source: Source,
    options: Options,
    effort: Effort,
    progress: Progress,
    at: Size | None = None,
    tolerance: float = TOLERANCE,
) -> Climb:
    """Measure every method of a scene's ladder, in the current variant.

    If ``options.resolution`` is omitted, that of ``at``, or of the film, is reduced to
    :data:`WIDTH`. ``options.spp`` is the largest sample count of a Monte Carlo method; without it,
    more samples are taken until a method passes at ``tolerance``.
    """
    options.require_model("a study of cost")
    if options.resolution is None:
        shaped = options.changed(resolution=at)
        options = options.changed(resolution=reduced(source, shaped, WIDTH))
    if options.spp is not None:
        effort = replace(effort, largest=options.spp, goes_on=False)
    ready = guarded(source, options.changed(spp=None, allow_empty=False))
    climb = Climb(ready, effort, progress)
    climb.measure(tolerance)
    return climb


def _reference_spp(size: Size) -> int:
    """Return the samples per pixel of a pass of the reference, which large images reduce."""
    return min(REFERENCE_SPP, LARGEST_PASS // (size[0] * size[1]))


def converge(
    ready: Prepared, total: Accumulator, count: int, progress: Progress | None = None
) -> None:
    """Add passes of the reference to a sum, at least as many as the plan has, with other seeds.

    No method has these seeds, nor have the passes that the sum has already.
    """
    renderer = ready.reference.sampled(_reference_spp(ready.size))
    loop = passes(
        [renderer],
        pass_seed(ready.options.seed, total.count, Stream.OTHER_SIDE),
        count if total.count else max(count, ready.plan.passes),
        size=ready.size,
        stream=Stream.OTHER_SIDE,
        progress=progress,
        stage="reference",
    )
    for rendered in loop:
        total.add(rendered[0])


def _mean_error(errors: Floats) -> Interval:
    """Return the mean of the errors of pictures, with its interval."""
    count = len(errors)
    return student(float(np.mean(errors)), float(np.std(errors, ddof=1)) / sqrt(count), count)
