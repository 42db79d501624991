"""Running sums of passes whose reference is shown by a tone map.

A picture is tone-mapped after its samples are averaged, so the curve belongs on the mean of the
reference, not on its passes: a pass has more noise than the mean, and the curve would bend it. The
noise of the reference is scaled by the curve's derivative at the mean (the delta method), which
holds where the noise is small against the bend of the curve. Noise of the picture stays as it is: a
picture shares no random numbers with the reference, so the two are independent.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from fotismos.comparisons.departure.blocks import bands
from fotismos.comparisons.departure.colour import Array
from fotismos.comparisons.departure.tone_maps import ToneMap, derivative
from fotismos.comparisons.records.images import Light
from fotismos.heuristic.convention import Floats
from fotismos.reference.rendering.sums import (
    DEVIATION,
    Accumulator,
    DifferenceEstimate,
    DifferenceSums,
)


class MappedReference(DifferenceSums):
    """Running sums of a reference, all of which are as shown by a tone map."""

    def __init__(self, counted: np.ndarray, tone_map: ToneMap) -> None:
        super().__init__(counted)
        self._pairs = Accumulator(DEVIATION)
        self._tone_map = tone_map

    def add(self, image: Any, less: Any = None) -> None:
        """Add a pass of the reference, (H, W, 3)."""
        super().add(image, less)
        # The variances of sums of two channels tell how these go together.
        values = np.array(image, float)
        self._pairs.add(values + np.roll(values, -1, axis=-1))

    def light(self) -> Light:
        """Return the mean of the passes so far, before the tone map."""
        return Light(
            mean=super().mean(np.float32), standard_error=super().standard_error(np.float32)
        )

    def mean(self, dtype: type = float) -> np.ndarray:
        """Return the mean of the passes so far, as shown."""
        return shown_by(self._tone_map, super().mean()).astype(dtype, copy=False)

    def standard_error(self, dtype: type = float) -> np.ndarray:
        """Return the standard error of the mean, as shown."""
        own = super().standard_error() ** 2
        # Covariances of each channel and the next one, red after blue.
        both = (self._pairs.standard_error() ** 2 - own - np.roll(own, -1, axis=-1)) / 2
        slopes = self._slopes()
        variance = _times(slopes**2, own)
        variance += 2 * _times(slopes * np.roll(slopes, -1, axis=-1), both)
        return np.sqrt(np.maximum(variance, 0.0)).astype(dtype, copy=False)

    def noise(self, dtype: type = float) -> np.ndarray:
        """Return the noise image, as shown; the number of passes should be even."""
        return _times(self._slopes(), super().noise()).astype(dtype, copy=False)

    def estimate(self, dtype: type = float) -> DifferenceEstimate:
        """Return the estimate so far; the number of passes should be even and at least 2."""
        plain = super().estimate(dtype)  # mean, error and noise are by the methods above
        slopes = self._slopes()
        grouped = plain.grouped
        light = super().mean().reshape(-1, 3)[grouped.places]
        shown = self.mean().reshape(-1, 3)[grouped.places]
        apart = _times(slopes.reshape(-1, 3, 3)[grouped.places], grouped.means - light)
        return replace(
            plain,
            # As if noise raised all channels in proportion, as that of one path does.
            third=_times(slopes, np.cbrt(plain.third)) ** 3,
            grouped=replace(grouped, means=shown + apart),
        )

    def _slopes(self) -> np.ndarray:
        """Return the derivative of the tone map at each pixel of the mean, (H, W, 3, 3)."""
        light = super().mean()
        parts = [derivative(self._tone_map, light[rows]) for rows in bands(len(light))]
        return np.concatenate([part.astype(np.float32) for part in parts])


class MappedDifference(DifferenceSums):
    """Running sums of a test image, less a reference to which passes are added elsewhere."""

    def __init__(self, counted: np.ndarray, reference: MappedReference) -> None:
        super().__init__(counted)  # of the test image alone
        self._reference = reference

    def add(self, image: Any, less: Any = None) -> None:
        """Add a pass of the test image, a tensor (H, W, 3); the reference has its own."""
        super().add(image)

    def noise(self, dtype: type = float) -> np.ndarray:
        """Return the noise image of the difference; the number of passes should be even."""
        noise: np.ndarray = super().noise() - self._reference.noise()
        return noise.astype(dtype, copy=False)

    def estimate(self, dtype: type = float) -> DifferenceEstimate:
        """Return the estimate so far; the number of passes should be even and at least 2."""
        test = super().estimate()  # its noise is that of the difference, by the method above
        reference = self._reference.estimate()
        error = np.hypot(test.standard_error, reference.standard_error)
        means = test.grouped.means - reference.grouped.means
        return DifferenceEstimate(
            mean=(test.mean - reference.mean).astype(dtype, copy=False),
            standard_error=error.astype(dtype, copy=False),
            noise=test.noise.astype(dtype, copy=False),
            passes=test.passes,
            third=test.third - reference.third,
            grouped=replace(test.grouped, means=means),
        )


def shown_by(tone_map: ToneMap, light: Floats) -> Floats:
    """Return light (H, W, 3) as shown by a tone map, in the light's own precision."""
    shown = [tone_map(light[rows].astype(float)) for rows in bands(len(light))]
    return np.concatenate(shown, dtype=light.dtype)


def _times(slopes: np.ndarray, change: Array) -> Array:
    """Return ``slopes @ change`` of each pixel, (..., 3)."""
    return np.asarray(np.einsum("...ij,...j->...i", slopes, change))
