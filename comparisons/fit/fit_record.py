"""The record of a fit, ``fit.json``."""

from typing import Any, Literal

from comparisons.departure.colour import Viewing
from comparisons.fit.search import SearchStart
from reference.records import VERSION, Amount, Count, Pixels, Record, Resolution, Size, Versions


class FitDeparture(Record):
    """Means of a metric over the counted pixels, with the paired and with the fitted parameters.

    The loss was minimised, not this: by this metric other parameters may be better. The noise floor
    is the mean that the reference's noise alone would give.
    """

    before: Amount
    after: Amount
    p95_after: Amount
    noise_floor: Amount


class FittedParameter(Record, kw_only=True):
    """A parameter as the chapters name it.

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
    bounds
        Lower and upper; null if there is none.
    reason
        Why it is not identifiable; otherwise empty.
    partners
        Parameters that make up for it.
    """

    name: str
    channel: Literal["", "R", "G", "B"] = ""
    is_factor: bool = False
    paired: float
    fitted: float | None
    stopped_at: float
    interval: tuple[float, float] | None
    bounds: tuple[float | None, float | None]
    at_bound: bool
    identifiable: bool
    reason: str
    partners: tuple[str, ...] = ()


class FittedLight(FittedParameter, kw_only=True):
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
    parameters: tuple[FittedParameter, ...]


class FormFit(Record, kw_only=True):
    """The best fit of one form of the lobe, or of a heuristic's own parameters.

    Attributes
    ----------
    form
        Of the lobe, ``phong`` or ``blinn``; or the heuristic whose own parameters were fitted.
    loss
        At the best parameters, in the loss's own unit: the *model error*, which no parameters of
        this form remove.
    parameter_error
        The paired image's loss less the model error: what better parameters remove.
    departure
        By metric.
    lights
        Factors on intensities; empty if they were not fitted.
    convergence
        All searches.
    own
        Parameters that the heuristic declares.
    """

    form: str
    loss: Amount
    parameter_error: float
    departure: dict[str, FitDeparture]
    materials: tuple[FittedMaterial, ...] = ()
    lights: tuple[FittedLight, ...] = ()
    convergence: tuple[SearchStart, ...]
    own: tuple[FittedParameter, ...] = ()


class LossName(Record):
    """The loss that was minimised."""

    name: str
    unit: str


class FitTimes(Record):
    """Seconds."""

    rendering_s: Amount
    fitting_s: Amount


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
