"""The types of a comparison's record, ``comparison.json``."""

from typing import Annotated, Any, Literal

from msgspec import Meta

from comparisons.departure.limits import LimitCounts
from comparisons.departure.objects import Carrier
from comparisons.departure.regions import Region
from comparisons.departure.spaces import Viewing
from comparisons.departure.statistics import Histogram, RatioSummary, Summary
from comparisons.effects.nearness import Nearest, Renderings
from comparisons.records import (
    VERSION,
    Amount,
    Count,
    Pixels,
    Positive,
    Record,
    Resolution,
    Share,
    Size,
    Versions,
)

Depth = Annotated[
    int, Meta(ge=-1, description="As Mitsuba counts: 2 is direct light alone, -1 is unlimited.")
]


class Decision(Record):
    """Whether a scene calls for an effect, and why.

    Attributes
    ----------
    rule
        The kind of reason, and the reason: ``structural`` follows from the scene's structure,
        ``simulated`` means that a premise of leaving it out is not known to hold, ``asked`` that
        pruning is off, ``guard`` that a probe disagreed with the plan.
    """

    name: str
    called_for: bool
    rule: str


class RuleRecord(Record):
    """A rule of pruning, and whether it applies.

    Attributes
    ----------
    name
        What is done when it applies.
    applies
        Whether all its premises are known to hold.
    premise
        The first premise not known to hold; empty if it applies.
    evidence
        What is absent, or what contradicts the premise.
    """

    name: str
    applies: bool
    premise: str
    evidence: str


class Simulation(Record):
    """The simulation of a scene: its plan, samples and passes."""

    kernel_terms: Annotated[
        tuple[str, ...], Meta(description="Coefficients whose terms the heuristic kernel holds.")
    ]
    integrator: Annotated[str, Meta(description="Mitsuba integrator of the reference.")]
    max_depth: Depth
    shadows: Annotated[bool, Meta(description="Whether the reference traces shadow rays.")]
    tabulated_environment: Annotated[
        bool, Meta(description="Whether a constant environment comes from a table of albedos.")
    ]
    spp: Annotated[Size, Meta(description="Samples per pixel, over all passes.")]
    passes: Size
    sampler: Annotated[str, Meta(description="Mitsuba sampler of both renderings.")]
    rules: tuple[RuleRecord, ...] = ()
    light_samples: Annotated[
        Count,
        Meta(
            description="Lights that the reference picks for each sample, in proportion to their"
            " contribution; 0 if it samples all."
        ),
    ] = 0
    heuristic_reads: Annotated[
        tuple[str, ...], Meta(description="What the heuristic reads of each point that it shades.")
    ] = ()


class GuardRecord(Record):
    """The result of probing a plan that leaves something out, against everything.

    Attributes
    ----------
    state
        If it disagreed, everything was simulated; not needed if nothing is left out.
    rays
        Camera rays that were traced both ways.
    departure, error
        Relative difference of the plan's mean from the full one, and its standard error.
    seconds
        Time of the probe, which no other time includes.
    """

    state: Literal["agreed", "disagreed", "not needed"]
    rays: Count
    departure: float
    error: Amount
    seconds: Amount


class PlanRecord(Simulation, kw_only=True):
    """The effects that the scene calls for, and what was simulated."""

    effects: tuple[Decision, ...]
    guard: GuardRecord | None = None


