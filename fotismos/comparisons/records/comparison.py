"""The record of a comparison, ``comparison.json``: its price, its causes and its pictures."""

from collections.abc import Mapping
from typing import Annotated, Literal

from msgspec import Meta

from fotismos.comparisons.records.departure import (
    ObjectShare,
    RatioSummary,
    Region,
    Significant,
    Summary,
    Viewing,
)
from fotismos.reference.pairing.pairing_record import Override, Pairing, Unrepresentable
from fotismos.reference.planning.plan_record import Plan
from fotismos.reference.records import (
    VERSION,
    Amount,
    Count,
    Interval,
    Pixels,
    Positive,
    Record,
    Resolution,
    Size,
    Times,
    Versions,
)

CAUSES = "causes"
"""The stage that finds causes."""

FEWEST_SPP = 4
MOST_SPP = 65536
"""Samples per pixel: the fewest that smooth edges, and the most that a price names."""


class SamplesThatPass(Record):
    """The fewest samples per pixel with which the physical half passes at a threshold.

    They are powers of 4, from :data:`FEWEST_SPP` to :data:`MOST_SPP`; null means more.

    Attributes
    ----------
    low, high
        With fewer it fails for sure, and with ``high`` it passes for sure.
    """

    threshold: Positive
    value: Size | None
    low: Size | None
    high: Size | None


class EffectsThatPass(Record):
    """The fewest effects that must be simulated to pass surely at a threshold.

    Attributes
    ----------
    visible
        The share of pixels that still differ visibly, with its interval.
    """

    threshold: Positive
    effects: tuple[str, ...]
    visible: Interval


class Saving(Record):
    """What a plan saves over everything simulated: factors, above 1 where it does.

    Attributes
    ----------
    time
        Of a sample.
    noise
        Of the standard deviation of a sample; null if the plan has no noise.
    """

    time: Positive
    noise: Positive | None


class Price(Record):
    """What it takes to look right.

    Attributes
    ----------
    ratio
        Time per sample of the physical half over the textbook's; null if it is not known.
    reason
        Why there is no ratio; empty if there is one.
    heuristic_s, reference_s
        Seconds per sample and pixel; null of pictures.
    everything_s
        That of the physical half with everything simulated; null if its plan leaves out nothing.
    pixels
        Of the scene's picture.
    samples
        For each threshold; empty if they were not asked for.
    needed
        For each threshold; null without causes.
    left_out
        What the plan proved to change nothing, as nouns.
    saved
        What leaving it out saves; null if nothing was left out.
    """

    ratio: Interval | None
    reason: str
    heuristic_s: Amount | None
    reference_s: Amount | None
    everything_s: Amount | None = None
    pixels: Size
    samples: tuple[SamplesThatPass, ...] = ()
    needed: tuple[EffectsThatPass, ...] | None = None
    left_out: tuple[str, ...] = ()
    saved: Saving | None = None

    def samples_at(self, threshold: float) -> SamplesThatPass | None:
        """Return the samples that pass at a threshold, if they are known."""
        return next((found for found in self.samples if found.threshold == threshold), None)

    def needed_at(self, threshold: float) -> EffectsThatPass | None:
        """Return the effects that pass at a threshold, if they are known."""
        return next((found for found in self.needed or () if found.threshold == threshold), None)

    def seconds(self, spp: int) -> float | None:
        """Return the time of a physical picture with some samples per pixel, if it is known."""
        return None if self.reference_s is None else self.reference_s * self.pixels * spp

    def times(self, spp: int) -> float | None:
        """Return this time over that of the textbook picture with :data:`FEWEST_SPP` samples."""
        return None if self.ratio is None else self.ratio.value * spp / FEWEST_SPP


class TimeSpent(Record):
    """Times of both renderings, and of other work by stage; for ratios see :class:`Price`."""

    heuristic: Times
    reference: Times
    stages: dict[str, float]

    @property
    def total_s(self) -> float:
        """The time of the comparison: passes and all stages."""
        return self.heuristic.total_s + self.reference.total_s + sum(self.stages.values())


class NoiseTarget(Record):
    """Where a run with a noise target ended.

    Both are 95th percentiles of the noise in ΔE2000 over the counted pixels: as requested, and as
    predicted from the spread of the passes.
    """

    target: Positive
    reached: Amount
    stopped_by: Literal["target", "samples"]
    limit_spp: Annotated[int, Meta(ge=2, description="Samples per pixel that end a run.")]


