"""A method's mean distance to the reference, as a curve over its samples.

A rendering is ``x = m + e``, with the method's mean ``m``, wrong by its bias, and noise ``e``. Both
are measured. The mean distance at ``s`` samples is averaged over ``m + λ e_r`` for the measured
residuals ``e_r``, with ``λ = σ(s) / σ(s_r)`` from the mean absolute residual ``σ``, which a few
bright pixels do not dominate. So noise keeps its skew, and the distance its curvature. ``σ`` is a
power of ``s`` between and beyond measured square counts. Other counts stratify worse, by a share
that the measured ones show, and that falls with ``s``. If ``m`` has more noise than ``s`` samples,
``E² = b² + c σ²(s)`` continues from the last counts before.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import ceil, floor, isqrt, log, sqrt
from statistics import fmean

import numpy as np
from numpy.typing import NDArray

FALLS = (-1.0, -0.25)
"""Range of the power of the samples with which noise falls beyond the measured counts: plain Monte
Carlo has -1/2, stratified sampling less."""


@dataclass(frozen=True)
class ErrorCurve:
    """Mean distance to the reference, over the samples, at one size.

    Attributes
    ----------
    mean
        (P, 3): the method's mean image, from the most samples.
    residuals
        ``{s: (R, P, 3)}``: renderings less their mean, by measured count.
    distance
        ``(image (P, 3)) -> mean distance to the reference``.
    noise_of_mean
        Mean absolute noise of ``mean`` itself.
    """

    mean: NDArray
    residuals: dict[int, NDArray]
    distance: Callable[[NDArray], float]
    noise_of_mean: float

    @classmethod
    def measured(
        cls, images: dict[int, NDArray], distance: Callable[[NDArray], float]
    ) -> "ErrorCurve":
        """Make the curve from renderings ``{s: (R, P, 3)}``, at least two of each count."""
        most = max(images)
        residuals = {}
        for spp, rounds in images.items():
            # A mean over R rounds contains 1 / R of each of them.
            unbiased = sqrt(len(rounds) / (len(rounds) - 1))
            residuals[spp] = (rounds - rounds.mean(axis=0)) * unbiased
        noise = _size(residuals[most]) / sqrt(len(images[most]))
        return cls(images[most].mean(axis=0), residuals, distance, noise)

    def noise(self, spp: float) -> float:
        """Return the mean absolute residual at a sample count."""
        known: dict[float, float] = {s: _size(residuals) for s, residuals in self.residuals.items()}
        if spp in known:
            return known[spp]
        squares = {s: size for s, size in known.items() if _is_square(s)}
        others = [size / _power_law(squares, s) for s, size in known.items() if s not in squares]
        worse = float(np.mean(others)) if others and not _is_square(spp) else 1.0
        fading = min(min(set(known) - set(squares), default=1) / spp, 1.0)
        return (1 + (worse - 1) * fading) * _power_law(squares, spp)

    @property
    def bias(self) -> float:
        """The distance of the mean image, which more samples do not reduce."""
        return self.distance(self.mean)

    def without(self, spp: int) -> "ErrorCurve":
        """Return the curve without one of the measured counts, which must not be the largest."""
        left = {s: residuals for s, residuals in self.residuals.items() if s != spp}
        return replace(self, residuals=left)

    def at(self, spp: float) -> float:
        """Return the mean distance at a sample count."""
        last = spp
        while self.noise(last) < self.noise_of_mean and last > 1:
            last //= 4
        if last == spp:
            return self._drawn(spp)
        before, error = self._drawn(max(last // 4, 1)), self._drawn(last)
        fallen = self.noise(max(last // 4, 1)) ** 2 - self.noise(last) ** 2
        slope = (before**2 - error**2) / fallen if fallen > 0 else 0.0
        left = error**2 + max(slope, 0.0) * (self.noise(spp) ** 2 - self.noise(last) ** 2)
        return sqrt(max(left, 0.0))

    def _drawn(self, spp: float) -> float:
        """Draw from the counts on both sides: with rare peaks, either alone is wrong."""
        counts = sorted(self.residuals)
        place = np.interp(log(spp), np.log(counts), range(len(counts)))
        low, high = counts[floor(place)], counts[ceil(place)]
        share = place % 1
        return self._scaled(low, spp) ** (1 - share) * self._scaled(high, spp) ** share

    def _scaled(self, count: int, spp: float) -> float:
        """Return the mean distance with one count's residuals, scaled to the size of another's."""
        residuals = self.residuals[count]
        own = _size(residuals)
        missing = max(self.noise(spp) ** 2 - self.noise_of_mean**2, 0.0)
        factor = sqrt(missing) / own if own > 0 else 0.0
        return fmean(self.distance(self.mean + factor * residual) for residual in residuals)


def _size(residuals: NDArray) -> float:
    return float(np.mean(np.abs(residuals)))


def _is_square(count: float) -> bool:
    return isqrt(int(count)) ** 2 == count


def _power_law(known: dict[float, float], place: float) -> float:
    """Interpolate between the two nearest values in logarithms, or extrapolate."""
    counts = sorted(known)
    if min(known.values()) <= 0 or len(counts) == 1:
        nearest = min(counts, key=lambda count: abs(log(count / place)))
        return known[nearest] * sqrt(nearest / place)
    right = min(max(int(np.searchsorted(counts, place)), 1), len(counts) - 1)
    low, high = counts[right - 1], counts[right]
    power = log(known[high] / known[low]) / log(high / low)
    if not low <= place <= high:
        power = min(max(power, FALLS[0]), FALLS[1])
    anchor = low if place < low else high
    return known[anchor] * (place / anchor) ** power
