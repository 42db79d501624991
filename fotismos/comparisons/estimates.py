"""Both halves as sums of passes."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from fotismos.comparisons.departure.blocks import bands
from fotismos.comparisons.departure.metrics import METRICS, Metric
from fotismos.comparisons.options import Options
from fotismos.comparisons.records.images import Images
from fotismos.reference.rendering.sums import (
    DEVIATION,
    MEAN,
    Accumulator,
    DifferenceSums,
    add_difference,
)

PERCENTILE = 95
"""A noise target is for this percentile of the noise over the counted pixels."""


class PassSums:
    """Running sums of the passes of both halves, and of their difference.

    ``counted`` (H, W) are the pixels whose noise counts.
    """

    def __init__(self, counted: np.ndarray) -> None:
        self.counted = counted
        self.passes = 0
        self._heuristic = Accumulator(MEAN)
        self._reference = Accumulator(DEVIATION)
        self._difference = DifferenceSums(counted)

    def add(self, heuristic: Any, reference: Any) -> None:
        """Add a pass of each half, (H, W, 3)."""
        sums = (self._heuristic, self._reference, self._difference)
        add_difference(sums, (heuristic, reference))
        self.passes += 1

    def noise_percentile(self, distance: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> float:
        """Predict the noise: 95th percentile of ΔE2000 between the reference, and it with noise.

        The noise is that of the difference of the halves, in which shared noise cancels.
        ``distance`` is the leading metric's.
        """
        counted = self.counted
        reference = self._reference.mean(np.float32)
        noise = self._difference.noise(np.float32)
        if not noise[counted].any():
            return 0.0
        distances = []
        for rows in bands(len(counted)):
            truth = reference[rows][counted[rows]].astype(np.float64)
            distances.append(distance(truth + noise[rows][counted[rows]], truth))
        return float(np.percentile(np.concatenate(distances), PERCENTILE))

    def images(self) -> Images:
        """Return the means so far, in single precision, like the files; nothing is marked yet."""
        reference = self._reference
        return Images(
            heuristic=self._heuristic.mean(np.float32),
            reference=reference.mean(np.float32),
            reference_stderr=reference.standard_error(np.float32),
            difference=self._difference.estimate(np.float32),
            maps={},
            significant=np.zeros(self.counted.shape),
            counted=self.counted,
        )


def metrics_for(options: Options) -> Mapping[str, Metric]:
    """Return the metrics, computed by colour-science if the options say so."""
    if not options.colour_science:
        return METRICS
    from fotismos.comparisons.departure import definitions  # loaded late: it takes a second

    return definitions.metrics()