class Significant(Record):
    """Share of the counted pixels that are shown to differ; it grows with the samples."""

    fraction: Share
    undetermined: Annotated[
        Share, Meta(description="Not shown to differ, though a visible difference may hide there.")
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


class BsdfPair(Record):
    """A BSDF and its partner; grey colours are one value. The note says what is odd."""

    name: str
    given: str
    derived: str
    parameters: dict[str, Any]
    note: str = ""


class EmitterPair(Record):
    """A light and its partner, and the factor between their intensities."""

    name: str
    given: str
    derived: str
    factor: float
    exact: bool
    note: str = ""


class Missed(Record):
    """A quantity that no partner reaches."""

    what: str
    wanted: float
    reached: float


class Pairing(Record):
    """How heuristic and physical materials and lights correspond."""

    convention: str
    bsdfs: tuple[BsdfPair, ...]
    emitters: tuple[EmitterPair, ...]
    misses: tuple[Missed, ...]


class Times(Record):
    """Wall times of one rendering in seconds, evaluated and synchronised."""

    median_s: Annotated[Amount, Meta(description="Median time per pass, once compiled.")]
    passes: Size
    first_s: Annotated[Amount, Meta(description="The first pass, with compilation.")]
    total_s: Amount
    compile_s: Annotated[Amount | None, Meta(description="Code generation and back end.")]


CAUSES = "causes"
"""The stage that finds causes."""


class TimeSpent(Record):
    """Times of both renderings, and of other work by stage."""

    heuristic: Times
    reference: Times
    stages: dict[str, float]

    @property
    def share_of_causes(self) -> float:
        """The share of the whole time that finding causes took."""
        whole = sum(self.stages.values()) + self.heuristic.total_s + self.reference.total_s
        return self.stages.get(CAUSES, 0.0) / whole if whole else 0.0


class Unrepresentable(Record):
    """Something that the heuristic model cannot represent; compared nevertheless."""

    name: Annotated[str, Meta(description="Id, or place in the file.")]
    plugin: str
    lost: str
    nearest: Annotated[str, Meta(description="What replaces it, and by which rule.")]


class Override(Record):
    """A setting of the scene that is not used, and what is used instead."""

    what: str
    given: str
    used: str


class NoiseTarget(Record):
    """Where a run with a noise target ended.

    Both are 95th percentiles of the noise in ΔE2000 over the counted pixels: as requested, and as
    predicted from the spread of the passes.
    """

    target: Positive
    reached: Amount
    stopped_by: Literal["target", "samples"]
    limit_spp: Annotated[int, Meta(ge=2, description="Samples per pixel that end a run.")]


class PictureRecord(Record):
    """The pictures that replace the heuristic half.

    Attributes
    ----------
    files
        The files as given.
    transfer
        Transfer function of their values, as stated; null for EXR's own, which is linear.
    repeats
        Number of the pictures.
    shift
        Pixels by which their content is too far right and too low; null if their edges are
        uninformative.
    edges
        Correlation of their edges with the expected ones.
    ratio
        Means of red, green and blue over those of the reference, which is clipped at display
        white if they are.
    odd
        What is odd about them, in words, their position first.
    nearest
        The rendering that they are nearest to as a whole; null if none was looked for.
    renderings
        Those that were compared with them; null if none was.
    """

    files: tuple[str, ...]
    transfer: str | None
    repeats: Size
    shift: tuple[float, float] | None
    edges: float
    ratio: tuple[float, float, float]
    odd: tuple[str, ...] = ()
    nearest: Nearest | None = None
    renderings: Renderings | None = None


class ComparisonRecord(Record, kw_only=True):
    """One scene by textbook shading (heuristic) and by physically based rendering (reference).

    Times are in seconds; linear values are in units of display white; every number is finite.
    """

    scene: Annotated[str, Meta(description="Built-in name or path of the file, as given.")]
    variant: Annotated[str, Meta(description="Mitsuba variant of the reference.")]
    heuristic_variant: str
    heuristic: str
    interpolation: Literal["flat", "gouraud", "phong"]
    seed: Annotated[Count, Meta(description="Seed of the run; each pass hashes its own from it.")]
    resolution: Resolution
    plan: PlanRecord
    viewing: Viewing
    metrics: Annotated[
        dict[str, Summary], Meta(description="Summaries by name of the declared metric.")
    ]
    log2_luminance: RatioSummary
    significant: Significant
    pixels: Pixels
    limits: LimitCounts
    regions: Annotated[
        tuple[Region, ...],
        Meta(description="Boxes that hold most of dE2000, the most valuable first."),
    ]
    objects: Annotated[
        tuple[Carrier, ...],
        Meta(description="Shapes by share of dE2000; the last may hold all others."),
    ] = ()
    materials: Annotated[tuple[Carrier, ...], Meta(description="The same for their BSDFs.")] = ()
    histograms: Annotated[
        dict[str, Histogram], Meta(description="Counted pixels by metric, in bins of equal ratios.")
    ]
    pairing: Pairing
    time: TimeSpent
    unrepresentable: tuple[Unrepresentable, ...]
    integrator_given: Annotated[str | None, Meta(description="The scene's own integrator.")]
    overridden: tuple[Override, ...]
    warnings: tuple[str, ...]
    versions: Versions
    command: Annotated[str, Meta(description="Repeats this comparison.")]
    noise_target: NoiseTarget | None = None
    picture: PictureRecord | None = None
    suspicions: Annotated[
        tuple[str, ...], Meta(description="Mistakes that the heuristic seems to make, in words.")
    ] = ()
    record_version: int = VERSION
