"""What is measured between two images: distances, shares of pixels, regions."""

from typing import Annotated, Literal

import numpy as np
from msgspec import Meta
from msgspec.structs import replace

from fotismos.heuristic.errors import InputError
from fotismos.reference.records import Amount, Count, Interval, Positive, Record, Share, Size

Colour = tuple[float, float, float]
"""Linear RGB."""

MOST_PIXELS = 1000.0
"""Most pixels per degree: filters grow with it, and no eye resolves this many."""


Verdict = Literal["pass", "fail", "undecided"]


class Viewing(Record):
    """Viewing conditions; printed with every number that depends on them."""

    exposure: Annotated[
        Positive, Meta(description="Linear factor on both images before any perceptual metric.")
    ] = 1.0
    white: Literal["D65"] = "D65"
    white_luminance: Annotated[
        Positive,
        Meta(description="Luminance of linear 1.0, cd/m²; 203 is BT.2408's HDR reference white."),
    ] = 203.0
    # CAM16's conditions from IEC 61966-2-1 (sRGB): 64 lx, so the adapting luminance is
    # 0.2 · E/π = 4.07 cd/m².
    ambient_illuminance: Annotated[Positive, Meta(description="CAM16: illuminance, lx.")] = 64.0
    background: Annotated[Positive, Meta(description="CAM16: Y_b; white is 100.")] = 20.0
    surround: Literal["average"] = "average"
    # The default of FLIP's authors: 0.7 m from a screen 0.7 m wide with 3840 pixels.
    pixels_per_degree: Annotated[
        float, Meta(ge=1, le=MOST_PIXELS, description="FLIP: pixels per degree of view.")
    ] = 67.0

    def __post_init__(self) -> None:
        for name in ("exposure", "white_luminance", "ambient_illuminance", "background"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"viewing: {name} is {value}: give a positive, finite number.")
        if not 1.0 <= self.pixels_per_degree <= MOST_PIXELS:
            raise InputError(
                f"pixels per degree: {self.pixels_per_degree} is not allowed: give 1 to"
                f" {MOST_PIXELS:g}, such as 67."
            )


DEFAULT_VIEWING = Viewing()
"""No exposure, 203 cd/m² white, sRGB's viewing conditions."""


class VisibleShare(Interval):
    """The share of counted pixels above a threshold, without noise, and its 95 % interval."""

    threshold: Positive
    value: Share
    low: Share
    high: Share


class Gate(Record):
    """Whether too many pixels differ visibly.

    Attributes
    ----------
    visible
        The share of pixels above a ΔE2000, with an interval that holds the noise.
    bound
        The largest share that is allowed.
    """

    scene: str
    visible: VisibleShare
    bound: Share
    state: Verdict


class Exposed(Record):
    """A metric after the factor `exposure` on the test image that makes its mean smallest."""

    exposure: Annotated[Positive, Meta(description="Linear factor; 1 changes nothing.")]
    mean: Amount
    p50: Amount
    p95: Amount
    max: Amount


class Summary(Record):
    """A metric over the counted pixels, in the metric's own unit."""

    mean: Annotated[Amount, Meta(description="Mean; for rmse and srgb_rmse, the root mean square.")]
    p50: Annotated[Amount, Meta(description="Median of the pixels.")]
    p95: Amount
    max: Amount
    visible: Annotated[
        tuple[VisibleShare, ...], Meta(description="Shares of the pixels, by rising threshold.")
    ]
    debiased: Annotated[Amount, Meta(description="Mean without the reference's noise.")]
    low: Annotated[Amount, Meta(description="Lower end of the 95 % interval of `debiased`.")]
    high: Amount
    noise_floor: Annotated[Amount, Meta(description="Mean from the reference's noise alone.")]
    after_exposure: Exposed
    psnr: Annotated[
        float | None,
        Meta(description="The mean as a PSNR, dB; null of other metrics, and of equal images."),
    ] = None

    def unproven(self) -> "Summary":
        """Return the summary if noise may explain every difference: low ends are 0."""
        visible = tuple(replace(share, low=0.0) for share in self.visible)
        return replace(self, low=0.0, visible=visible)

    def as_measured(self) -> "Summary":
        """Return the summary if noise made no pixel visible: low ends are the values."""
        visible = tuple(replace(share, low=share.value) for share in self.visible)
        return replace(self, low=self.debiased, visible=visible)


class RatioSummary(Record):
    """The signed luminance ratio, heuristic over reference, over the counted pixels, in stops."""

    mean: float
    p05: float
    p50: float
    p95: float


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


class Region(Record):
    """A box of pixels: x, y count from the top left, and include the first pixel."""

    x: Count
    y: Count
    width: Size
    height: Size
    share: Annotated[Share, Meta(description="Of the sum of dE2000 over the counted pixels.")]
    mean_dE2000: Annotated[Amount, Meta(description="Over the box's counted pixels.")]
    effect: Annotated[
        str | None,
        Meta(description="The dominant effect there, if known: 'a, then b'; 'a; b' if tied."),
    ] = None


class ObjectShare(Region):
    """A shape or a material: the box of its pixels, and its part of the departure.

    Attributes
    ----------
    name
        Its id in the scene.
    pixels
        Number of counted pixels that see it.
    material
        Id of a shape's material; empty for a material itself.
    """

    name: str
    pixels: Size
    material: str = ""
