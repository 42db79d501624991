"""The record of a study of cost, ``cost.json``: linear values are in units of display white."""

from typing import Annotated, Literal

from msgspec import Meta

from comparisons.comparison import GuardRecord
from comparisons.departure.spaces import Viewing
from comparisons.effects.corners import Corner
from comparisons.records import (
    VERSION,
    Amount,
    Count,
    Estimated,
    Machine,
    Pixels,
    Positive,
    Record,
    Resolution,
    Share,
    Size,
    Versions,
)
from heuristic.interpolation import Interpolation

Family = Literal["kernel", "phong BSDF", "physical"]


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


class Rung(Record):
    """A method that differs from all others in this scene."""

    name: str
    names: Annotated[tuple[str, ...], Meta(description="All its names in this scene.")]
    monte_carlo: Annotated[bool, Meta(description="Random beyond the pixel filter.")]
    family: Family


class LeftOut(Record):
    """A method that the scene does not allow, and why."""

    name: str
    reason: str


class Interval(Record):
    """The median of repeats, their quartiles, and an interval for the median.

    ``low`` and ``high`` are order statistics; ``level`` is the chance that they hold the true
    median, for any distribution. With fewer than six repeats even the extremes do not reach 95 %;
    ``level`` is the chance that they do reach.
    """

    median: Positive
    p25: Positive
    p75: Positive
    low: Positive
    high: Positive
    level: Annotated[float, Meta(ge=0, le=1)]
    repeats: int


class Measured(Record):
    """A rung at one sample count.

    Attributes
    ----------
    rung, spp
        Name of the rung, and samples per pixel as rendered.
    first_s, compile_s
        Time of the first run, and LLVM's part of it.
    prepare_s
        The heuristic's part of the first run, for preparing the scene; 0 if it prepares nothing.
    seconds
        Times of the rounds.
    error, error_stderr
        Mean ΔE2000 of one rendering, averaged over the rounds, and its standard error.
    mse, mse_stderr
        Linear mean squared error less the reference's variance, and its standard error.
    pareto
        Whether it is on the front of time and error (:func:`comparisons.cost.front.pareto`).
    """

    rung: str
    spp: int
    first_s: Positive
    compile_s: Amount
    seconds: Interval
    error: Amount
    error_stderr: Amount
    mse: float
    mse_stderr: Amount
    pareto: bool = False
    prepare_s: Amount = 0.0


class Within(Record):
    """The best point within a time; None if none is as fast."""

    seconds: Positive
    best: Measured | None


class Range(Record):
    """A derived value, and the ends of its interval."""

    value: Amount
    low: Amount
    high: Amount


class Reached(Record):
    """When a method reaches an error.

    ``seconds`` is None if the error is not reached within the measured counts. It is an upper
    bound, ``at_most``, if the smallest measured count already reaches the error. Its interval, of
    about 95 %, covers the variation of times and errors, and ends with the measured counts.
    """

    method: str
    error: Positive
    seconds: Range | None
    at_most: bool = False


class Price(Record):
    """What simulating one effect buys and costs.

    Attributes
    ----------
    effect
        Its label.
    removes
        Mean ΔE2000 that it removes; negative if it increases the departure.
    alone, last
        The same if it is the first effect added, and the last.
    adds_s
        Seconds that it adds to one rendering with Prices.spp samples per pixel.
    sampling_error
        Standard error of ``removes`` from drawing orders; 0 if all subsets were rendered.
    """

    effect: str
    removes: Estimated
    alone: float
    last: float
    adds_s: Estimated
    sampling_error: Amount


class ObjectPrice(Record):
    """What each effect removes from the departure on one shape.

    Attributes
    ----------
    name
        Id of the shape.
    pixels
        Number of counted pixels that see it.
    share
        Its part of the departure.
    departure
        Mean ΔE2000 of the heuristic half on it, without noise.
    removes
        Mean ΔE2000 that each effect removes there, in the order of :attr:`Prices.effects`.
    left
        Mean ΔE2000 that remains there when all effects are simulated.
    """

    name: str
    pixels: Size
    share: float
    departure: float
    removes: tuple[Estimated, ...]
    left: float


