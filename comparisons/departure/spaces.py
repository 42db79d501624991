"""Colour spaces in which distances are nearly what an eye sees, and how an image is looked at.

Conversions from linear light with the sRGB primaries (ITU-R BT.709, D65; 1.0 is display white) to
CIE L*a*b*, ICtCp and CAM16-UCS, by colour-science, which is imported on first use: that takes
about a second.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Annotated, Literal

import numpy as np
from msgspec import Meta
from numpy.typing import ArrayLike, NDArray

from comparisons.records import Positive, Record, plain
from heuristic.errors import InputError

Array = NDArray[np.float64]

#: ITU-R BT.2100: the largest luminance that the PQ curve encodes, cd/m².
PQ_PEAK = 10_000.0

#: Pixels converted at a time: temporaries stay small whatever the image's size.
_BLOCK = 32_768


class Viewing(Record):
    """How linear values are looked at; printed with every number that depends on it.

    Raises `InputError` for a value that is not positive and finite.
    """

    exposure: Annotated[
        Positive, Meta(description="Linear factor on both images before any perceptual metric.")
    ] = 1.0
    white: Literal["D65"] = "D65"
    white_luminance: Annotated[
        Positive,
        Meta(description="Luminance of linear 1.0, cd/m²; 203 is BT.2408's HDR reference white."),
    ] = 203.0
    # CAM16's conditions as in IEC 61966-2-1 (sRGB): 64 lx, from which the adapting luminance is
    # 0.2 · E/π = 4.07 cd/m².
    ambient_illuminance: Annotated[Positive, Meta(description="CAM16: illuminance, lx.")] = 64.0
    background: Annotated[Positive, Meta(description="CAM16: Y_b; white is 100.")] = 20.0
    surround: Literal["average"] = "average"

    def __post_init__(self) -> None:
        for name in ("exposure", "white_luminance", "ambient_illuminance", "background"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"viewing: {name} is {value}, but must be positive and finite")

    def record(self) -> dict[str, float | str]:
        """The values as written to ``comparison.json``."""
        return plain(self)


#: No exposure, 203 cd/m² white, sRGB's viewing conditions.
DEFAULT_VIEWING = Viewing()


def luminance(rgb: ArrayLike) -> Array:
    """Relative luminance Y of linear BT.709 RGB (..., 3); 1 is display white."""
    return np.asarray(rgb, np.float64) @ _rgb_to_xyz()[1]


@lru_cache(maxsize=1)
def _rgb_to_xyz() -> Array:
    # From the primaries at full precision: white is exactly D65, so greys have no chroma. The
    # rounded matrix of IEC 61966-2-1 would leave them 0.01 of a*.
    from colour.models import RGB_COLOURSPACE_BT709

    return RGB_COLOURSPACE_BT709.matrix_RGB_to_XYZ


@lru_cache(maxsize=1)
def _bt709_to_bt2020() -> Array:
    from colour.models import RGB_COLOURSPACE_BT2020

    return RGB_COLOURSPACE_BT2020.matrix_XYZ_to_RGB @ _rgb_to_xyz()


def _by_blocks(function: Callable[..., Array], *arrays: Array, out: tuple[int, ...]) -> Array:
    """Apply `function` to blocks of pixels of (..., 3) arrays; the result has shape `out`."""
    flat = [array.reshape(-1, 3) for array in arrays]
    result = np.empty((len(flat[0]), *out[arrays[0].ndim - 1 :]))
    for start in range(0, len(flat[0]), _BLOCK):
        block = slice(start, start + _BLOCK)
        result[block] = function(*(array[block] for array in flat))
    return result.reshape(out)


def _display_xyz(rgb: Array, viewing: Viewing, white: float = 1.0) -> Array:
    return np.clip(rgb * viewing.exposure, 0.0, white) @ _rgb_to_xyz().T


def lab(rgb: ArrayLike, viewing: Viewing) -> Array:
    """CIE L*a*b* (D65, 2°) of linear RGB (..., 3) as displayed; L* from 0 to 100."""
    from colour.models import XYZ_to_Lab

    rgb = np.asarray(rgb, np.float64)
    return _by_blocks(lambda block: XYZ_to_Lab(_display_xyz(block, viewing)), rgb, out=rgb.shape)


def cam16ucs(rgb: ArrayLike, viewing: Viewing, white: float = 1.0) -> Array:
    """CAM16-UCS J'a'b' of linear RGB (..., 3) as displayed; J' from 0 to 100.

    `white` is the largest value that the display shows, in units of the white that CAM16 adapts to;
    beyond 1, J' goes beyond 100.
    """
    from colour.appearance import VIEWING_CONDITIONS_CAM16, XYZ_to_CAM16
    from colour.models import JMh_CAM16_to_CAM16UCS

    adapted = 100.0 * _rgb_to_xyz().sum(axis=1)
    adapting = 0.2 * viewing.ambient_illuminance / np.pi
    surround = VIEWING_CONDITIONS_CAM16["Average"]

    def convert(block: Array) -> Array:
        xyz = 100.0 * _display_xyz(block, viewing, white)
        model = XYZ_to_CAM16(xyz, adapted, adapting, viewing.background, surround, compute_H=False)
        return JMh_CAM16_to_CAM16UCS(np.stack((model.J, model.M, model.h), axis=-1))

    rgb = np.asarray(rgb, np.float64)
    return _by_blocks(convert, rgb, out=rgb.shape)


def itp(rgb: ArrayLike, viewing: Viewing) -> Array:
    """720 · (I, T, P) of linear RGB (..., 3), so that the Euclidean distance is ΔE_ITP."""
    from colour.models import RGB_to_ICtCp

    matrix = (viewing.exposure * viewing.white_luminance * _bt709_to_bt2020()).T
    scale = 720.0 * np.array([1.0, 0.5, 1.0])

    def convert(block: Array) -> Array:
        absolute = np.clip(block @ matrix, 0.0, PQ_PEAK)
        return scale * RGB_to_ICtCp(absolute, method="ITU-R BT.2100-2 PQ")

    rgb = np.asarray(rgb, np.float64)
    return _by_blocks(convert, rgb, out=rgb.shape)


def ciede2000(lab_a: Array, lab_b: Array) -> Array:
    """ΔE00 between CIE L*a*b* colours (..., 3), with k_L = k_C = k_H = 1."""
    from colour.difference import delta_E_CIE2000

    return _by_blocks(delta_E_CIE2000, lab_a, lab_b, out=lab_a.shape[:-1])


def euclidean(a: Array, b: Array) -> Array:
    """Distance between points (..., 3)."""
    delta = a - b
    return np.sqrt(np.einsum("...i,...i->...", delta, delta))
