"""The record of a study of cost, ``cost.json``: linear values are in units of display white."""

from typing import Annotated, Literal

from msgspec import Meta

from comparisons.cost.front import Reached, Within
from comparisons.cost.timing import Measured
from comparisons.departure.spaces import Viewing
from comparisons.effects.prices import Prices
from comparisons.effects.split import Part
from comparisons.records import VERSION, Count, Machine, Pixels, Record, Resolution, Versions
from heuristic.interpolation import Interpolation

Family = Literal["kernel", "phong BSDF", "physical"]


class Converged(Record):
    """The reference that errors are told against."""

    integrator: str
    max_depth: Annotated[int, Meta(description="As Mitsuba counts; -1 is no limit.", ge=-1)]
    spp: Annotated[int, Meta(description="Samples per pixel in all.", ge=2)]
    passes: Annotated[int, Meta(ge=2)]
    noise_floor: Annotated[float, Meta(description="Mean ΔE2000 of its noise alone.", ge=0)]
    mean_variance: Annotated[
        float, Meta(description="Subtracted from every mean squared error.", ge=0)
    ]


class Rung(Record):
    """A method that the scene tells apart from others."""

    name: str
    names: Annotated[tuple[str, ...], Meta(description="All that it has in this scene.")]
    monte_carlo: Annotated[bool, Meta(description="Random beyond the pixel filter.")]
    family: Family


class Split(Record):
    """The departure by causes, which add up in every pixel."""

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
    split: Split
    viewing: Viewing
    pixels: Pixels
    machine: Machine
    versions: Versions
    command: str
    pictures: Pictures

    def points_of(self, rung: str) -> tuple[Measured, ...]:
        """Return the points of a rung, by its name."""
        return tuple(point for point in self.points if point.rung == rung)

    def reached_by(self, rung: str) -> tuple[Reached, ...]:
        """Return when a rung reaches which error."""
        return tuple(row for row in self.equal_error if row.method == rung)
