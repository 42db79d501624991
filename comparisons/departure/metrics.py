"""Pixelwise distances between two images, each with its definition, unit and range.

Every image is a float array (H, W, 3) of linear light with the sRGB primaries (ITU-R BT.709,
D65); 1.0 is display white. Three perceptual metrics come from colour-science:

=============  ================================  ==========================================
dE2000         CIE DE2000                        display-referred: exposed, clipped to [0, 1]
dE_ITP         ITU-R BT.2124                     HDR: absolute luminance up to 10,000 cd/m²
dE_CAM16UCS    CAM16-UCS (Li et al. 2017)        display-referred, with viewing conditions
=============  ================================  ==========================================

Each is split into ``coordinates`` (an image's position in a nearly uniform colour space) and
``difference`` (a distance of two positions), so that the reference is converted once and
compared with many test images. Beside them stand the linear RMSE and the signed ratio of
luminances in stops. Statistics over an image are in `comparisons.departure.statistics`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from comparisons.departure.spaces import (
    DEFAULT_VIEWING,
    Array,
    Viewing,
    cam16ucs,
    ciede2000,
    euclidean,
    itp,
    lab,
    luminance,
)
from heuristic.errors import InputError, NonFiniteError

#: Added to both luminances of `log2_luminance_ratio`; 1.0 is display white.
LOG2_EPSILON = 1e-4

#: Half range of the signed map of `log2_luminance_ratio`, in stops.
LOG2_RANGE = 3.0


@dataclass(frozen=True)
class Metric:
    """A perceptual distance.

    name
        As in `comparison.json` and as an EXR layer.
    label, unit, definition
        As printed in reports.
    map_range
        Fixed (low, high) of the colour bar, so that maps of different scenes compare.
    coordinates
        ``(rgb, viewing) -> (..., 3)``: linear RGB to a colour space.
    difference
        ``(coordinates, coordinates) -> (...)``: distance, ≥ 0. The first is the reference's
        where it matters; none of the metrics here is asymmetric.
    """

    name: str
    label: str
    unit: str
    definition: str
    map_range: tuple[float, float]
    coordinates: Callable[[ArrayLike, Viewing], Array]
    difference: Callable[[Array, Array], Array]

    def __call__(
        self, test: ArrayLike, reference: ArrayLike, viewing: Viewing = DEFAULT_VIEWING
    ) -> Array:
        """The map (H, W) of distances between two linear images (H, W, 3)."""
        test, reference = checked_pair(test, reference)
        return self.difference(
            self.coordinates(reference, viewing), self.coordinates(test, viewing)
        )


def require_finite(image: ArrayLike, layer: str) -> None:
    """Raise `NonFiniteError` if `image` (H, W) or (H, W, C) holds a NaN or an infinity.

    The message names the layer, how many pixels are concerned and the first one as (x, y),
    counted from the top left in reading order.
    """
    finite = np.isfinite(image)
    if finite.all():
        return
    wrong = ~finite if finite.ndim == 2 else ~finite.all(axis=-1)
    y, x = np.unravel_index(np.argmax(wrong), wrong.shape)
    raise NonFiniteError(
        f"{layer}: {np.count_nonzero(wrong)} of {wrong.size} pixels are NaN or infinite, "
        f"the first at (x, y) = ({x}, {y}): {np.asarray(image)[y, x]}"
    )


def checked_pair(test: ArrayLike, reference: ArrayLike) -> tuple[Array, Array]:
    """Both images as float64, checked: same shape (..., 3) and finite.

    Raises `InputError` for the shapes, `NonFiniteError` for a NaN or an infinity.
    """
    test, reference = np.asarray(test, np.float64), np.asarray(reference, np.float64)
    if test.shape != reference.shape or test.shape[-1:] != (3,):
        raise InputError(
            f"images of shapes {test.shape} and {reference.shape} cannot be compared: "
            "both must be (height, width, 3)"
        )
    require_finite(test, "test image")
    require_finite(reference, "reference image")
    return test, reference


def delta_e_2000(
    test: ArrayLike, reference: ArrayLike, viewing: Viewing = DEFAULT_VIEWING
) -> Array:
    """CIE DE2000 colour difference, display-referred; shape (H, W), range 0 to about 110.

    Linear RGB × exposure, clipped to [0, 1] → XYZ → CIE L*a*b* (D65, 2° observer) → ΔE00 with
    k_L = k_C = k_H = 1. About 1 is just noticeable side by side; black to white is 100.

    Clipping is what a display does: two colours brighter than white compare equal, and so do
    two negative (out-of-gamut) ones. Differences above white are for `delta_e_itp`.

    Source: CIE 142-2001; Sharma, Wu and Dalal, Color Res. Appl. 30(1), 2005.
    Raises `NonFiniteError`, and `InputError` for different shapes.

    White against black, and two colours that a display shows as white:

    >>> delta_e_2000([[[1, 1, 1], [2, 2, 2]]], [[[0, 0, 0], [1, 1, 1]]]).round(6).tolist()
    [[100.0, 0.0]]
    """
    return METRICS["dE2000"](test, reference, viewing)


def delta_e_itp(test: ArrayLike, reference: ArrayLike, viewing: Viewing = DEFAULT_VIEWING) -> Array:
    """ΔE_ITP, for high dynamic range in absolute units; shape (H, W), range 0 to about 1,000.

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
    """Distance in CAM16-UCS, display-referred; shape (H, W), range 0 to about 120.

    Linear RGB × exposure, clipped to [0, 1] → XYZ → CAM16 (viewing conditions of `Viewing`,
    D65 white) → J'a'b' → √(ΔJ'² + Δa'² + Δb'²). Black to white is 100.

    Source: Li et al., Color Res. Appl. 42(6), 2017. Raises as `delta_e_2000`.

    >>> delta_e_cam16ucs([[[1, 1, 1]]], [[[0, 0, 0]]]).round(1).tolist()
    [[100.0]]
    """
    return METRICS["dE_CAM16UCS"](test, reference, viewing)


