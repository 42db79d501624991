"""The record of a fit, ``fit.json``."""

from typing import Annotated, Any, Literal

from msgspec import Meta

from comparisons.amounts import Amount, Count, Resolution, Size
from comparisons.circumstances import Pixels, Versions
from comparisons.departure.spaces import Viewing
from comparisons.fit.optimise import Start
from comparisons.records import VERSION, Record


class Departure(Record):
    """Means of a metric over the counted pixels, in its unit."""

    before: Annotated[Amount, Meta(description="With the paired parameters.")]
    after: Annotated[Amount, Meta(description="With the fitted ones.")]
    p95_after: Amount
    noise_floor: Annotated[Amount, Meta(description="What the reference's noise alone gives.")]
    parameter_error: Annotated[float, Meta(description="before - after")]
    model_error: Annotated[Amount, Meta(description="after: what no parameters remove.")]


class Fitted(Record, kw_only=True):
    """A parameter in the terms of the chapters, and of this form of the lobe."""

    name: Literal["k_a", "k_d", "k_s", "n", "intensity"]
    channel: Annotated[
        Literal["", "R", "G", "B"],
        Meta(description="Of a coefficient that has a number for each; otherwise empty."),
    ] = ""
    is_factor: Annotated[
        bool, Meta(description="On a texture, or on a paired intensity, in place of a value.")
    ]
    paired: Annotated[float, Meta(description="By the pairing table.")]
    fitted: Annotated[
        float | None, Meta(description="The best value; null where the image does not tell it.")
    ]
    stopped_at: Annotated[
        float,
        Meta(description="Where the search ended; if not identifiable, any value would do."),
    ]
    interval: Annotated[
        tuple[float, float] | None,
        Meta(description="95 %, by noise alone; null at a bound, and where not identifiable."),
    ]
    bounds: tuple[float, float]
    at_bound: bool
    identifiable: bool
    reason: Annotated[str, Meta(description="Why it is not identifiable, otherwise empty.")]
    partners: Annotated[tuple[str, ...], Meta(description="Parameters that make up for it.")] = ()


class FittedLight(Fitted, kw_only=True):
    """The factor on the intensity of a light."""

    light: str


class FittedMaterial(Record):
    """A material: what was fitted, and what it is in the reference."""

    name: str
    reference: Annotated[
        dict[str, Any] | None, Meta(description="Plugin and plain parameters in the reference.")
    ]
    pixels: Annotated[Count, Meta(description="Counted pixels that see it.")]
    parameters: tuple[Fitted, ...]


class FormFit(Record):
    """The best fit of one form of the lobe; a form and its normalised variant are one fit."""

    form: Literal["phong", "blinn"]
    normalised: Annotated[
        bool, Meta(description="Whether k_s is the lobe's albedo at normal incidence.")
    ]
    loss: Annotated[Amount, Meta(description="At the best parameters, in the loss's own unit.")]
    departure: dict[str, Departure]
    materials: tuple[FittedMaterial, ...]
    lights: Annotated[
        tuple[FittedLight, ...], Meta(description="Empty where intensities were not fitted.")
    ]
    convergence: tuple[Start, ...]


class LossName(Record):
    """What was minimised."""

    name: str
    unit: str


class FitTimes(Record):
    """Seconds."""

    rendering_s: Amount
    fitting_s: Amount

    @property
    def total(self) -> float:
        """All of it."""
        return self.rendering_s + self.fitting_s


class FitRecord(Record, kw_only=True):
    """The heuristic parameters that come nearest to one scene's reference, and what they leave."""

    record_version: int = VERSION
    scene: str
    variant: str
    seed: Count
    resolution: Resolution
    spp: Size
    passes: Size
    viewing: Viewing
    pairing: str
    loss: LossName
    intensities: bool
    pixels: Pixels
    fits: tuple[FormFit, ...]
    best: Annotated[Count, Meta(description="Index in fits of the form with the least loss.")]
    warnings: tuple[str, ...]
    versions: Versions
    time: FitTimes
    command: Annotated[str, Meta(description="Repeats the fit.")]

    @property
    def nearest(self) -> FormFit:
        """The fit of the form with the least loss."""
        return self.fits[self.best]
