"""The hard cases of colour: where a metric's formula, as printed, has no value.

Metrics compute in double precision. Here the formulas break, not their rounding: powers of negative
numbers, quotients and angles of zero, and the mean of two hues across 0 degrees.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from comparisons.departure.metrics import LOG2_EPSILON, log2_luminance_ratio
from comparisons.departure.spaces import DEFAULT_VIEWING, ciede2000, itp, lab
from comparisons.hard.cases import HardCase, quietly

_BLACK = np.zeros((1, 1, 3))
_NEGATIVE = np.array([[[-0.2, 0.1, 0.3]]])
_RED = np.array([[[1.0, 0.0, 0.0]]])
_GREYS = np.array([[40.0, 0, 0], [90.0, 0, 0]]), np.array([[42.0, 0, 0], [60.0, 0, 0]])
_ACROSS = np.array([[50, 2.5, 0], [50, 2.5, 0]]), np.array([[50, 0, -2.5], [73, 25, -18]])
_PUBLISHED = np.array([4.3065, 27.1492])
"""Two of the pairs of Sharma, Wu and Dalal (2005) whose hues lie on either side of 0 degrees."""

TO_BT2020 = np.array([[0.6274, 0.3293, 0.0433], [0.0691, 0.9195, 0.0114], [0.0164, 0.0880, 0.8956]])
"""From BT.709, by ITU-R BT.2087; its four digits set the bound of negative colours."""


def pq(luminance: NDArray) -> NDArray:
    """Return the curve of ITU-R BT.2100 as printed, of a luminance in cd/m²."""
    power = (luminance / 1e4) ** 0.1593017578125
    return ((0.8359375 + 18.8515625 * power) / (1 + 18.6875 * power)) ** 78.84375


def naive_ciede2000(a: NDArray, b: NDArray, hue: Callable[[NDArray, NDArray], NDArray]) -> NDArray:
    """Return ΔE2000 of CIE L*a*b* colours (N, 3), with ``hue(a, b)`` in degrees and its plain mean.

    Source: Sharma, Wu and Dalal (2005), without their rules for undefined hues and for differences
    of more than 180 degrees.
    """
    mean_chroma = (np.hypot(a[:, 1], a[:, 2]) + np.hypot(b[:, 1], b[:, 2])) / 2
    g = 0.5 * (1 - np.sqrt(mean_chroma**7 / (mean_chroma**7 + 25.0**7)))
    (c1, h1), (c2, h2) = (
        (np.hypot((1 + g) * x[:, 1], x[:, 2]), hue((1 + g) * x[:, 1], x[:, 2])) for x in (a, b)
    )
    lightness, chroma, mean = (a[:, 0] + b[:, 0]) / 2, (c1 + c2) / 2, (h1 + h2) / 2

    def cos(degrees):
        return np.cos(np.deg2rad(degrees))

    t = 1 - 0.17 * cos(mean - 30) + 0.24 * cos(2 * mean)
    t += 0.32 * cos(3 * mean + 6) - 0.2 * cos(4 * mean - 63)
    s_l = 1 + 0.015 * (lightness - 50) ** 2 / np.sqrt(20 + (lightness - 50) ** 2)
    d_l = (b[:, 0] - a[:, 0]) / s_l
    d_c = (c2 - c1) / (1 + 0.045 * chroma)
    d_h = 2 * np.sqrt(c1 * c2) * np.sin(np.deg2rad(h2 - h1) / 2) / (1 + 0.015 * chroma * t)
    turn = 60 * np.exp(-(((mean - 275) / 25) ** 2))
    r = -np.sin(np.deg2rad(turn)) * 2 * np.sqrt(chroma**7 / (chroma**7 + 25.0**7))
    return np.sqrt(d_l**2 + d_c**2 + d_h**2 + r * d_c * d_h)


def _quotient_hue(a, b):
    return np.rad2deg(np.arctan(b / a)) % 360


def _full_hue(a, b):
    return np.rad2deg(np.arctan2(b, a)) % 360


def _grey_differences():
    """ΔE2000 of greys, whose chroma is 0: ``ΔL / S_L``."""
    a, b = (lab[:, 0] for lab in _GREYS)
    middle = (a + b) / 2 - 50
    return abs(b - a) / (1 + 0.015 * middle**2 / np.sqrt(20 + middle**2))


def _naive_lightness():
    """CIE L* of a luminance below 0, without the straight part of its curve."""
    return 116 * (_NEGATIVE[..., 0] ** (1 / 3)) - 16


def _clipped_in_bt2020():
    """Return the colour that a display of BT.2020 shows instead of the negative one, in BT.709."""
    return np.maximum(_NEGATIVE @ TO_BT2020.T, 0) @ np.linalg.inv(TO_BT2020).T


def _intensity(rgb):
    """Return ICtCp's intensity of colours."""
    return itp(rgb, DEFAULT_VIEWING)[..., 0] / 720


