"""FLIP: the differences that a viewer sees when flipping between two images.

Andersson et al., *FLIP: A Difference Evaluator for Alternating Images* (Proc. ACM Comput. Graph.
Interact. Tech. 3(2), 2020) and *Visualizing Errors in Rendered High Dynamic Range Images*
(Eurographics 2021, short papers). Tests compare it with the authors' program.

Images are blurred as the eye blurs them at a distance, and compared in CIE L*a*b*. Where edges or
points differ, the colour difference counts more. All filters are sums of separable ones, so each is
two products with a band matrix; the formulas in between are compiled. The reference is blurred once
for all images, and exposures of small images share one call.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import ceil, pi, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fotismos.comparisons.departure import arrays
from fotismos.comparisons.departure.arrays import Colours, Numbers
from fotismos.comparisons.departure.blocks import bands
from fotismos.comparisons.departure.colour import Array, rgb_to_xyz, times, xyz_to_lab
from fotismos.comparisons.records.departure import Viewing

Plane = NDArray[np.float32]
Curve = Callable[[Numbers, Numbers], Numbers]
Blurs = tuple[tuple[np.float32, Plane], ...]

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

_TOGETHER = 2**18
"""Pixels of exposures that are computed together, margins included; or all of one exposure."""

_PRODUCT = 2**18
"""Most multiplications in one product: beyond, OpenBLAS uses threads, which wait at full load."""

_XYZ = rgb_to_xyz(_PRIMARIES)
_RELATIVE = _XYZ / _XYZ.sum(axis=1, keepdims=True)
# Y, X − Y and Y − Z, relative to white.
_OPPONENT = np.array([[0.0, 1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, -1.0]]) @ _RELATIVE
_FROM_OPPONENT = np.linalg.inv(_OPPONENT)


def ldr_flip(tests: Sequence[Array], reference: Array, viewing: Viewing) -> list[Plane]:
    """Return LDR-FLIP (H, W) from 0 to 1 of linear images (H, W, 3) as a display shows them.

    Images are exposed, then clipped to [0, 1]. Equal images are 0 apart, black and white 0.967,
    green and blue 1. It is symmetric.
    """
    return _flip(tests, reference, viewing=viewing, curve=_clipped, factors=[1.0])


def hdr_flip(tests: Sequence[Array], reference: Array, viewing: Viewing) -> list[Plane]:
    """Return HDR-FLIP (H, W) from 0 to 1: the largest LDR-FLIP over the range of `exposures`.

    Linear images, as for `ldr_flip`, are only clipped to [0, 65504]. It is not symmetric: the
    reference determines the exposures.
    """
    start, stop = exposures(_exposed(reference, viewing))
    stops = np.linspace(start, stop, max(2, ceil(stop - start)))
    return _flip(tests, reference, viewing=viewing, curve=_toned, factors=2.0**stops)


def exposures(reference: Array) -> tuple[float, float]:
    """Return the first and last exposure of HDR-FLIP in stops, for a linear image (H, W, 3) ≥ 0.

    ``log2(SHOWN / Y)``, where Y is the largest and the median luminance, at least `DARKEST`; of two
    medians the larger one. They are at most 39 stops apart, and one of a black image.
    """
    light = np.maximum((reference @ _LUMINANCE).ravel(), DARKEST)
    middle = np.partition(light, light.size // 2)[light.size // 2]
    return float(np.log2(SHOWN / light.max())), float(np.log2(SHOWN / middle))


def _flip(
    tests: Sequence[Array],
    reference: Array,
    viewing: Viewing,
    curve: Curve,
    factors: ArrayLike,
) -> list[Plane]:
    """Return the largest FLIP over factors of the light, by bands of rows: temporaries are small.

    The curve makes of light and a factor what is shown.
    """
    eye = _Eye.at(float(viewing.pixels_per_degree))
    scales = np.asarray(factors, np.float32)[:, None, None]
    results: list[Plane] = [np.zeros(test.shape[:2], np.float32) for test in tests]
    height = len(reference)
    for rows in bands(height):
        truth = _light(reference, viewing, rows=rows, margin=eye.reach)
        shown = [_light(test, viewing, rows=rows, margin=eye.reach) for test in tests]
        step = max(1, _TOGETHER // truth[0].size)
        for start in range(0, len(scales), step):
            some = scales[start : start + step]
            expected = eye.seen(truth, some, curve)
            for result, light in zip(results, shown, strict=True):
                error = arrays.planes(_error, *expected, *eye.seen(light, some, curve))
                largest = error[0].max(axis=0)
                np.maximum(result[rows], largest, out=result[rows])
    return results


def _exposed(image: Array, viewing: Viewing) -> Array:
    exposed = np.multiply(image, viewing.exposure, dtype=float)
    return np.clip(exposed, 0.0, LARGEST, out=exposed)


def _light(image: Array, viewing: Viewing, rows: slice, margin: int) -> Plane:
    """Return planes (3, h, w) of rows of an image, with a margin as wide as the filters.

    Beyond the edge the last pixel repeats.
    """
    top = max(rows.start - margin, 0)
    bottom = min(rows.stop + margin, len(image))
    planes = _exposed(image[top:bottom], viewing).transpose(2, 0, 1).astype(np.float32)
    down = (margin - rows.start + top, margin - bottom + rows.stop)
    return np.pad(planes, ((0, 0), down, (margin, margin)), mode="edge")


def _clipped(light: Numbers, factor: Numbers) -> Numbers:
    return arrays.minimum(light * factor, 1.0)


def _toned(light: Numbers, factor: Numbers) -> Numbers:
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

    def seen(self, light: Plane, scales: Plane, curve: Curve) -> Plane:
        """Return what is seen of light (3, h, w) at scales (B, 1, 1), without margins: (5, B, ...).

        These are the blurred colours, and the slope and the curvature of lightness.
        """

        def opponent(red: Numbers, green: Numbers, blue: Numbers, scale: Numbers) -> Colours:
            rgb = [curve(channel, scale) for channel in (red, green, blue)]
            return times(_OPPONENT, arrays.colours(*rgb))

        shape = (len(scales), *light.shape[1:])
        given = [np.broadcast_to(plane, shape) for plane in (*light, scales)]
        channels = arrays.planes(opponent, *given)
        blurred = [
            _blurred(plane, parts) for plane, parts in zip(channels, self.blurs, strict=True)
        ]
        # Detectors along one axis, smooth along the other: two for edges and two for points.
        lightness = channels[0]
        smooth = _down(lightness, self.smooth)
        detected = (
            _across(smooth, self.edge),
            _across(_down(lightness, self.edge), self.smooth),
            _across(smooth, self.point),
            _across(_down(lightness, self.point), self.smooth),
        )
        return arrays.planes(_seen, *blurred, *detected)


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


def _blurred(images: Plane, parts: Blurs) -> Plane:
    """Blur images (B, h + 2 reach, w + 2 reach) by a sum of Gaussians."""
    blurred: Plane = sum(
        (share * _across(_down(images, band), band) for share, band in parts),
        start=np.zeros((), np.float32),
    )
    return blurred


def _down(images: Plane, band: Plane) -> Plane:
    """Filter the columns of images (B, h + 2 reach, w)."""
    margin = band.shape[1] - band.shape[0]
    count, height, width = images.shape
    filtered = np.empty((count, height - margin, width), np.float32)
    step = max(1, _PRODUCT // band.size)
    for top in range(0, height - margin, _TILE):
        for left in range(0, width, step):
            part = filtered[:, top : top + _TILE, left : left + step]
            size = part.shape[1]
            around = images[:, top : top + size + margin, left : left + step]
            np.matmul(band[:size, : size + margin], around, out=part)
    return filtered


def _across(images: Plane, band: Plane) -> Plane:
    """Filter the rows of images (B, h, w + 2 reach)."""
    return _down(images.swapaxes(1, 2), band).swapaxes(1, 2)


def _error(
    lightness: Numbers, a: Numbers, b: Numbers, edge: Numbers, point: Numbers, *shown: Numbers
) -> tuple[Numbers]:
    """Return FLIP of what is seen of two images."""
    *second, other_edge, other_point = shown
    slope = arrays.absolute(edge - other_edge)
    curvature = arrays.absolute(point - other_point)
    # `√(max / √2)`: the difference of two slopes is at most √2.
    feature = sqrt(sqrt(0.5)) * arrays.sqrt(arrays.maximum(slope, curvature))
    first = (lightness, a, b)
    colour = _redistributed(_apart(first, second))
    # Equal colours are 0 apart, whatever the power.
    return (arrays.select(colour > 0.0, arrays.power(colour, 1.0 - feature), 0.0),)


def _seen(
    lightness: Numbers, redness: Numbers, blueness: Numbers, *detected: Numbers
) -> tuple[Numbers, ...]:
    """Return colours, and the slope and the curvature, of what the filters leave."""
    across, along, point_across, point_along = detected
    colours = _hunted(arrays.colours(lightness, redness, blueness))
    return (*colours, _length(across, along), _length(point_across, point_along))


def _length(first: Numbers, second: Numbers) -> Numbers:
    return arrays.sqrt(first * first + second * second)


def _hunted(opponent: Colours) -> Colours:
    """Return CIE L*a*b* of blurred opponent colours, chroma scaled by lightness (Hunt)."""
    rgb = arrays.clip(times(_FROM_OPPONENT, opponent), 0.0, 1.0)
    lightness, a, b = xyz_to_lab(times(_XYZ, rgb), _XYZ.sum(axis=1))
    return arrays.colours(lightness, 0.01 * lightness * a, 0.01 * lightness * b)


def _apart(first: Iterable[Numbers], second: Iterable[Numbers]) -> Numbers:
    """Return the compressed HyAB distance."""
    l1, a1, b1 = first
    l2, a2, b2 = second
    return arrays.power(arrays.absolute(l1 - l2) + _length(a1 - a2, b1 - b2), _POWER)


# The distance of green and blue; of NumPy's arrays (3, 1), so that it is one whoever computes.
_FARTHEST = float(_apart(_hunted(_OPPONENT[:, 1:2]), _hunted(_OPPONENT[:, 2:3]))[0])


def _redistributed(distance: Numbers) -> Numbers:
    knee = _KNEE * _FARTHEST
    above = _KNEE_SHOWN + (distance - knee) * ((1.0 - _KNEE_SHOWN) / (_FARTHEST - knee))
    return arrays.select(distance < knee, distance * (_KNEE_SHOWN / knee), above)