class Contribution(Record):
    """What simulating one effect removes.

    Attributes
    ----------
    removes
        Mean ΔE2000 that it removes; negative if it increases the departure.
    alone, last
        The same if it is the first effect added, and the last.
    sampling_error
        Standard error of ``removes`` from drawing orders; 0 if all subsets were rendered.
    """

    effect: str
    removes: Interval
    alone: float
    last: float
    sampling_error: Amount


class ObjectContribution(Record):
    """What each effect removes from the departure on one shape.

    Weighted by their pixels, the values of all shapes average to those of the whole image.

    Attributes
    ----------
    pixels
        Number of counted pixels that see it.
    share
        Its part of the departure.
    departure
        Mean ΔE2000 of the textbook half on it, without noise.
    removes
        Mean ΔE2000 that each effect removes there, in the order of the attribution's effects.
    left
        Mean ΔE2000 that remains there when all effects are simulated.
    """

    name: str
    pixels: Size
    share: float
    departure: float
    removes: tuple[Interval, ...]
    left: float


class Hybrid(Record):
    """An image in which some effects are simulated, and its mean ΔE2000 without noise."""

    effects: tuple[str, ...]
    error: float


class Attribution(Record):
    """What the effects remove from the departure of the textbook half.

    Attributes
    ----------
    effects
        One contribution each. They and the closure add up to the departure.
    departure
        Mean ΔE2000 of the textbook half, without noise.
    closure
        What remains with all effects simulated: only a fault can leave any.
    implementation
        Mean ΔE2000 between the kernel and its plugin under Mitsuba's direct light: rounding.
    resolution, spp, replicates
        Size of the images, samples per pixel of each replicate, and their number.
    orders
        Orders of the effects that were drawn; 0 if every subset was rendered.
    hybrids
        All images that were rendered, fewest effects first.
    """

    effects: tuple[Contribution, ...]
    departure: float
    closure: Interval
    implementation: Amount
    resolution: Resolution
    spp: Size
    replicates: Size
    orders: int
    hybrids: tuple[Hybrid, ...] = ()
    objects: tuple[ObjectContribution, ...] = ()

    @property
    def sure(self) -> dict[str, Interval]:
        """What effects remove that surely remove something, the largest first."""
        removes = {part.effect: part.removes for part in self.effects if part.removes.low > 0}
        return dict(sorted(removes.items(), key=lambda found: -found[1].value))

    @property
    def foremost(self) -> tuple[str, ...]:
        """The effect that removes most for sure, and those that are tied with it."""
        return tied(self.sure)


TIED = "; "
"""Between the names of effects that are tied."""


def tied(removes: Mapping[str, Interval]) -> tuple[str, ...]:
    """Return the first effect, the one that removes most, and those whose intervals reach its."""
    if not removes:
        return ()
    least = next(iter(removes.values())).low
    return tuple(effect for effect, interval in removes.items() if interval.high >= least)


class PictureFiles(Record):
    """The pictures that replace a half.

    Attributes
    ----------
    digests
        SHA-256 of the files, in hexadecimal digits.
    transfer
        Transfer function of their values, as stated; null if the files' own was taken.
    tone_map
        The curve by which the reference was shown, as they were; null for linear light.
    notes
        How the files were read, where they do not say it plainly.
    repeats
        Their number: the spread of several gives their noise.
    """

    files: tuple[str, ...]
    digests: tuple[str, ...] = ()
    transfer: str | None
    tone_map: str | None = None
    notes: tuple[str, ...] = ()
    repeats: Size


class Agreement(Record):
    """How pictures agree with the other half, and the mistakes that they seem to have.

    Attributes
    ----------
    shift
        Pixels by which their content is too far right and too low; null if their edges are
        uninformative.
    edges
        Correlation of their edges with the expected ones.
    ratio
        How many times as strong red, green and blue are as in the other half: medians over
        blocks of pixels that are lit, and not clipped.
    mistakes
        Mistakes that they seem to have, each with the number that mends it, and what is then left.
    certain
        Whether the mistakes are certain, since mending them leaves too little for noise to explain.
    odd
        What else is odd about them, in words.
    """

    shift: tuple[float, float] | None
    edges: float
    ratio: tuple[float, float, float]
    mistakes: tuple[str, ...] = ()
    certain: bool = False
    odd: tuple[str, ...] = ()


