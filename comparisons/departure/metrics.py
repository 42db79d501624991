"""The built-in metrics, each with its definition, unit and range.

=============  ================================  ==========================================
dE2000         CIE DE2000                        display-referred: exposed, clipped to [0, 1]
dE_ITP         ITU-R BT.2124                     HDR: absolute luminance up to 10,000 cd/m²
dE_CAM16UCS    CAM16-UCS (Li et al. 2017)        display-referred, with viewing conditions
rmse           root mean square                  linear light, neither exposed nor clipped
ldr_flip       FLIP (Andersson et al. 2020)      display-referred, knows spatial frequency
hdr_flip       HDR-FLIP (2021)                   the largest of FLIP over many exposures
=============  ================================  ==========================================

colour-science defines the first three, flip-evaluator the last two. The signed ratio of luminances
in stops comes with them, but is not a distance. Statistics over an image are in
`comparisons.departure.statistics`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from comparisons.departure.flip import hdr_flip, ldr_flip
from comparisons.departure.metric import (
    METRICS,
    Metric,
    Pixelwise,
    checked_pair,
    declare,
    drawn,
)
from comparisons.departure.spaces import (
    DEFAULT_VIEWING,
    Array,
    Viewing,
    cam16ucs,
    ciede2000,
    euclidean,
    itp,
    lab,
    linear,
    luminance,
    root_mean_square,
)

__all__ = ["METRICS", "declare", "drawn"]

LOG2_EPSILON = 1e-4
"""Added to both luminances of `log2_luminance_ratio`; 1.0 is display white."""


LEADING = METRICS.own(
    Pixelwise(
        name="dE2000",
        label="ΔE2000",
        unit="1 is about one just noticeable difference, black to white is 100",
        definition="CIE DE2000 between CIE L*a*b* colours (D65, 2° observer) of the images as a "
        "display shows them: exposed, then clipped to [0, 1].",
        caution="It was fitted to small differences, up to about 5, of uniform patches: large "
        "values are ordered, but twice the value is not twice as far. Above white it sees nothing.",
        map_range=(0.0, 20.0),
        visible=(1.0, 2.0, 5.0),
        coordinates=lab,
        difference=ciede2000,
    )
)
"""The metric that judges scenes: regions, noise targets and prices use it."""
METRICS.own(
    Pixelwise(
        name="dE_ITP",
        label="ΔE ITP",
        unit="1 is one just noticeable difference in the most critical adaptation",
        definition="ITU-R BT.2124: 720 √(ΔI² + ΔT² + ΔP²) of ICtCp with the PQ curve, at absolute "
        "luminance, clipped to 0–10,000 cd/m².",
        caution="It assumes an eye adapted to each pixel, and so overrates differences in deep "
        "shadow next to bright light. It depends on the luminance of white.",
        map_range=(0.0, 60.0),
        visible=(1.0, 2.0, 5.0),
        coordinates=itp,
        difference=euclidean,
    )
)
METRICS.own(
    Pixelwise(
        name="dE_CAM16UCS",
        label="CAM16-UCS",
        unit="black to white is 100",
        definition="Euclidean distance in J'a'b' of CAM16-UCS (Li et al. 2017), of the images as a "
        "display shows them: exposed, then clipped to [0, 1].",
        caution="It assumes one adaptation over the whole image, from the viewing conditions. "
        "Above white it sees nothing.",
        map_range=(0.0, 20.0),
        visible=(1.0, 2.0, 5.0),
        coordinates=cam16ucs,
        difference=euclidean,
    )
)
RMSE = METRICS.own(
    Pixelwise(
        name="rmse",
        label="RMSE",
        unit="1 is display white",
        definition="Root mean square of the linear RGB difference over pixels and channels.",
        caution="It knows nothing of eyes: a few very bright pixels outweigh all others.",
        map_range=(0.0, 1.0),
        rounding=1e-6,
        heading="RMSE, linear",
        drawn=False,
        linear=True,
        coordinates=linear,
        difference=root_mean_square,
    )
)

METRICS.own(
    Metric(
        name="ldr_flip",
        label="LDR-FLIP",
        unit="from 0 to 1, the distance of green and blue",
        definition="FLIP (Andersson et al. 2020) of the images as a display shows them: what a "
        "viewer sees in flipping between them, also edges and points, at the given pixels per "
        "degree.",
        caution="It holds for one distance from the screen. Above white it sees nothing.",
        map_range=(0.0, 1.0),
        rounding=1e-4,
        function=ldr_flip,
        stacks=True,
    )
)
METRICS.own(
    Metric(
        name="hdr_flip",
        label="HDR-FLIP",
        unit="from 0 to 1, the distance of green and blue",
        definition="The largest LDR-FLIP over exposures from one for the reference's brightest "
        "light to one for its median (Andersson et al. 2021, ACES).",
        caution="Nobody sees all these exposures at once: the worst one counts at each pixel.",
        map_range=(0.0, 1.0),
        rounding=1e-4,
        drawn=False,
        function=hdr_flip,
        stacks=True,
    )
)

BUILT_IN = METRICS.built_in
"""Names of the built-in metrics."""


@dataclass(frozen=True)
class Ratio:
    """A signed map that is not a distance; ``limit`` is the half range of its colour bar."""

    name: str
    label: str
    unit: str
    definition: str
    limit: float
    rounding: float


RATIO = Ratio(
    name="log2_luminance",
    label="Luminance ratio",
    unit="stops",
    definition=f"log2 of heuristic over reference, red where the heuristic is brighter; "
    f"ε = {LOG2_EPSILON:g}",
    limit=3.0,
    rounding=1e-4,
)
"""The ratio of `log2_luminance_ratio`."""


def delta_e_2000(
    test: ArrayLike, reference: ArrayLike, viewing: Viewing = DEFAULT_VIEWING
) -> Array:
    """Return CIE DE2000, display-referred; shape (H, W), range 0 to about 110.

    Linear RGB × exposure, clipped to [0, 1] → XYZ → CIE L*a*b* (D65, 2° observer) → ΔE00 with
    k_L = k_C = k_H = 1. About 1 is just noticeable side by side; black to white is 100.

    A display clips, too: two colours brighter than white compare equal, as do two negative
    (out-of-gamut) ones. Use `delta_e_itp` for differences above white.

    Source: CIE 142-2001; Sharma, Wu and Dalal, Color Res. Appl. 30(1), 2005.
    Raises `NonFiniteError`, and `InputError` for different shapes.

    White against black, and two colours that a display shows as white:

    >>> delta_e_2000([[[1, 1, 1], [2, 2, 2]]], [[[0, 0, 0], [1, 1, 1]]]).round(6).tolist()
    [[100.0, 0.0]]
    """
    return METRICS["dE2000"](test, reference, viewing)


def delta_e_itp(test: ArrayLike, reference: ArrayLike, viewing: Viewing = DEFAULT_VIEWING) -> Array:
    """Return ΔE_ITP, for high dynamic range; shape (H, W), range 0 to about 1,000.

    Linear BT.709 × exposure → linear BT.2020 × `white_luminance` cd/m², clipped to
    [0, 10,000] → ICtCp with the PQ curve (BT.2100-2) → ``720 √(ΔI² + ΔT² + ΔP²)`` with
    T = Ct/2 and P = Cp. A value of 1 is just noticeable in the most critical adaptation.

    Source: ITU-R BT.2124-0. Raises as `delta_e_2000`.

    One stop above white, which a high dynamic range display shows:

    >>> delta_e_itp([[[2, 2, 2]]], [[[1, 1, 1]]]).round(1).tolist()
    [[52.9]]
    """
    return METRICS["dE_ITP"](test, reference, viewing)


def delta_e_cam16ucs(
    test: ArrayLike, reference: ArrayLike, viewing: Viewing = DEFAULT_VIEWING
) -> Array:
    """Return the distance in CAM16-UCS, display-referred; shape (H, W), range 0 to about 120.

    Linear RGB × exposure, clipped to [0, 1] → XYZ → CAM16 (viewing conditions of `Viewing`,
    D65 white) → J'a'b' → √(ΔJ'² + Δa'² + Δb'²). Black to white is 100.

    Source: Li et al., Color Res. Appl. 42(6), 2017. Raises as `delta_e_2000`.

    >>> delta_e_cam16ucs([[[1, 1, 1]]], [[[0, 0, 0]]]).round(1).tolist()
    [[100.0]]
    """
    return METRICS["dE_CAM16UCS"](test, reference, viewing)


def rmse(test: ArrayLike, reference: ArrayLike, mask: ArrayLike | None = None) -> float:
    """Return the root mean square of the linear RGB difference over the pixels of `mask` (H, W).

    ``√(mean (test − reference)²)`` over pixels and channels, in units of display white, neither
    exposed nor clipped. 0 for an empty mask. Raises as `delta_e_2000`.

    One channel of four pixels is off by 1, hence √(1/12):

    >>> reference = [[[0, 0, 0]] * 4]
    >>> round(rmse([[[1, 0, 0]] + [[0, 0, 0]] * 3], reference), 3)
    0.289
    """
    test, reference = checked_pair(test, reference)
    where = ... if mask is None else np.asarray(mask, bool)
    return RMSE.mean(RMSE.against(reference, where, DEFAULT_VIEWING)(test))


def log2_luminance_ratio(test: ArrayLike, reference: ArrayLike) -> Array:
    """Return the signed ratio of luminances in stops; shape (H, W).

    ``log2((max(Y_t, 0) + ε) / (max(Y_r, 0) + ε))`` with ε = 1e-4 of display white: positive
    where the test image is brighter, one stop is a factor of 2, and black against black is 0.
    Raises as `delta_e_2000`.

    >>> test, reference = [[[0.5, 0.5, 0.5]]], [[[0.25, 0.25, 0.25]]]
    >>> log2_luminance_ratio(test, reference).round(2).tolist()
    [[1.0]]
    """
    test, reference = checked_pair(test, reference)
    lift = [np.maximum(luminance(image), 0.0) + LOG2_EPSILON for image in (test, reference)]
    return np.log2(lift[0] / lift[1])