def rmse(test: ArrayLike, reference: ArrayLike, mask: ArrayLike | None = None) -> float:
    """Root mean square of the linear RGB difference over the pixels of `mask` (H, W).

    ``√(mean (test − reference)²)`` over pixels and channels, in units of display white, neither
    exposed nor clipped. 0 for an empty mask. Raises as `delta_e_2000`.

    One channel of four pixels is off by 1, hence √(1/12):

    >>> reference = [[[0, 0, 0]] * 4]
    >>> round(rmse([[[1, 0, 0]] + [[0, 0, 0]] * 3], reference), 3)
    0.289
    """
    test, reference = checked_pair(test, reference)
    square = (test - reference) ** 2
    selected = square if mask is None else square[np.asarray(mask, bool)]
    return float(np.sqrt(selected.mean())) if selected.size else 0.0


def log2_luminance_ratio(test: ArrayLike, reference: ArrayLike) -> Array:
    """Signed ratio of luminances in stops; shape (H, W).

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


#: The perceptual metrics by name, in the order of reports.
METRICS: Mapping[str, Metric] = MappingProxyType(
    {
        metric.name: metric
        for metric in (
            Metric(
                "dE2000",
                "ΔE2000",
                "1 is about one just noticeable difference, black to white is 100",
                "CIE DE2000 between CIE L*a*b* colours (D65, 2° observer) of the images as a "
                "display shows them: exposed, then clipped to [0, 1].",
                (0.0, 20.0),
                lab,
                ciede2000,
            ),
            Metric(
                "dE_ITP",
                "ΔE ITP",
                "1 is one just noticeable difference in the most critical adaptation",
                "ITU-R BT.2124: 720 √(ΔI² + ΔT² + ΔP²) of ICtCp with the PQ curve, at absolute "
                "luminance, clipped to 0–10,000 cd/m².",
                (0.0, 60.0),
                itp,
                euclidean,
            ),
            Metric(
                "dE_CAM16UCS",
                "CAM16-UCS",
                "black to white is 100",
                "Euclidean distance in J'a'b' of CAM16-UCS (Li et al. 2017), of the images as a "
                "display shows them: exposed, then clipped to [0, 1].",
                (0.0, 20.0),
                cam16ucs,
                euclidean,
            ),
        )
    }
)
