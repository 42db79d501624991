"""The record of a study of cost, ``cost.json``."""

from typing import Annotated, Literal

from msgspec import Meta

from fotismos.comparisons.records.comparison import Contribution, Price
from fotismos.comparisons.records.departure import Viewing
from fotismos.comparisons.records.engine import Engine, FrontPoint
from fotismos.heuristic.heuristics import Interpolation
from fotismos.reference.planning.plan_record import Guard
from fotismos.reference.records import (
    VERSION,
    Amount,
    Count,
    Interval,
    Machine,
    Pixels,
    Positive,
    Record,
    Resolution,
    Share,
    Size,
    Versions,
)

Family = Literal["kernel", "phong BSDF", "physical"]
"""Kind of shading: charts give each family a colour and a shape."""


class Method(Record):
    """One way to render: a kernel with options, or a scene's plan with effects left out.

    Attributes
    ----------
    name
        Its name in tables and charts.
    family
        Kind of shading.
    interpolation, shadows, heuristic
        Of a kernel: how it shades, whether it traces shadow rays, and the declared heuristic that
        shades, if not the one under study.
    variant
        Of a kernel: its Mitsuba variant, if not that of the heuristic half.
    without, max_depth
        Of a plan: effects to leave out, and the limit of path length as Mitsuba counts, if not the
        scene's own.
    stands_in_for
        Effects of which the scene must have at least one; none for a method of every scene.
    names
        The names of all methods that do not differ from it in this scene.
    monte_carlo
        Random beyond the pixel filter.
    """

    name: str
    family: Family
    interpolation: Interpolation = Interpolation.PHONG
    shadows: bool = False
    heuristic: str = ""
    variant: str = ""
    without: tuple[str, ...] = ()
    max_depth: int | None = None
    stands_in_for: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    monte_carlo: bool = False

    @property
    def is_kernel(self) -> bool:
        """Whether the heuristic kernel renders it."""
        return self.family == "kernel"


class TimedMethod(Method):
    """A method and its time: ``overhead_s + per_sample_s * samples`` for one image.

    Attributes
    ----------
    overhead_s, per_sample_s
        Wall time in seconds of a later image beside its kernels, and that of the kernels for each
        sample of a pixel.
    ratio
        ``per_sample_s`` over that of the textbook kernel.
    first_s, prepare_s
        Time of the first image, which is also compiled, and of preparing the scene for it.
    """

    overhead_s: Interval
    per_sample_s: Interval
    ratio: Interval
    first_s: Positive
    prepare_s: Amount = 0.0

    def seconds(self, samples: int) -> Interval:
        """Return the time of an image with some samples over all pixels."""
        fixed = self.overhead_s
        slope = self.per_sample_s
        return Interval(
            value=max(fixed.value + samples * slope.value, 0.0),
            low=max(fixed.low + samples * slope.low, 0.0),
            high=max(fixed.high + samples * slope.high, 0.0),
        )


class Point(FrontPoint):
    """A method at one sample count; its time follows from overhead and time per sample.

    Attributes
    ----------
    spp
        Samples per pixel.
    tolerance
        The ΔE2000 that at most 5 % of an image's pixels exceed: the method passes at this
        tolerance and at larger ones.
    """

    spp: Size
    tolerance: Interval


class Converged(Record):
    """The reference with which images are compared."""

    integrator: str
    max_depth: Annotated[int, Meta(description="As Mitsuba counts; -1 is unlimited.", ge=-1)]
    spp: Annotated[int, Meta(description="Samples per pixel in all.", ge=2)]
    passes: Annotated[int, Meta(ge=2)]
    noise_floor: Annotated[float, Meta(description="Mean ΔE2000 of its noise alone.", ge=0)]


class EffectCost(Contribution):
    """What simulating one effect removes, and the seconds that it adds to an image."""

    adds_s: Interval


class CostAttribution(Record):
    """What all effects remove and add.

    Attributes
    ----------
    effects
        One for each effect. What they add, and ``renderer_s``, is ``plan_s`` less ``kernel_s``.
        What they remove is measured like ``departure``.
    departure, size
        Mean ΔE2000 of the heuristic half, without noise, and the size of the images that it and
        what is removed are measured on. In a report this is the small film of its causes, at most
        48 pixels wide, on which fine highlights are averaged.
    kernel_s, plan_s
        Seconds that the samples of an image take with no effect, and with all of them, without
        overhead.
    renderer_s
        Seconds that Mitsuba's integrator, on the scene's own shapes, takes more than the kernel to
        simulate the same effects.
    resolution, spp
        Size of the image that the seconds are of, and its samples per pixel.
    """

    effects: tuple[EffectCost, ...]
    departure: float
    size: Resolution
    kernel_s: Interval
    plan_s: Interval
    renderer_s: Interval
    resolution: Resolution
    spp: Size


class Cost(Record):
    """What accuracy costs in time on one scene; times are in seconds for one image.

    Attributes
    ----------
    threads
        Threads that render.
    processor_share
        Processor time that samples took, as a share of what these threads could take: the rest
        went to other programs.
    at
        Another size, of which the times of points are; errors are not predicted.
    stopped
        Why no more samples were taken, in words, where none passes and more may help; else empty.
    left_out
        Methods that the scene does not allow, and why.
    engine
        Pictures of another renderer with their times, both given.
    """

    record_version: int = VERSION
    scene: str
    variant: str
    heuristic_variant: str
    heuristic: str
    interpolation: Interpolation
    seed: Count
    resolution: Resolution
    rounds: Annotated[int, Meta(description="Timed repeats of each method.", ge=2)]
    threads: Size
    processor_share: Share
    reference: Converged
    methods: tuple[TimedMethod, ...]
    points: tuple[Point, ...]
    attribution: CostAttribution
    closure: Annotated[
        Interval,
        Meta(description="What remains with all effects simulated: only a fault can leave any."),
    ]
    viewing: Viewing
    pixels: Pixels
    machine: Machine
    versions: Versions
    command: str
    guard: Guard | None = None
    at: Resolution | None = None
    stopped: str = ""
    left_out: dict[str, str]
    engine: Engine | None = None

    @property
    def is_busy(self) -> bool:
        """Whether other programs took processor time while it was measured."""
        return self.processor_share < LEAST_SHARE

    def method(self, name: str) -> TimedMethod:
        """Return a method by any of its names, also one that was merged with another."""
        return next(method for method in self.methods if name in (method.name, *method.names))


LEAST_SHARE = 0.85
"""Share of the threads' processor time: less tells of a busy machine."""


class Choice(Record):
    """The answer of ``fotismos plan --within``.

    Attributes
    ----------
    resolution, measured
        Size of the times, and of the images in which errors were measured.
    within
        The tolerance, ΔE2000.
    points, textbook
        All points with their times at this size, and the name of the textbook kernel.
    chosen
        The cheapest point that passes; None if none does.
    left_out
        Methods that the scene cannot have, and why.
    stopped
        Why no more samples were taken, in words, where none passes and more may help; else empty.
    price
        What it takes to look right without these methods.
    """

    scene: str
    resolution: Resolution
    measured: Resolution
    within: Positive
    points: tuple[Point, ...]
    textbook: str
    chosen: Point | None
    left_out: dict[str, str]
    stopped: str = ""
    price: Price | None = None
    record_version: int = VERSION
