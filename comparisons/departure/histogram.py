"""How the error is distributed: counts of pixels in logarithmic bins."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import ArrayLike

#: The bins' range in decades, log10 of the metric's unit, and the bins in each decade.
DECADES, BINS_A_DECADE = (-2, 3), 12


@dataclass(frozen=True)
class Histogram:
    """Counts of pixels in bins of equal ratio.

    low, high
        Range of the bins; bin i of n holds ``low·(high/low)^(i/n) <= value < low·…^((i+1)/n)``.
    counts
        Pixels in each bin, from low to high.
    below, above
        Pixels under `low`, zeros included, and those at `high` or more.
    """

    low: float
    high: float
    counts: tuple[int, ...]
    below: int
    above: int

    def data(self) -> dict:
        """The histogram as in ``comparison.json``."""
        return asdict(self) | {"counts": list(self.counts)}


def histogram(values: ArrayLike) -> Histogram:
    """The histogram of values ≥ 0, of any shape."""
    values = np.asarray(values, np.float64).ravel()
    first, last = DECADES
    edges = np.logspace(first, last, (last - first) * BINS_A_DECADE + 1)
    place = np.searchsorted(edges, values, side="right")
    counts = np.bincount(place, minlength=len(edges) + 1)
    return Histogram(
        low=float(edges[0]),
        high=float(edges[-1]),
        counts=tuple(int(count) for count in counts[1:-1]),
        below=int(counts[0]),
        above=int(counts[-1]),
    )
