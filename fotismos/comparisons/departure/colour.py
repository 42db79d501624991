"""Colour: viewing conditions, nearly uniform spaces and differences.

Images are linear light with the sRGB primaries (ITU-R BT.709, D65); 1.0 is display white.
colour-science defines the formulas, and tests require agreement to 1e-4 of a colour difference.
Dr.Jit or NumPy computes them (:mod:`fotismos.comparisons.departure.arrays`).

Sources: CIE 15:2018 (L*a*b*), ITU-R BT.2100-2 (ICtCp), Li et al., Color Res. Appl. 42(6), 2017
(CAM16), Sharma, Wu and Dalal, Color Res. Appl. 30(1), 2005 (CIE DE2000).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from math import cos, exp, inf, pi, radians, sin

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fotismos.comparisons.departure import arrays
from fotismos.comparisons.departure.arrays import Colours, Formula, Numbers
from fotismos.comparisons.records.departure import Viewing

Array = NDArray[np.float64]

PQ_PEAK = 10_000.0
"""ITU-R BT.2100: the largest luminance that the PQ curve encodes, cd/m²."""

BLACK = 1e-5
"""Display-linear: an image with no brighter pixel is black, and no difference can be seen in it."""

BT709 = ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06), (0.3127, 0.3290))
"""CIE x, y of red, green, blue and white."""
CHROMATICITIES = tuple(value for point in BT709 for value in point)
"""The same in a row, as files have them."""
BT2020 = ((0.708, 0.292), (0.170, 0.797), (0.131, 0.046), (0.3127, 0.3290))

# CIE 15: below this ratio to white, lightness is linear; and its slope there.
_EPSILON = (24 / 116) ** 3
_SLOPE = 841 / 108

# ITU-R BT.2100-2: the PQ curve, and the matrices of ICtCp.
_PQ_M1 = 2610 / 16384
_PQ_M2 = 2523 / 32
_PQ_C1 = 3424 / 4096
_PQ_C2 = 2413 / 128
_PQ_C3 = 2392 / 128
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
_F = 1.0
_C = 0.69
_N_C = 1.0


def luminance(rgb: ArrayLike) -> Array:
    """Return the relative luminance Y of linear BT.709 RGB (..., 3); 1 is display white."""
    weights: Array = rgb_to_xyz(BT709)[1]
    return np.asarray(rgb, np.float64) @ weights


def to_srgb(linear: ArrayLike) -> Array:
    """Return values >= 0 by the curve of IEC 61966-2-1.

    ``12.92 v`` up to 0.0031308, else ``1.055 v^(1/2.4) - 0.055``.
    """
    linear = np.maximum(linear, 0)
    low = linear <= 0.0031308
    return np.where(low, 12.92 * linear, 1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055)


def from_srgb(encoded: ArrayLike) -> Array:
    """Return linear values: ``v / 12.92`` up to 0.04045, else ((v + 0.055) / 1.055)^2.4."""
    # Both branches are evaluated everywhere: a power of a negative value would be NaN.
    encoded = np.asarray(encoded)
    low = encoded <= 0.04045
    return np.where(low, encoded / 12.92, ((np.maximum(encoded, 0.04045) + 0.055) / 1.055) ** 2.4)


def from_pq(encoded: ArrayLike) -> Array:
    """Return the luminance in cd/m², 0 to 10,000, of values from 0 to 1 (ITU-R BT.2100-2)."""
    power = np.asarray(encoded, np.float64) ** (1 / _PQ_M2)
    return PQ_PEAK * (np.maximum(power - _PQ_C1, 0) / (_PQ_C2 - _PQ_C3 * power)) ** (1 / _PQ_M1)


# --- Formulas ---


@lru_cache(maxsize=4)
def rgb_to_xyz(primaries: tuple[tuple[float, float], ...]) -> Array:
    """Return the matrix (3, 3) from linear RGB to CIE XYZ, in which white has Y = 1.

    It follows from the primaries at full precision: white is exactly D65, so greys have no chroma.
    """
    *colours, white = np.array([[x, y, 1.0 - x - y] for x, y in primaries])
    columns = np.transpose(colours)
    # Columns are the primaries, scaled so that RGB (1, 1, 1) is white.
    return columns * np.linalg.solve(columns, white / white[1])


def xyz_to_lab(xyz: Colours, white: Sequence[float]) -> Colours:
    """Return CIE L*a*b* of XYZ relative to a white: ``L* = 116 f(Y/Y_n) − 16``."""
    ratios = (value / float(of_white) for value, of_white in zip(xyz, white, strict=True))
    x, y, z = map(_compressed, ratios)
    return arrays.colours(116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z))


def _compressed(ratio: Numbers) -> Numbers:
    return arrays.select(ratio > _EPSILON, arrays.cbrt(ratio), _SLOPE * ratio + 16 / 116)


def _to_cam16ucs(viewing: Viewing, largest: float = 1.0) -> Formula:
    """Return a function from linear RGB to J'a'b' of CAM16-UCS, in an average surround."""
    shown = _displayed(viewing, largest)
    white = 100.0 * rgb_to_xyz(BT709).sum(axis=1)
    adapting = 0.2 * viewing.ambient_illuminance / np.pi  # cd/m²
    # The degree of adaptation D, and the gain that it gives to each cone response.
    degree = min(max(_F * (1.0 - exp((-adapting - 42.0) / 92.0) / 3.6), 0.0), 1.0)
    sharp = _M16 @ white
    gain = degree * white[1] / sharp + 1.0 - degree
    # F_L, the adaptation to the level of luminance.
    k = 1.0 / (5.0 * adapting + 1.0)
    level = 0.2 * k**4 * 5.0 * adapting + 0.1 * (1.0 - k**4) ** 2 * (5.0 * adapting) ** (1 / 3)
    # N_bb, which is also N_cb, from the background's share of white.
    n = viewing.background / white[1]
    induction = 0.725 * n**-0.2
    # A_w without N_bb, which cancels in A / A_w.
    power = (gain * sharp * level / 100.0) ** 0.42
    achromatic = np.array([2.0, 1.0, 0.05]) @ (400.0 * power / (power + 27.13))
    # Viewing conditions are inputs of the kernel, so one kernel serves them all.
    numbers = (
        1.0 / achromatic, _C * (1.48 + n**0.5), 50_000.0 / 13.0 * _N_C * induction,
        (1.64 - 0.29**n) ** 0.73 * level**0.25,
    )  # fmt: skip
    sensitivity = tuple(map(arrays.constant, gain * level / 100.0))
    scales = tuple(map(arrays.constant, numbers))

    def convert(rgb: Colours) -> Colours:
        cones = times(_M16, 100.0 * shown(rgb))
        adapted = (cone * factor for cone, factor in zip(cones, sensitivity, strict=True))
        return _cam16ucs(arrays.colours(*adapted), *scales)

    return convert


