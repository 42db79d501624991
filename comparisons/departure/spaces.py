"""Nearly uniform colour spaces, and viewing conditions.

Conversions from linear light with the sRGB primaries (ITU-R BT.709, D65; 1.0 is display white) to
CIE L*a*b*, ICtCp and CAM16-UCS. colour-science defines them, and tests compare them with it; Dr.Jit
computes them on all cores (`comparisons.departure.colorimetry`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import inf
from typing import Annotated, Any, Literal

import drjit as dr
import numpy as np
from drjit.llvm import Array3f, Array3f64, Float32, Float64
from msgspec import Meta
from numpy.typing import ArrayLike, NDArray

from comparisons.departure.colorimetry import (
    BT709,
    BT2020,
    delta_e_00,
    opaque,
    rgb_to_ictcp,
    rgb_to_xyz,
    times,
    xyz_to_cam16ucs,
    xyz_to_lab,
)
from comparisons.records import Positive, Record, plain
from heuristic.errors import InputError

Array = NDArray[np.float64]
Formula = Callable[[Array3f64], Array3f64]

PQ_PEAK = 10_000.0
"""ITU-R BT.2100: the largest luminance that the PQ curve encodes, cd/m²."""

MOST_PIXELS = 1000.0
"""Most pixels per degree: filters grow with it, and no eye resolves this many."""

# Pixels converted at a time, to keep temporaries small.
_BLOCK = 2**17


class Viewing(Record):
    """Viewing conditions; printed with every number that depends on them.

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

    def record(self) -> dict[str, float | str]:
        """Return the values as written to ``comparison.json``."""
        return plain(self)


DEFAULT_VIEWING = Viewing()
"""No exposure, 203 cd/m² white, sRGB's viewing conditions."""


def luminance(rgb: ArrayLike) -> Array:
    """Return the relative luminance Y of linear BT.709 RGB (..., 3); 1 is display white."""
    return np.asarray(rgb, np.float64) @ rgb_to_xyz(BT709)[1]


@dataclass(frozen=True)
class Space:
    """A colour space as a compiled formula.

    ``formula(viewing)`` returns a function of Dr.Jit colours. A call converts linear RGB (..., 3).
    """

    formula: Callable[[Viewing], Formula]

    def __call__(self, rgb: ArrayLike, viewing: Viewing) -> Array:
        return _by_blocks(self.formula(viewing), rgb, out=np.shape(rgb))


@dataclass(frozen=True)
class Distance:
    """A distance of two Dr.Jit colours as a compiled formula. A call takes arrays (..., 3)."""

    formula: Callable[[Array3f64, Array3f64], Float64]

    def __call__(self, a: ArrayLike, b: ArrayLike) -> Array:
        return _by_blocks(self.formula, a, b, out=np.shape(a)[:-1])


def between(
    space: Space, distance: Distance, reference: Array, where: Any, viewing: Viewing
) -> Callable[[Array], Array]:
    """Return a function from images to their distances (...) from a reference (..., 3).

    Their pixels are those at the index `where`. Conversion and distance are one kernel.
    """
    convert = space.formula(viewing)
    fixed = convert(_colours(reference)) if reference.size else None
    dr.eval(fixed)

    def distances(test: Array) -> Array:
        pixels = test[where]
        if fixed is None:
            return np.zeros(pixels.shape[:-1])
        found = distance.formula(fixed, convert(_colours(pixels)))
        return found.numpy().reshape(pixels.shape[:-1])

    return distances


def _by_blocks(function: Callable[..., Any], *arrays: ArrayLike, out: tuple[int, ...]) -> Array:
    """Apply a function of Dr.Jit colours to (..., 3) arrays in blocks; `out` is its shape."""
    flat = [np.asarray(array).reshape(-1, 3) for array in arrays]
    result = np.empty((len(flat[0]), *out[np.ndim(arrays[0]) - 1 :]))
    for start in range(0, len(flat[0]), _BLOCK):
        block = slice(start, start + _BLOCK)
        found = function(*(_colours(pixels[block]) for pixels in flat))
        result[block] = np.asarray(dr.ravel(found)).reshape(result[block].shape)
    return result.reshape(out)


def _colours(pixels: Array) -> Array3f64:
    """Return pixels (..., 3) as Dr.Jit colours; single precision is widened within kernels."""
    if pixels.dtype == np.float32:
        return Array3f64(dr.unravel(Array3f, Float32(np.ascontiguousarray(pixels).ravel())))
    return dr.unravel(Array3f64, Float64(np.ascontiguousarray(pixels, np.float64).ravel()))


def _displayed(viewing: Viewing, white: float = 1.0) -> Formula:
    """Return a function from linear RGB to the XYZ that a display shows; Y of white is 1."""
    exposure, largest = opaque(viewing.exposure), opaque(white)
    matrix = rgb_to_xyz(BT709)
    return lambda rgb: times(matrix, dr.clip(rgb * exposure, 0.0, largest))


def _lab(viewing: Viewing) -> Formula:
    shown, white = _displayed(viewing), rgb_to_xyz(BT709).sum(axis=1)
    return lambda rgb: xyz_to_lab(shown(rgb), white)


def _cam16ucs(viewing: Viewing, white: float = 1.0) -> Formula:
    shown = _displayed(viewing, white)
    adapted = 100.0 * rgb_to_xyz(BT709).sum(axis=1)
    convert = xyz_to_cam16ucs(
        adapted, 0.2 * viewing.ambient_illuminance / np.pi, viewing.background
    )
    return lambda rgb: convert(100.0 * shown(rgb))


def _itp(viewing: Viewing) -> Formula:
    matrix = np.linalg.inv(rgb_to_xyz(BT2020)) @ rgb_to_xyz(BT709)
    level = opaque(viewing.exposure * viewing.white_luminance)
    scale = Array3f64(720.0, 360.0, 720.0)

    def convert(rgb: Array3f64) -> Array3f64:
        absolute = dr.clip(times(matrix, rgb) * level, 0.0, PQ_PEAK)
        return scale * rgb_to_ictcp(absolute, PQ_PEAK)

    return convert


def _squared(a: Array3f64, b: Array3f64) -> Float64:
    return dr.squared_norm(a - b)


lab = Space(_lab)
"""CIE L*a*b* (D65, 2°) of linear RGB as displayed; L* is 0 to 100."""

cam16ucs = Space(_cam16ucs)
"""CAM16-UCS J'a'b' of linear RGB as displayed; J' is 0 to 100."""

cam16ucs_unclipped = Space(partial(_cam16ucs, white=inf))
"""CAM16-UCS of a display without a largest value; above white, J' exceeds 100."""

itp = Space(_itp)
"""720 · (I, T, P) of linear RGB, whose Euclidean distance is ΔE_ITP."""

linear = Space(lambda viewing: lambda rgb: rgb)
"""Linear RGB itself."""

ciede2000 = Distance(delta_e_00)
"""ΔE00 between CIE L*a*b* colours, with k_L = k_C = k_H = 1."""

euclidean = Distance(lambda a, b: dr.sqrt(_squared(a, b)))
"""The distance between points."""

root_mean_square = Distance(lambda a, b: dr.sqrt(_squared(a, b) / 3.0))
"""The root mean square difference of three values."""
