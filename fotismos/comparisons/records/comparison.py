"""What a comparison returns: its record, ``comparison.json``, its images, and its causes."""

from __future__ import annotations

import platform
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import msgspec
import numpy as np
from msgspec import Meta, structs
from numpy.typing import NDArray

from fotismos.comparisons.departure.colour import Viewing
from fotismos.comparisons.departure.noise import VisibleShare
from fotismos.comparisons.departure.regions import ObjectShare, Region
from fotismos.comparisons.departure.statistics import RatioSummary, Summary
from fotismos.comparisons.processes.pool import cores
from fotismos.comparisons.records.price import Price
from fotismos.heuristic import __version__
from fotismos.heuristic.convention import Floats
from fotismos.reference.pairing.pairing_record import Override, Pairing, Unrepresentable
from fotismos.reference.planning.plan_record import Plan
from fotismos.reference.records import (
    VERSION,
    Amount,
    Count,
    Interval,
    Machine,
    Missing,
    Pixels,
    Positive,
    Record,
    Resolution,
    Share,
    Size,
    Times,
    Versions,
)

if TYPE_CHECKING:
    from fotismos.comparisons.departure.tone_maps import Light
    from fotismos.comparisons.pixel_terms import LivePoints, TermGrid


PICTURE_LIBRARIES = ("numpy", "colour-science", "OpenEXR", "pillow")
"""What a comparison of two pictures depends on."""

LIBRARIES = ("mitsuba", "drjit", "numpy", "colour-science", "OpenEXR")
"""What a comparison of a scene depends on."""


def versions(libraries: Iterable[str] = LIBRARIES) -> dict[str, str]:
    """Return the versions that a result depends on, and with Dr.Jit LLVM's."""
    numbers = {"fotismos": __version__, "python": platform.python_version()}
    numbers |= {library: metadata.version(library) for library in libraries}
    if "drjit" in numbers:
        import drjit as dr  # loaded late: two pictures are compared without it

        numbers["LLVM"] = ".".join(map(str, dr.detail.llvm_version()))
    return numbers


def machine() -> Machine:
    """Return what times depend on."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    processor = names[0] if names else platform.processor() or platform.machine()
    return Machine(
        processor=processor, cores=cores(), system=f"{platform.system()} {platform.machine()}"
    )


class Significant(Record):
    """Share of the counted pixels that are certain to differ; it grows with the samples."""

    fraction: Share
    undetermined: Annotated[
        Share, Meta(description="Not certain to differ, but noise may hide a visible error there.")
    ]
    level: Annotated[
        float,
        Meta(
            gt=0,
            lt=1,
            description="Expected share of false ones among them; if the images do not differ, the"
            " chance of any.",
        ),
    ]
    certain: Annotated[
        bool,
        Meta(
            description="Whether the images differ for sure, in a block of pixels or as a whole;"
            " without it, noise may explain every difference."
        ),
    ] = True


NO_TERMS = Missing("Terms are traced with the causes, which were not asked for.")
NOT_LIVE = Missing("It needs the causes, which were not asked for.")

CAUSES = "causes"
"""The stage that finds causes."""


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


class MeanError(Interval):
    """A mean ΔE2000 with its 95 % interval; without noise it may come out below 0."""

    value: float = msgspec.field(name="mean")


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
    closure: MeanError
    implementation: Amount
    resolution: Resolution
    spp: Size
    replicates: Size
    orders: int
    hybrids: tuple[Hybrid, ...] = ()
    objects: tuple[ObjectContribution, ...] = ()


@dataclass(frozen=True)
class Causes:
    """The attribution of a departure, and where in the image the effects remove what.

    ``maps`` are ``{effect: (H, W)}``, the ΔE2000 that each removes; with ``left``, what remains
    when all are simulated, they add up to ``departure``. ``counted`` (H, W) are the pixels that
    count. ``previews`` are ``{labels of the simulated effects: (f H, f W, 3)}``, linear, and
    ``visible`` the shares of their pixels that differ visibly, by rising threshold.
    """

    record: Attribution
    maps: dict[str, Floats]
    departure: Floats
    left: Floats
    counted: NDArray[np.bool_]
    previews: dict[tuple[str, ...], Floats]
    visible: dict[tuple[str, ...], tuple[VisibleShare, ...]]


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
    textbook: Annotated[
        Amount | None,
        Meta(description="Mean dE2000 of Phong in place of a user's shader; null otherwise."),
    ] = None
    colour_science: Deviations | None = None
    record_version: int = VERSION

    @property
    def is_noise_known(self) -> bool:
        """Whether passes or repeats show the noise: two single pictures do not."""
        halves = (self.picture, self.reference_picture)
        return any(half is None or half.repeats > 1 for half in halves)


@dataclass(frozen=True)
class Images:
    """The images of a comparison; (H, W, 3) linear, or (H, W) for maps.

    ``maps`` are those of the perceptual metrics and ``log2_luminance``. ``objects`` and
    ``materials`` hold the index in the record of what each pixel sees, -1 for uncounted pixels.
    Two pictures without a scene have neither these nor ``position`` and ``normal``. ``light`` is
    the reference before its tone map, if it has one.
    ``terms`` are those of 8.10 in the textbook half, by layer, if it has any.
    """

    heuristic: np.ndarray
    reference: np.ndarray
    reference_stderr: np.ndarray
    maps: dict[str, np.ndarray]
    significant: np.ndarray
    counted: np.ndarray
    position: np.ndarray | None = None
    normal: np.ndarray | None = None
    objects: np.ndarray | None = None
    materials: np.ndarray | None = None
    terms: dict[str, np.ndarray] = field(default_factory=dict)
    light: Light | None = None


@dataclass(frozen=True)
class Comparison:
    """What a comparison returns: the content of ``comparison.json``, and the images.

    Steps add the others: ``terms`` of 8.10 at pixels, ``live``, the points that a page shades
    again, and ``causes``, those of ``record.why``, by pixel.
    """

    record: ComparisonRecord
    images: Images
    terms: TermGrid | Missing = NO_TERMS
    live: LivePoints | Missing = NOT_LIVE
    causes: Causes | None = None

    def warned(self, warnings: Iterable[str]) -> Comparison:
        """Return the comparison with more warnings."""
        record = structs.replace(self.record, warnings=(*self.record.warnings, *warnings))
        return replace(self, record=record)

    def timed(self, stage: str, seconds: float) -> Comparison:
        """Return the comparison with the time of one more stage."""
        time = self.record.time
        time = structs.replace(time, stages=time.stages | {stage: seconds})
        return replace(self, record=structs.replace(self.record, time=time))