def _cam16ucs(
    cones: Colours, dimming: Numbers, exponent: Numbers, chromatic: Numbers, level: Numbers
) -> Colours:
    """Return J'a'b' of adapted cone responses, in the order of Li et al.

    The 0.1 that CAM16 adds to each response cancels except in the denominator of ``t``.
    """
    power = arrays.power(arrays.absolute(cones), 0.42)
    red, green, blue = arrays.with_sign(400.0 * power / (power + 27.13), cones)
    a = red - (12.0 * green - blue) / 11.0
    b = (red + green - 2.0 * blue) / 9.0
    light = 2.0 * red + green + 0.05 * blue
    j = _signed_power(light * dimming, exponent)
    size = arrays.sqrt(a * a + b * b)
    # Grey has no hue, and 0 / 0 would be NaN; its chroma of 0 hides the one chosen.
    has_hue = size > 0.0
    cosine = arrays.select(has_hue, a / size, 1.0)
    sine = arrays.select(has_hue, b / size, 0.0)
    # `(cos(h + 2) + 3.8) / 4`, by the sum of angles: the angle itself is not needed.
    eccentricity = (cos(2.0) * cosine - sin(2.0) * sine + 3.8) / 4.0
    t = chromatic * eccentricity * size / (red + green + 1.05 * blue + 0.305)
    colourfulness = _signed_power(t, 0.9) * _signed_power(j, 0.5) * level
    # CAM16-UCS: J and M compressed, with M along the hue.
    shown = arrays.log(1.0 + 0.0228 * colourfulness) / 0.0228
    return arrays.colours(170.0 * j / (1.0 + 0.7 * j), shown * cosine, shown * sine)


