"""The record of a study of cost, ``cost.json``: linear values are in units of display white."""

from typing import Annotated, Literal

from msgspec import Meta

from comparisons.departure.colour import Viewing
from comparisons.hybrids.why import Attribution, MeanError, ObjectContribution
from heuristic.heuristics import Interpolation
from reference.planning.plan import Guard
from reference.records import (
    VERSION,
    Amount,
    Count,
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
    without: tuple[str, ...] = ()
    max_depth: int | None = None
    stands_in_for: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    monte_carlo: bool = False

    @property
    def is_kernel(self) -> bool:
        """Whether the heuristic kernel renders it."""
        return self.family == "kernel"


class Converged(Record):
    """The reference with which images are compared."""

    integrator: str
    max_depth: Annotated[int, Meta(description="As Mitsuba counts; -1 is unlimited.", ge=-1)]
    spp: Annotated[int, Meta(description="Samples per pixel in all.", ge=2)]
    passes: Annotated[int, Meta(ge=2)]
    noise_floor: Annotated[float, Meta(description="Mean ΔE2000 of its noise alone.", ge=0)]
    mean_variance: Annotated[
        float, Meta(description="Subtracted from each mean squared error.", ge=0)
    ]


class LeftOut(Record):
    """A method that the scene does not allow, and why."""

    name: str
    reason: str


class Seconds(Record):
    """A time, and the ends of its interval."""

    value: Amount
    low: Amount
    high: Amount


class Measured(Record):
    """A method at one sample count.

    Attributes
    ----------
    method, spp
        Name of the method, and samples per pixel as rendered.
    seconds
        Median of the rounds. Its interval are order statistics, which hold the true median with the
        chance Cost.level, for any distribution.
    error
        Mean ΔE2000 of one rendering, averaged over the rounds, with its 95 % interval.
    mse
        Linear mean squared error less the reference's variance.
    first_s, compile_s
        Time of the first run, and LLVM's part of it.
    prepare_s
        The heuristic's part of the first run, for preparing the scene; 0 if it prepares nothing.
    pareto
        Whether it is on the front of time and error (:func:`comparisons.cost.front.pareto`).
    """

    method: str
    spp: int
    seconds: Seconds
    error: MeanError
    mse: float
    first_s: Positive
    compile_s: Amount
    prepare_s: Amount = 0.0
    pareto: bool = False


class Reached(Record):
    """When a method reaches an error.

    ``seconds`` is None if the error is not reached within the measured counts. It is an upper
    bound, ``at_most``, if the smallest measured count already reaches the error. Its interval, of
    about 95 %, covers the variation of times and errors, and ends with the measured counts. ``spp``
    is only given in predictions.
    """

    method: str
    error: Positive
    seconds: Seconds | None
    at_most: bool = False
    spp: Size | None = None


class Forecast(Record):
    """The predicted time of a later frame, and mean ΔE2000, of a method and sample count.

    Attributes
    ----------
    method, spp
        Name of the method, and samples per pixel.
    seconds, error
        Predictions, with intervals at Prediction.level.
    measured
        What was measured there; of ``cost --measure``.
    """

    method: str
    spp: Size
    seconds: Seconds
    error: MeanError
    measured: Measured | None = None


class Prediction(Record):
    """Costs of methods at a size, predicted from smaller sizes.

    Attributes
    ----------
    resolution
        The requested size.
    level
        Chance that an interval holds a later measurement.
    fitted
        The sizes measured for it.
    rounds
        Timed repeats of each method, size and sample count.
    forecasts
        One for each method and sample count.
    cheapest
        The method predicted to reach an error first, of each error; nameless if none does.
    """

    resolution: Resolution
    level: Share
    fitted: tuple[Resolution, ...]
    rounds: Size
    forecasts: tuple[Forecast, ...]
    cheapest: tuple[Reached, ...]


class Pictures(Record):
    """Half ranges of the signed pictures; red is positive."""

    effect_limit: Annotated[float, Meta(description="ΔE2000 removed.", gt=0)]


class Cost(Record, kw_only=True):
    """What accuracy costs in time on one scene; times are in seconds for one image."""

    record_version: int = VERSION
    scene: str
    variant: str
    heuristic_variant: str
    heuristic: str
    interpolation: Interpolation
    seed: Count
    resolution: Resolution
    rounds: Annotated[int, Meta(description="Timed repeats of each method.", ge=2)]
    level: Annotated[Share, Meta(description="Chance that intervals of seconds hold the median.")]
    reference: Converged
    methods: tuple[Method, ...]
    points: tuple[Measured, ...]
    equal_error: tuple[Reached, ...]
    attribution: Attribution
    closure: Annotated[
        MeanError,
        Meta(description="What remains with all effects simulated: only a fault can leave any."),
    ]
    viewing: Viewing
    pixels: Pixels
    machine: Machine
    versions: Versions
    command: str
    pictures: Pictures
    guard: Guard | None = None
    prediction: Prediction | None = None
    left_out: tuple[LeftOut, ...] = ()
    objects: Annotated[
        tuple[ObjectContribution, ...], Meta(description="What the effects remove on each shape.")
    ] = ()

    def points_of(self, method: str) -> tuple[Measured, ...]:
        """Return the points of a method."""
        return tuple(point for point in self.points if point.method == method)

    def reached_by(self, method: str) -> tuple[Reached, ...]:
        """Return when a method reaches each error."""
        return tuple(row for row in self.equal_error if row.method == method)
