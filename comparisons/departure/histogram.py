"""How the error is distributed: counts of pixels in logarithmic bins."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from msgspec import Meta
from numpy.typing import ArrayLike

from comparisons.records import Count, Positive, Record

#: The bins' range in decades, log10 of the metric's unit, and the bins in each decade.
DECADES, BINS_A_DECADE = (-2, 3), 12


class Histogram(Record):
    """Counts of pixels in bins of equal ratio.

    Bin i of n holds ``low·(high/low)^(i/n) <= value < low·…^((i+1)/n)``.
    """

    low: Positive
    high: Positive
    counts: tuple[Count, ...]
    below: Annotated[Count, Meta(description="Pixels under `low`, zeros included.")]
    above: Annotated[Count, Meta(description="Pixels at `high` or more.")]


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
