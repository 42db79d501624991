"""Colour spaces and differences as Dr.Jit formulas, in double precision unless given single.

colour-science defines them; tests require agreement to 1e-4 of a colour difference. In NumPy they
take as long as rendering; these are compiled, and run on all cores. Functions take and return any
number of colours.

Sources: CIE 15:2018 (L*a*b*), ITU-R BT.2100-2 (ICtCp), Li et al., Color Res. Appl. 42(6), 2017
(CAM16), Sharma, Wu and Dalal, Color Res. Appl. 30(1), 2005 (CIE DE2000).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from math import cos, exp, pi, radians, sin
from typing import TypeVar

import drjit as dr
import numpy as np
from drjit.llvm import Array3f, Array3f64, Float64
from numpy.typing import NDArray

Array = NDArray[np.float64]
Colour = TypeVar("Colour", Array3f, Array3f64)

BT709 = ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06), (0.3127, 0.3290))
"""CIE x, y of red, green, blue and white."""
BT2020 = ((0.708, 0.292), (0.170, 0.797), (0.131, 0.046), (0.3127, 0.3290))

# CIE 15: below this ratio to white, lightness is linear; and its slope there.
_EPSILON, _SLOPE = (24 / 116) ** 3, 841 / 108

# ITU-R BT.2100-2: the PQ curve, and the matrices of ICtCp.
_PQ_M1, _PQ_M2 = 2610 / 16384, 2523 / 32
_PQ_C1, _PQ_C2, _PQ_C3 = 3424 / 4096, 2413 / 128, 2392 / 128
_LMS = np.array([[1688, 2146, 262], [683, 2951, 462], [99, 309, 3688]]) / 4096
_ICTCP = np.array([[2048, 2048, 0], [6610, -13613, 7003], [17933, -17390, -543]]) / 4096

# CAM16: the sharpened cone responses; F, c and N_c of an average surround.
_M16 = np.array(
    [
        [0.401288, 0.650173, -0.051461],
        [-0.250268, 1.204414, 0.045854],
        [-0.002079, 0.048952, 0.953127],
    ]
)
_F, _C, _N_C = 1.0, 0.69, 1.0


@lru_cache(maxsize=4)
def rgb_to_xyz(primaries: tuple[tuple[float, float], ...]) -> Array:
    """Return the matrix (3, 3) from linear RGB to CIE XYZ, in which white has Y = 1.

    It follows from the primaries at full precision: white is exactly D65, so greys have no chroma.
    """
    xyz = np.array([[x / y, 1.0, (1.0 - x - y) / y] for x, y in primaries])
    colours, white = xyz[:-1].T, xyz[-1]
    return colours * np.linalg.solve(colours, white)


def xyz_to_lab(xyz: Colour, white: Sequence[float]) -> Colour:
    """Return CIE L*a*b* of XYZ relative to a white: ``L* = 116 f(Y/Y_n) − 16``."""
    ratio = xyz / type(xyz)(*map(float, white))
    x, y, z = dr.select(ratio > _EPSILON, dr.cbrt(ratio), _SLOPE * ratio + 16 / 116)
    return type(xyz)(116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z))


def rgb_to_ictcp(rgb: Array3f64, peak: float) -> Array3f64:
    """Return ICtCp of linear BT.2020 RGB from 0 to `peak`, with the PQ curve."""
    power = dr.power(times(_LMS, rgb) / peak, _PQ_M1)
    return times(_ICTCP, dr.power((_PQ_C1 + _PQ_C2 * power) / (1.0 + _PQ_C3 * power), _PQ_M2))


def xyz_to_cam16ucs(
    white: Sequence[float], adapting: float, background: float
) -> Callable[[Array3f64], Array3f64]:
    """Return a function from XYZ to J'a'b' of CAM16-UCS, in an average surround.

    XYZ and `white` have Y = 100 for white; `adapting` is the adapting luminance in cd/m², and
    `background` the relative luminance Y_b.
    """
    degree = min(max(_F * (1.0 - exp((-adapting - 42.0) / 92.0) / 3.6), 0.0), 1.0)
    sharp = _M16 @ np.asarray(white)
    gain = degree * white[1] / sharp + 1.0 - degree
    k = 1.0 / (5.0 * adapting + 1.0)
    level = 0.2 * k**4 * 5.0 * adapting + 0.1 * (1.0 - k**4) ** 2 * (5.0 * adapting) ** (1 / 3)
    n = background / white[1]
    induction = 0.725 * n**-0.2
    power = (gain * sharp * level / 100.0) ** 0.42
    largest = np.array([2.0, 1.0, 0.05]) @ (400.0 * power / (power + 27.13))
    # Viewing conditions are inputs of the kernel, so one kernel serves them all.
    numbers = (
        1.0 / largest, _C * (1.48 + n**0.5), 50_000.0 / 13.0 * _N_C * induction,
        (1.64 - 0.29**n) ** 0.73 * level**0.25,
    )  # fmt: skip
    sensitivity, scales = Array3f64(*map(opaque, gain * level / 100.0)), tuple(map(opaque, numbers))
    return lambda xyz: _cam16ucs(times(_M16, xyz) * sensitivity, *scales)


def _cam16ucs(
    cones: Array3f64, dimming: Float64, exponent: Float64, chromatic: Float64, level: Float64
) -> Array3f64:
    """Return J'a'b' of adapted cone responses, in the order of Li et al.

    The 0.1 that CAM16 adds to each response cancels except in the denominator of ``t``.
    """
    power = dr.power(dr.abs(cones), 0.42)
    red, green, blue = dr.mulsign(400.0 * power / (power + 27.13), cones)
    a, b = red - (12.0 * green - blue) / 11.0, (red + green - 2.0 * blue) / 9.0
    light = 2.0 * red + green + 0.05 * blue
    j = _signed_power(light * dimming, exponent)
    size = dr.sqrt(a * a + b * b)
    has_hue = size > 0.0
    cosine, sine = dr.select(has_hue, a / size, 1.0), dr.select(has_hue, b / size, 0.0)
    eccentricity = (cos(2.0) * cosine - sin(2.0) * sine + 3.8) / 4.0
    t = chromatic * eccentricity * size / (red + green + 1.05 * blue + 0.305)
    colourfulness = _signed_power(t, 0.9) * _signed_power(j, 0.5) * level
    shown = dr.log(1.0 + 0.0228 * colourfulness) / 0.0228
    return Array3f64(170.0 * j / (1.0 + 0.7 * j), shown * cosine, shown * sine)


def _signed_power(base: Float64, exponent: float | Float64) -> Float64:
    return dr.mulsign(dr.power(dr.abs(base), exponent), base)


def delta_e_00(first: Array3f64, second: Array3f64) -> Float64:
    """Return ΔE00 between CIE L*a*b* colours, with k_L = k_C = k_H = 1."""
    chroma = [dr.sqrt(a * a + b * b) for _, a, b in (first, second)]
    stretch = 1.5 - 0.5 * _saturation((chroma[0] + chroma[1]) / 2.0)
    (l1, a1, b1), (l2, a2, b2) = first, second
    c1, c2 = (dr.sqrt(dr.square(a * stretch) + b * b) for a, b in ((a1, b1), (a2, b2)))
    h1, h2 = (_hue(a * stretch, b) for a, b in ((a1, b1), (a2, b2)))
    has_hues, turn, total = c1 * c2 != 0.0, h2 - h1, h1 + h2
    # Tolerate rounding for opposite hues, 180 apart; beyond, the difference jumps.
    wide = dr.abs(turn) > 180.0 + 1e-9
    turn = dr.select(wide, turn - dr.mulsign(Float64(360.0), turn), turn)
    turn = dr.select(has_hues, turn, 0.0)
    middle = total + dr.select(wide, dr.select(total < 360.0, 360.0, -360.0), 0.0)
    hue = dr.select(has_hues, middle / 2.0, total)
    lightness, mean = (l1 + l2) / 2.0, (c1 + c2) / 2.0
    t = (
        1.0
        - 0.17 * _cosine(hue - 30.0)
        + 0.24 * _cosine(2.0 * hue)
        + 0.32 * _cosine(3.0 * hue + 6.0)
        - 0.20 * _cosine(4.0 * hue - 63.0)
    )
    off = dr.square(lightness - 50.0)
    delta_l = (l2 - l1) / (1.0 + 0.015 * off / dr.sqrt(20.0 + off))
    delta_c = (c2 - c1) / (1.0 + 0.045 * mean)
    delta_h = 2.0 * dr.sqrt(c1 * c2) * dr.sin(radians(0.5) * turn) / (1.0 + 0.015 * mean * t)
    rotation = dr.sin(radians(60.0) * dr.exp(-dr.square((hue - 275.0) / 25.0)))
    rotation *= -2.0 * _saturation(mean)
    squares = delta_l * delta_l + delta_c * delta_c + delta_h * delta_h
    return dr.sqrt(dr.maximum(squares + rotation * delta_c * delta_h, 0.0))


def _saturation(chroma: Float64) -> Float64:
    """Return ``√(C⁷ / (C⁷ + 25⁷))``."""
    ratio = chroma / 25.0
    seventh = dr.square(ratio * ratio * ratio) * ratio
    return dr.sqrt(seventh / (seventh + 1.0))


def _hue(a: Float64, b: Float64) -> Float64:
    """Return the hue angle in degrees, 0 to 360."""
    angle = dr.atan2(b, a) * (180.0 / pi)
    return dr.select(angle < 0.0, angle + 360.0, angle)


def _cosine(degrees: Float64) -> Float64:
    return dr.cos(radians(1.0) * degrees)


def times(matrix: Array, vector: Colour) -> Colour:
    """Return matrix times vector; the matrix becomes part of the kernel."""
    x, y, z = vector
    return type(vector)(*(a * x + b * y + c * z for a, b, c in matrix.tolist()))


def opaque(value: float) -> Float64:
    """Return a number as an input of the kernel, not a constant in it."""
    return dr.opaque(Float64, float(value))
