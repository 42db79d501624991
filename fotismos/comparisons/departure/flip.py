"""FLIP: the differences that a viewer sees when flipping between two images.

Andersson et al., *FLIP: A Difference Evaluator for Alternating Images* (Proc. ACM Comput. Graph.
Interact. Tech. 3(2), 2020) and *Visualizing Errors in Rendered High Dynamic Range Images*
(Eurographics 2021, short papers). Tests compare it with the authors' program.

Images are blurred as the eye blurs them at a distance, and compared in CIE L*a*b*. Where edges or
points differ, the colour difference counts more. All filters are sums of separable ones, so each is
two products with a band matrix; the formulas in between are compiled. So it takes a fifth of the
time of the authors' program (512 x 512 pixels: 71 against 370 ms, HDR-FLIP 129 against 736).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from math import ceil, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from fotismos.comparisons.departure import arrays
from fotismos.comparisons.departure.arrays import Colours, Numbers
from fotismos.comparisons.departure.blocks import bands
from fotismos.comparisons.departure.colour import Array, rgb_to_xyz, times, xyz_to_lab
from fotismos.comparisons.records.departure import Viewing

Plane = NDArray[np.float32]
Curve = Callable[[Colours], Colours]
Blurs = tuple[tuple[np.float32, Plane], ...]
Seen = tuple[Colours, Numbers, Numbers]

SHOWN = 2.118872
"""Luminance that the tone curve of HDR-FLIP (ACES, by Narkowicz) shows as 0.85."""

LARGEST = 65504.0
"""Largest value of half floats; HDR-FLIP sees no difference beyond it."""

DARKEST = 2.0**-23
"""Luminance, in units of display white, below which all is black: the authors take the rounding of
single floats near 1."""

# Of BT.709, rounded as the authors have it.
_LUMINANCE = np.array((0.2126, 0.7152, 0.0722))

# The white of the authors' matrices differs from BT.709's in the fifth digit.
_PRIMARIES = ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06), (0.31271, 0.32902))

# Section 4.1.1: contrast sensitivity of each opponent channel, as (height, width) of Gaussians.
_SENSITIVITY = (((1.0, 0.0047),), ((1.0, 0.0053),), ((34.1, 0.04), (13.5, 0.025)))
_FEATURE = 0.082
"""Section 4.2: width of the detectors of edges and points, in degrees."""

_POWER = 0.7
_KNEE = 0.4
_KNEE_SHOWN = 0.95
_ACES = (0.9036, 0.018, 0.8748, 0.354, 0.14)
"""ACES by Narkowicz at an exposure of 0.6: ``x (a x + b) / (x (c x + d) + e)``."""

_TILE = 32
"""Rows or columns filtered by one product."""

_PRODUCT = 2**18
"""Most multiplications in one product: beyond, OpenBLAS uses threads, which wait at full load."""

_XYZ = rgb_to_xyz(_PRIMARIES)
_RELATIVE = _XYZ / _XYZ.sum(axis=1, keepdims=True)
# Y, X − Y and Y − Z, relative to white.
_OPPONENT = np.array([[0.0, 1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, -1.0]]) @ _RELATIVE
_FROM_OPPONENT = np.linalg.inv(_OPPONENT)


def ldr_flip(test: Array, reference: Array, viewing: Viewing) -> Plane:
    """Return LDR-FLIP (H, W) from 0 to 1 of linear images (H, W, 3) as a display shows them.

    Images are exposed, then clipped to [0, 1]. Equal images are 0 apart, black and white 0.967,
    green and blue 1. It is symmetric.
    """
    return _flip(test, reference, viewing=viewing, curves=[_clipped])


def hdr_flip(test: Array, reference: Array, viewing: Viewing) -> Plane:
    """Return HDR-FLIP (H, W) from 0 to 1: the largest LDR-FLIP over the range of `exposures`.

    Linear images, as for `ldr_flip`, are only clipped to [0, 65504]. It is not symmetric: the
    reference determines the exposures.
    """
    start, stop = exposures(_exposed(reference, viewing))
    factors = 2.0 ** np.linspace(start, stop, max(2, ceil(stop - start)))
    # Factors are inputs of the kernel, so that all exposures share one.
    inputs = [arrays.constant(factor, is_single=True) for factor in factors.tolist()]
    curves = [partial(_toned, factor=factor) for factor in inputs]
    return _flip(test, reference, viewing=viewing, curves=curves)


def exposures(reference: Array) -> tuple[float, float]:
    """Return the first and last exposure of HDR-FLIP in stops, for a linear image (H, W, 3) ≥ 0.

    ``log2(SHOWN / Y)``, where Y is the largest and the median luminance, at least `DARKEST`; of two
    medians the larger one. They are at most 39 stops apart, and one of a black image.
    """
    light = np.maximum((reference @ _LUMINANCE).ravel(), DARKEST)
    middle = np.partition(light, light.size // 2)[light.size // 2]
    return float(np.log2(SHOWN / light.max())), float(np.log2(SHOWN / middle))


def _flip(test: Array, reference: Array, viewing: Viewing, curves: Sequence[Curve]) -> Plane:
    """Return the largest FLIP over tone curves, by bands of rows to keep temporaries small."""
    eye = _Eye.at(float(viewing.pixels_per_degree))
    result: Plane = np.zeros(test.shape[:2], np.float32)
    height, width = result.shape
    # A margin as wide as the filters: beyond the edge the last pixel repeats.
    columns = np.clip(np.arange(-eye.reach, width + eye.reach), 0, width - 1)
    for rows in bands(height):
        near = np.clip(np.arange(rows.start - eye.reach, rows.stop + eye.reach), 0, height - 1)
        images = [_light(image[np.ix_(near, columns)], viewing) for image in (reference, test)]
        for curve in curves:
            truth = eye.seen(curve(images[0]), len(near))
            shown = eye.seen(curve(images[1]), len(near))
            error = _error(truth, shown)
            np.maximum(result[rows], error.reshape(-1, width), out=result[rows])
    return result


def _exposed(image: Array, viewing: Viewing) -> Array:
    exposed = np.multiply(image, viewing.exposure, dtype=float)
    return np.clip(exposed, 0.0, LARGEST, out=exposed)


def _light(image: Array, viewing: Viewing) -> Colours:
    return arrays.single(_exposed(image, viewing))


def _clipped(light: Colours) -> Colours:
    return arrays.minimum(light, 1.0)


def _toned(light: Colours, factor: Numbers) -> Colours:
    """Return what the tone curve makes of light after an exposure."""
    x = light * factor
    a, b, c, d, e = _ACES
    return arrays.minimum(x * (a * x + b) / (x * (c * x + d) + e), 1.0)


@dataclass(frozen=True)
class _Eye:
    """The filters at a number of pixels per degree, as band matrices (n, n + 2 reach).

    ``blurs`` are of the opponent channels: each has Gaussians, with their shares. ``smooth``,
    ``edge`` and ``point`` are a Gaussian and its derivatives, for the achromatic channel.
    """

    reach: int
    blurs: tuple[Blurs, ...]
    smooth: Plane
    edge: Plane
    point: Plane

    @classmethod
    @lru_cache(maxsize=2)
    def at(cls, pixels: float) -> "_Eye":
        widest = max(width for parts in _SENSITIVITY for _, width in parts)
        # Three standard deviations of the widest Gaussian, `√(width / 2) / π` degrees each.
        reach = ceil(3.0 * sqrt(widest / 2.0) / pi * pixels)
        spread = 0.5 * _FEATURE * pixels
        x = np.arange(-reach, reach + 1.0)
        # The detectors end sooner, at three of their own; all filters have one length.
        smooth = np.where(np.abs(x) <= ceil(3.0 * spread), np.exp(-((x / spread) ** 2) / 2.0), 0.0)
        # First and second derivative; sign and scale do not matter.
        edge = _balanced(x * smooth)
        point = _balanced(((x / spread) ** 2 - 1.0) * smooth)
        return cls(
            reach=reach,
            blurs=tuple(_blurs(parts, x / pixels) for parts in _SENSITIVITY),
            smooth=_band(smooth / smooth.sum()),
            edge=_band(edge),
            point=_band(point),
        )

    def seen(self, rgb: Colours, height: int) -> Seen:
        """Return the blurred colours, the slope and the curvature of lightness, without margins.

        The displayed colours ``rgb`` are of ``height`` rows, 2 reach of them margins.
        """
        channels = times(_OPPONENT, rgb)
        arrays.evaluate(channels)
        planes = [np.asarray(channel).reshape(height, -1) for channel in channels]
        blurred = [
            np.sum([share * _across(_down(plane, band), band) for share, band in parts], axis=0)
            for plane, parts in zip(planes, self.blurs, strict=True)
        ]
        # Detectors along one axis, smooth along the other: two for edges and two for points.
        light = planes[0]
        smooth = _down(planes[0], self.smooth)
        slope = arrays.hypot(
            arrays.single_numbers(_across(smooth, self.edge)),
            arrays.single_numbers(_across(_down(light, self.edge), self.smooth)),
        )
        curvature = arrays.hypot(
            arrays.single_numbers(_across(smooth, self.point)),
            arrays.single_numbers(_across(_down(light, self.point), self.smooth)),
        )
        result = _hunted(arrays.colours(*map(arrays.single_numbers, blurred))), slope, curvature
        arrays.evaluate(*result)
        return result


def _blurs(parts: tuple[tuple[float, float], ...], degrees: Array) -> Blurs:
    """Return the shares and the bands of a channel's Gaussians, sampled at some degrees."""
    # `weight √(π / width) exp(−π² r² / width)`; in two dimensions its sum is its share.
    curves = [np.exp(-(pi**2) * degrees**2 / width) for _, width in parts]
    shares = [
        weight * sqrt(pi / width) * curve.sum() ** 2
        for (weight, width), curve in zip(parts, curves, strict=True)
    ]
    return tuple(
        (np.float32(share / sum(shares)), _band(curve / curve.sum()))
        for share, curve in zip(shares, curves, strict=True)
    )