_MILLION = np.full((1, 1, 3), 1e6 / DEFAULT_VIEWING.white_luminance)
_OF_RED = np.array([0.2126 * 0.5, 0.2126])
"""Luminances of half red and of red (ITU-R BT.709)."""

CASES = (
    HardCase(
        "black against black", "colour", "The ratio of two luminances of 0: 0 / 0.", 1e-12,
        quietly(lambda: np.log2(_BLACK[..., 0] / _BLACK[..., 0])),
        lambda: log2_luminance_ratio(_BLACK, _BLACK), lambda: np.zeros((1, 1)),
    ),
    HardCase(
        "black against a colour", "colour", "A difference relative to black is infinite.", 1e-3,
        quietly(lambda: np.log2(_RED[..., 0] / _BLACK[..., 0])),
        lambda: log2_luminance_ratio(_RED, _BLACK),
        lambda: np.log2(np.full((1, 1), 0.2126) / LOG2_EPSILON + 1),
    ),
    HardCase(
        "negative colours", "colour",
        "The curve of BT.2100 is a power; out of gamut its base is negative.", 1e-3,
        quietly(lambda: pq(_NEGATIVE * DEFAULT_VIEWING.white_luminance)),
        lambda: itp(_NEGATIVE, DEFAULT_VIEWING),
        lambda: itp(_clipped_in_bt2020(), DEFAULT_VIEWING),
    ),
    HardCase(
        "negative luminance", "colour",
        "L* is a cube root. A display shows black, whose L* is 0.", 1e-12,
        quietly(_naive_lightness),
        lambda: lab(-_RED, DEFAULT_VIEWING)[..., 0], lambda: np.zeros((1, 1)),
    ),
    HardCase(
        "1e6 cd/m²", "colour",
        "The curve of BT.2100 ends at 10,000 cd/m² with 1; beyond, it rises without meaning.",
        1e-6, lambda: pq(_MILLION[..., 0] * DEFAULT_VIEWING.white_luminance),
        lambda: _intensity(_MILLION), lambda: np.ones((1, 1)),
    ),
    HardCase(
        "neutral greys", "colour", "Without chroma there is no hue: arctan(0 / 0).", 1e-9,
        quietly(lambda: naive_ciede2000(*_GREYS, _quotient_hue)),
        lambda: ciede2000(*_GREYS), _grey_differences,
    ),
    HardCase(
        "hues on either side of 0°", "colour",
        "The mean of 10° and 350° is 0°, not 180°; ΔE2000 depends on it.", 2e-5,
        quietly(lambda: naive_ciede2000(*_ACROSS, _full_hue)),
        lambda: ciede2000(*_ACROSS), lambda: _PUBLISHED,
    ),
    HardCase(
        "one channel only", "colour",
        "Half red against red, channel by channel: 1/2, 0 / 0 and 0 / 0, whose mean is NaN.", 1e-5,
        quietly(lambda: np.log2((0.5 * _RED) / _RED).mean(axis=-1)),
        lambda: log2_luminance_ratio(0.5 * _RED, _RED),
        lambda: np.log2((_OF_RED[:1] + LOG2_EPSILON) / (_OF_RED[1:] + LOG2_EPSILON))[None],
    ),
)  # fmt: skip
"""The cases of colour."""