def _signed_power(base: Numbers, exponent: float | Numbers) -> Numbers:
    return arrays.with_sign(arrays.power(arrays.absolute(base), exponent), base)


def delta_e_00(first: Colours, second: Colours) -> Numbers:
    """Return ΔE00 between CIE L*a*b* colours, with k_L = k_C = k_H = 1."""
    chroma = [arrays.sqrt(a * a + b * b) for _, a, b in (first, second)]
    # 1 + G, by which a is stretched near the neutral axis.
    stretch = 1.5 - 0.5 * _saturation((chroma[0] + chroma[1]) / 2.0)
    (l1, a1, b1) = first
    (l2, a2, b2) = second
    c1 = arrays.sqrt(arrays.square(a1 * stretch) + b1 * b1)
    c2 = arrays.sqrt(arrays.square(a2 * stretch) + b2 * b2)
    h1 = _hue(a1 * stretch, b1)
    h2 = _hue(a2 * stretch, b2)
    # The hue of a grey is 0 here: if one colour is grey, `total` is the hue of the other.
    has_hues = c1 * c2 != 0.0
    turn = h2 - h1
    total = h1 + h2
    # Tolerate rounding for opposite hues, 180 apart; beyond, the difference jumps.
    wide = arrays.absolute(turn) > 180.0 + 1e-9
    turn = arrays.select(wide, turn - arrays.select(turn < 0.0, -360.0, 360.0), turn)
    turn = arrays.select(has_hues, turn, 0.0)
    middle = total + arrays.select(wide, arrays.select(total < 360.0, 360.0, -360.0), 0.0)
    hue = arrays.select(has_hues, middle / 2.0, total)
    # Differences over their weights S_L, S_C and S_H, and the rotation R_T in the blue.
    lightness = (l1 + l2) / 2.0
    mean = (c1 + c2) / 2.0
    t = (
        1.0
        - 0.17 * _cosine(hue - 30.0)
        + 0.24 * _cosine(2.0 * hue)
        + 0.32 * _cosine(3.0 * hue + 6.0)
        - 0.20 * _cosine(4.0 * hue - 63.0)
    )
    off = arrays.square(lightness - 50.0)
    delta_l = (l2 - l1) / (1.0 + 0.015 * off / arrays.sqrt(20.0 + off))
    delta_c = (c2 - c1) / (1.0 + 0.045 * mean)
    chord = 2.0 * arrays.sqrt(c1 * c2) * arrays.sin(radians(0.5) * turn)
    delta_h = chord / (1.0 + 0.015 * mean * t)
    rotation = arrays.sin(radians(60.0) * arrays.exp(-arrays.square((hue - 275.0) / 25.0)))
    rotation *= -2.0 * _saturation(mean)
    squares = delta_l * delta_l + delta_c * delta_c + delta_h * delta_h
    return arrays.sqrt(arrays.maximum(squares + rotation * delta_c * delta_h, 0.0))


def _saturation(chroma: Numbers) -> Numbers:
    """Return ``√(C⁷ / (C⁷ + 25⁷))``."""
    ratio = chroma / 25.0
    seventh = arrays.square(ratio * ratio * ratio) * ratio
    return arrays.sqrt(seventh / (seventh + 1.0))


def _hue(a: Numbers, b: Numbers) -> Numbers:
    """Return the hue angle in degrees, 0 to 360."""
    angle = arrays.arctan2(b, a) * (180.0 / pi)
    return arrays.select(angle < 0.0, angle + 360.0, angle)


def _cosine(degrees: Numbers) -> Numbers:
    return arrays.cos(radians(1.0) * degrees)


def times(matrix: Array, vector: Colours) -> Colours:
    """Return matrix times vector; the matrix becomes part of the kernel."""
    x, y, z = vector
    return arrays.colours(*(a * x + b * y + c * z for a, b, c in matrix.tolist()))


# --- Arrays ---


@dataclass(frozen=True)
class Space:
    """A colour space as a formula.

    ``formula(viewing)`` returns a function of colours. A call converts linear RGB (..., 3).
    """

    formula: Callable[[Viewing], Formula]

    def __call__(self, rgb: ArrayLike, viewing: Viewing) -> Array:
        rgb = np.asarray(rgb)
        if not rgb.size:
            return np.zeros(rgb.shape)
        return arrays.computed(self.formula(viewing), rgb)


