"""The record of a fit, ``fit.json``, and the parameters in it, in the chapters' units."""

from typing import Annotated, Any, Literal

from msgspec import Meta

from fotismos.comparisons.records.departure import Viewing, VisibleShare
from fotismos.reference.records import (
    VERSION,
    Amount,
    Count,
    Interval,
    Pixels,
    Record,
    Resolution,
    Size,
    Versions,
)


class FitDeparture(Record):
    """Means of a metric over the counted pixels, with the paired and with the fitted parameters.

    The loss was minimised, not this: by this metric other parameters may be better. The noise floor
    is the mean that the reference's noise alone would give.
    """

    before: Amount
    after: Amount
    noise_floor: Amount


Channel = Literal["", "R", "G", "B"]


class FittedParameter(Record):
    """A parameter as the chapters name it, or of a heuristic's own; of a texture, factors on it."""

    name: str
    channel: Channel = ""
    is_factor: bool = False
    paired: Annotated[float, Meta(description="By the pairing table.")]
    fitted: Annotated[float | None, Meta(description="Null if the image does not determine it.")]
    interval: Annotated[
        tuple[float, float] | None,
        Meta(description="95 %, by noise; null at a bound, or if not identifiable."),
    ]
    bounds: tuple[float | None, float | None]
    at_bound: bool
    reason: Annotated[str, Meta(description="Why it is not identifiable; otherwise empty.")]
    partners: Annotated[tuple[str, ...], Meta(description="Parameters that make up for it.")] = ()


class FittedMaterial(Record):
    """A material, and the counted pixels that see it."""

    name: str
    reference: Annotated[
        dict[str, Any] | None, Meta(description="Its plugin and plain parameters there.")
    ]
    pixels: Count
    parameters: tuple[FittedParameter, ...]


Judgement = Literal["right within noise", "wrong", "undecided"]

EXACT = 0.01
INVISIBLE = 1.0
"""ΔE2000: a model is right within noise if what is left begins below the first, and ends below the
second."""


class FormFit(Record):
    """The best fit of one form of the lobe, or of the parameters of a heuristic."""

    form: Annotated[str, Meta(description="``phong`` or ``blinn``, or the heuristic.")]
    loss: Annotated[
        float, Meta(ge=0, description="At the best parameters, in its unit: the model error.")
    ]
    parameter_error: Annotated[float, Meta(description="What better parameters remove of it.")]
    departure: Annotated[dict[str, FitDeparture], Meta(description="By metric.")]
    differ: Annotated[
        tuple[VisibleShare, ...],
        Meta(description="Pixels above ΔE2000 2, with the paired and the fitted parameters."),
    ]
    left: Annotated[
        Interval, Meta(description="Mean ΔE2000 that is left beyond noise, with its interval.")
    ]
    judgement: Annotated[
        Judgement,
        Meta(
            description="`wrong` if a difference is certain somewhere, `right within noise` if none"
            " is and less than one ΔE2000 may be left, `undecided` if neither can be said."
        ),
    ]
    materials: Annotated[
        tuple[FittedMaterial, ...], Meta(description="Or the heuristic, with its own parameters.")
    ]
    converged: Annotated[bool, Meta(description="Whether the search that found them did.")]


class FitRecord(Record):
    """The heuristic parameters nearest to one scene's reference, and the remaining error."""

    record_version: int = VERSION
    scene: str
    variant: str
    seed: Count
    resolution: Resolution
    spp: Size
    passes: Size
    viewing: Viewing
    pairing: str
    loss: Annotated[dict[str, str], Meta(description="Name and unit of what was minimised.")]
    pixels: Pixels
    fits: tuple[FormFit, ...]
    best: Annotated[Count, Meta(description="Index of the form with the least loss.")]
    warnings: tuple[str, ...]
    versions: Versions
    time: dict[str, Amount]
    command: str

    @property
    def nearest(self) -> FormFit:
        """The fit of the form with the least loss."""
        return self.fits[self.best]