class Closure(Record):
    """Mean ΔE2000 that remains when all effects are simulated, without noise, and its interval.

    Only a fault can leave any.
    """

    mean: float
    low: float
    high: float


class Prices(Record):
    """The prices of all effects.

    Attributes
    ----------
    effects
        One :class:`Price` each.
    departure
        Mean ΔE2000 of the heuristic half without noise: the sum of prices and closure.
    floor
        Mean ΔE2000 of noise alone: of the reference rendered with as many samples. It is removed
        from prices and closure.
    kernel_s, reference_s
        Seconds without any effect, and with all of them.
    spp, replicates, orders
        Samples per pixel of each replicate, number of replicates, and orders drawn (0: every
        subset).
    corners
        All sets of effects that were rendered.
    """

    effects: tuple[Price, ...]
    departure: float
    floor: Amount
    kernel_s: Positive
    reference_s: Positive
    spp: int
    replicates: int
    orders: int
    corners: tuple[Corner, ...] = ()


class Seen(Record):
    """Measurements to check a forecast: time, mean ΔE2000, and its spread over rounds."""

    seconds: Interval
    error: Amount
    error_spread: Amount


class Forecast(Record):
    """Predicted time of a later frame, and mean ΔE2000, of a method and sample count."""

    method: str
    spp: Size
    seconds: Range
    error: Range
    measured: Seen | None = None


class TimeLaw(Record):
    """A method's time, ``setup_s + pixel_s N + sample_s N s`` for ``N`` pixels of ``s`` samples.

    ``scatter`` is the relative spread of the measurements about it.
    """

    method: str
    setup_s: Amount
    pixel_s: Amount
    sample_s: Amount
    scatter: Amount


class Cheapest(Record):
    """The method predicted to reach an error first; none if no method does."""

    error: Positive
    method: str | None = None
    spp: Size | None = None
    seconds: Range | None = None


class AskedPrice(Record):
    """The mean ΔE2000 that an effect is predicted to remove, and the time that it adds."""

    effect: str
    removes: Estimated
    adds_s: Estimated


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
    laws, forecasts, cheapest
        One law of time per method, forecasts over the sample counts, and the cheapest methods.
    prices
        Prices of the effects, with the sample counts of the study's own prices.
    """

    resolution: Resolution
    level: Share
    fitted: tuple[Resolution, ...]
    rounds: Size
    laws: tuple[TimeLaw, ...]
    forecasts: tuple[Forecast, ...]
    cheapest: tuple[Cheapest, ...]
    prices: tuple[AskedPrice, ...] = ()


class Part(Record):
    """One cause of the departure.

    Attributes
    ----------
    name
        Its name in tables.
    mean, mean_stderr
        Signed mean over the counted pixels and channels, linear, and its standard error.
    rms
        Root mean square.
    dE2000
        Mean ΔE2000 between the two images; the values of parts do not add up.
    """

    name: str
    mean: float
    mean_stderr: Amount
    rms: Amount
    dE2000: Amount


class Split(Record):
    """The departure by causes, which add up at every pixel."""

    parts: Annotated[tuple[Part, ...], Meta(description="From the kernel to the reference.")]
    departure: Part


class Pictures(Record):
    """Half ranges of the signed pictures; red is positive."""

    part_limit: Annotated[float, Meta(description="Linear.", gt=0)]
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
    reference: Converged
    rungs: tuple[Rung, ...]
    points: tuple[Measured, ...]
    equal_time: tuple[Within, ...]
    equal_error: tuple[Reached, ...]
    prices: Prices
    closure: Closure
    split: Split
    viewing: Viewing
    pixels: Pixels
    machine: Machine
    versions: Versions
    command: str
    pictures: Pictures
    guard: GuardRecord | None = None
    prediction: Prediction | None = None
    left_out: tuple[LeftOut, ...] = ()
    objects: Annotated[
        tuple[ObjectPrice, ...], Meta(description="Prices of the effects on each shape.")
    ] = ()

    def points_of(self, rung: str) -> tuple[Measured, ...]:
        """Return the points of a rung."""
        return tuple(point for point in self.points if point.rung == rung)

    def reached_by(self, rung: str) -> tuple[Reached, ...]:
        """Return when a rung reaches each error."""
        return tuple(row for row in self.equal_error if row.method == rung)