class Deviations(Record):
    """How far the colour differences are from those that colour-science itself computes.

    Attributes
    ----------
    pixels
        Number of counted pixels at which both were computed, drawn with a fixed seed.
    largest
        Largest deviation of each metric that colour-science has.
    """

    pixels: Count
    largest: dict[str, Amount]


class ComparisonRecord(Record):
    """One scene by textbook shading (heuristic) and by physically based rendering (reference).

    Pictures of other renderers may replace either half. What belongs to a scene is null where both
    are pictures, and what belongs to the physical half, where that is one.

    Times are in seconds; linear values are in units of display white; every number is finite.
    """

    scene: Annotated[
        str, Meta(description="Built-in name or path of the file, as given; else the picture's.")
    ]
    variant: Annotated[str | None, Meta(description="Mitsuba variant of the scene.")] = None
    heuristic_variant: str | None = None
    heuristic: str
    interpolation: Literal["flat", "gouraud", "phong"] | None = None
    seed: Annotated[Count, Meta(description="Seed of the run; each pass hashes its own from it.")]
    resolution: Resolution
    plan: Annotated[Plan | None, Meta(description="How the reference was rendered.")] = None
    viewing: Viewing
    metrics: Annotated[dict[str, Summary], Meta(description="The summary of each declared metric.")]
    log2_luminance: RatioSummary
    significant: Significant
    pixels: Pixels
    regions: Annotated[
        tuple[Region, ...],
        Meta(description="Boxes that hold most of dE2000, the most valuable first."),
    ]
    objects: Annotated[
        tuple[ObjectShare, ...],
        Meta(description="Shapes by share of dE2000; the last may hold all others."),
    ] = ()
    materials: Annotated[
        tuple[ObjectShare, ...], Meta(description="The same for their BSDFs.")
    ] = ()
    pairing: Pairing | None = None
    time: TimeSpent
    price: Annotated[Price | None, Meta(description="What it takes to look right.")] = None
    unrepresentable: tuple[Unrepresentable, ...] = ()
    integrator_given: Annotated[str | None, Meta(description="The scene's own integrator.")] = None
    overridden: tuple[Override, ...] = ()
    warnings: tuple[str, ...] = ()
    versions: Versions
    command: Annotated[str, Meta(description="Repeats this comparison.")]
    caution: Annotated[
        str, Meta(description="Why the numbers may mean nothing; empty if there is no such doubt.")
    ] = ""
    noise_target: NoiseTarget | None = None
    picture: Annotated[
        PictureFiles | None, Meta(description="The pictures in place of the textbook half.")
    ] = None
    reference_picture: Annotated[
        PictureFiles | None, Meta(description="The pictures in place of the physical half.")
    ] = None
    agreement: Annotated[
        Agreement | None, Meta(description="How pictures agree with the other half.")
    ] = None
    why: Annotated[
        Attribution | None,
        Meta(
            description="What the effects remove; null if they were not asked for, and of pictures."
        ),
    ] = None
    mistakes: Annotated[
        tuple[str, ...], Meta(description="Mistakes that the shader seems to make, in words.")
    ] = ()
    broken_laws: Annotated[
        tuple[str, ...],
        Meta(description="Which of energy, reciprocity and opacity the shader breaks, in words."),
    ] = ()
    textbook: Annotated[
        Amount | None,
        Meta(description="Mean dE2000 of Phong in place of a user's shader; null otherwise."),
    ] = None
    colour_science: Deviations | None = None
    record_version: int = VERSION

    @property
    def given(self) -> tuple[PictureFiles, ...]:
        """The pictures that replace halves."""
        return tuple(half for half in (self.picture, self.reference_picture) if half is not None)

    @property
    def shader(self) -> str:
        """The name of the shading in the textbook's place; empty if that or a picture is judged."""
        return "" if self.picture or self.heuristic == "phong" else self.heuristic

    @property
    def other_warnings(self) -> tuple[str, ...]:
        """The warnings, without what is said of pictures."""
        said = (*self.agreement.mistakes, *self.agreement.odd) if self.agreement else ()
        return tuple(warning for warning in self.warnings if warning not in said)

    @property
    def is_noise_known(self) -> bool:
        """Whether passes or repeats show the noise: two single pictures do not."""
        return len(self.given) < 2 or any(half.repeats > 1 for half in self.given)

    @property
    def picture_mistakes(self) -> tuple[str, ...]:
        """The mistakes that pictures seem to have, in words."""
        return self.agreement.mistakes if self.agreement else ()