def _balanced(weights: Array) -> Array:
    """Scale weights so that the positive ones add up to 1, and the negative ones to -1."""
    above = np.maximum(weights, 0.0)
    below = np.maximum(-weights, 0.0)
    return above / float(above.sum()) - below / float(below.sum())


def _band(weights: Array) -> Plane:
    """Return the matrix (_TILE, _TILE + 2 reach) that filters columns."""
    # Row i has the weights from column i on: windows of the padded strip, the last one first.
    strip = np.pad(weights, _TILE - 1).astype(np.float32)
    windows = np.lib.stride_tricks.sliding_window_view(strip, _TILE + len(weights) - 1)
    return np.ascontiguousarray(windows[::-1])


def _down(image: Plane, band: Plane) -> Plane:
    """Filter the columns of an image (h + 2 reach, w)."""
    margin = band.shape[1] - band.shape[0]
    filtered = np.empty((len(image) - margin, image.shape[1]), np.float32)
    step = max(1, _PRODUCT // band.size)
    for top in range(0, len(filtered), _TILE):
        for left in range(0, image.shape[1], step):
            part = filtered[top : top + _TILE, left : left + step]
            size = len(part)
            around = image[top : top + size + margin, left : left + step]
            np.matmul(band[:size, : size + margin], around, out=part)
    return filtered


def _across(image: Plane, band: Plane) -> Plane:
    """Filter the rows of an image (h, w + 2 reach)."""
    return _down(image.T, band).T


def _error(truth: Seen, shown: Seen) -> Plane:
    """Return FLIP (N,) of what is seen of two images."""
    first, edge, point = truth
    second, other_edge, other_point = shown
    slope = arrays.absolute(edge - other_edge)
    curvature = arrays.absolute(point - other_point)
    # `√(max / √2)`: the difference of two slopes is at most √2.
    feature = sqrt(sqrt(0.5)) * arrays.sqrt(arrays.maximum(slope, curvature))
    colour = _redistributed(_apart(first, second))
    # Equal colours are 0 apart, whatever the power.
    return np.array(arrays.select(colour > 0.0, arrays.power(colour, 1.0 - feature), 0.0))


def _hunted(opponent: Colours) -> Colours:
    """Return CIE L*a*b* of blurred opponent colours, chroma scaled by lightness (Hunt)."""
    rgb = arrays.clip(times(_FROM_OPPONENT, opponent), 0.0, 1.0)
    lightness, a, b = xyz_to_lab(times(_XYZ, rgb), _XYZ.sum(axis=1))
    return arrays.colours(lightness, 0.01 * lightness * a, 0.01 * lightness * b)


def _apart(first: Colours, second: Colours) -> Numbers:
    """Return the compressed HyAB distance."""
    lightness, a, b = first - second
    return arrays.power(arrays.absolute(lightness) + arrays.hypot(a, b), _POWER)


# The distance of green and blue; of NumPy's arrays (3, 1), so that it is one whoever computes.
_FARTHEST = float(_apart(_hunted(_OPPONENT[:, 1:2]), _hunted(_OPPONENT[:, 2:3]))[0])


def _redistributed(distance: Numbers) -> Numbers:
    knee = _KNEE * _FARTHEST
    above = _KNEE_SHOWN + (distance - knee) * ((1.0 - _KNEE_SHOWN) / (_FARTHEST - knee))
    return arrays.select(distance < knee, distance * (_KNEE_SHOWN / knee), above)