@dataclass(frozen=True)
class Distance:
    """A distance of two colours as a formula. A call takes arrays (..., 3)."""

    formula: Formula

    def after(self, convert: Formula) -> "Distance":
        """Return the distance of a colour from what ``convert`` makes of a second one."""
        return Distance(lambda first, second: self.formula(first, convert(second)))

    def __call__(self, a: ArrayLike, b: ArrayLike) -> Array:
        a, b = np.broadcast_arrays(a, b)
        if not a.size:
            return np.zeros(a.shape[:-1])
        return arrays.computed(self.formula, a, b)


def _displayed(viewing: Viewing, white: float = 1.0) -> Formula:
    """Return a function from linear RGB to the XYZ that a display shows; Y of white is 1."""
    exposure = arrays.constant(viewing.exposure)
    largest = arrays.constant(white)
    matrix = rgb_to_xyz(BT709)
    return lambda rgb: times(matrix, arrays.clip(rgb * exposure, 0.0, largest))


@Space
def lab(viewing: Viewing) -> Formula:
    """CIE L*a*b* (D65, 2°) of linear RGB as displayed; L* is 0 to 100."""
    shown = _displayed(viewing)
    white = rgb_to_xyz(BT709).sum(axis=1)
    return lambda rgb: xyz_to_lab(shown(rgb), white)


@Space
def itp(viewing: Viewing) -> Formula:
    """720 · (I, T, P) of linear RGB, whose Euclidean distance is ΔE_ITP."""
    matrix = np.linalg.inv(rgb_to_xyz(BT2020)) @ rgb_to_xyz(BT709)
    level = arrays.constant(viewing.exposure * viewing.white_luminance)

    def convert(rgb: Colours) -> Colours:
        absolute = arrays.clip(times(matrix, rgb) * level, 0.0, PQ_PEAK)
        power = arrays.power(times(_LMS, absolute) / PQ_PEAK, _PQ_M1)
        encoded = arrays.power((_PQ_C1 + _PQ_C2 * power) / (1.0 + _PQ_C3 * power), _PQ_M2)
        intensity, tritan, protan = times(_ICTCP, encoded)
        # BT.2124 halves the second coordinate: T = C_T / 2.
        return arrays.colours(720.0 * intensity, 360.0 * tritan, 720.0 * protan)

    return convert


cam16ucs = Space(_to_cam16ucs)
"""CAM16-UCS J'a'b' of linear RGB as displayed; J' is 0 to 100."""

cam16ucs_unclipped = Space(partial(_to_cam16ucs, largest=inf))
"""CAM16-UCS of a display without a largest value; above white, J' exceeds 100."""

linear = Space(lambda viewing: lambda rgb: rgb)
"""Linear RGB itself."""


@Space
def srgb(viewing: Viewing) -> Formula:
    """Values of sRGB as displayed, from 0 to 1; see `to_srgb`."""
    exposure = arrays.constant(viewing.exposure)

    def encode(rgb: Colours) -> Colours:
        shown = arrays.clip(rgb * exposure, 0.0, 1.0)
        curved = 1.055 * arrays.power(shown, 1 / 2.4) - 0.055
        return arrays.select(shown <= 0.0031308, 12.92 * shown, curved)

    return encode


ciede2000 = Distance(delta_e_00)
"""ΔE00 between CIE L*a*b* colours, with k_L = k_C = k_H = 1."""

euclidean = Distance(lambda a, b: arrays.sqrt(arrays.squared_norm(a - b)))
"""The distance between points."""

root_mean_square = Distance(lambda a, b: arrays.sqrt(arrays.squared_norm(a - b) / 3.0))
"""The root mean square difference of three values."""

RELATIVE_EPSILON = 1e-2
"""Added to the denominators of relative differences, which black would make infinite."""


@Distance
def relative_square(reference: Colours, test: Colours) -> Numbers:
    """The squared difference over the squared reference: a mean of three values."""
    squares = arrays.square(test - reference) / (arrays.square(reference) + RELATIVE_EPSILON)
    return arrays.total(squares) / 3.0


@Distance
def symmetric_relative(reference: Colours, test: Colours) -> Numbers:
    """The absolute difference over the sum of both: a mean of three values, below 1."""
    size = arrays.absolute(test) + arrays.absolute(reference) + RELATIVE_EPSILON
    return arrays.total(arrays.absolute(test - reference) / size) / 3.0
