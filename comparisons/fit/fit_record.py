"""The record of a fit, ``fit.json``."""

from typing import Any, Literal

from comparisons.departure.spaces import Viewing
from comparisons.fit.optimise import Start
from comparisons.records import VERSION, Amount, Count, Pixels, Record, Resolution, Size, Versions


class Departure(Record):
    """Means of a metric over the counted pixels, in its unit.

    The loss was minimised, not this: by this metric other parameters may be better.

    Attributes
    ----------
    before, after
        With the paired parameters, and with the fitted ones.
    noise_floor
        Mean that the reference's noise alone would give.
    """

    before: Amount
    after: Amount
    p95_after: Amount
    noise_floor: Amount


class Fitted(Record, kw_only=True):
    """A parameter as the chapters name it, for this form of the lobe.

    Attributes
    ----------
    name
        ``k_a``, ``k_d``, ``k_s``, ``n`` or ``intensity``, or a name that a heuristic declares.
    channel
        Of a coefficient with one number per channel; otherwise empty.
    is_factor
        Whether the numbers are factors: on a texture, or on a paired intensity.
    paired
        Value by the pairing table.
    fitted
        The best value; null if the image does not determine it.
    stopped_at
        Where the search ended; if the parameter is not identifiable, any value would do.
    interval
        95 %, by the reference's noise alone; null at a bound, or if not identifiable.
    reason
        Why it is not identifiable; otherwise empty.
    bounds
        Lower and upper; null if there is none.
    partners
        Parameters that make up for it.
    """

    name: str
    channel: Literal["", "R", "G", "B"] = ""
    is_factor: bool
    paired: float
    fitted: float | None
    stopped_at: float
    interval: tuple[float, float] | None
    bounds: tuple[float | None, float | None]
    at_bound: bool
    identifiable: bool
    reason: str
    partners: tuple[str, ...] = ()


class FittedLight(Fitted, kw_only=True):
    """The factor on the intensity of a light."""

    light: str


class FittedMaterial(Record):
    """A material.

    Attributes
    ----------
    reference
        Plugin and plain parameters of the material in the reference.
    pixels
        Counted pixels that see it.
    """

    name: str
    reference: dict[str, Any] | None
    pixels: Count
    parameters: tuple[Fitted, ...]


class FormFit(Record):
    """The best fit of one form of the lobe; a form and its normalised variant are one fit.

    Attributes
    ----------
    form
        Of the lobe, ``phong`` or ``blinn``; or the heuristic whose own parameters were fitted.
    normalised
        Whether k_s is the lobe's albedo at normal incidence.
    loss
        At the best parameters, in the loss's own unit: the *model error*, which no parameters of
        this form remove.
    parameter_error
        The paired image's loss less the model error: what better parameters remove.
    lights
        Factors on intensities; empty if they were not fitted.
    convergence
        All searches.
    own
        Parameters that the heuristic declares.
    """

    form: str
    normalised: bool
    loss: Amount
    parameter_error: float
    departure: dict[str, Departure]
    materials: tuple[FittedMaterial, ...]
    lights: tuple[FittedLight, ...]
    convergence: tuple[Start, ...]
    own: tuple[Fitted, ...] = ()


class LossName(Record):
    """The loss that was minimised."""

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
    """The heuristic parameters nearest to one scene's reference, and the remaining error.

    Attributes
    ----------
    best
        Index in fits of the form with the least loss.
    command
        Repeats the fit.
    """

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
    best: Count
    warnings: tuple[str, ...]
    versions: Versions
    time: FitTimes
    command: str

    @property
    def nearest(self) -> FormFit:
        """The fit of the form with the least loss."""
        return self.fits[self.best]
