"""Sums of the passes of a difference, to measure how far its noise is from a normal distribution.

Path-traced noise is skewed: rare paths carry much of the light, and until one arrives a pixel looks
darker, with a smaller error, than it is. The third moment of the passes measures such
contributions, and means of groups of passes show how any number computed from the image scatters.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from reference.rendering.sums import Accumulator, Estimate, Mean, flattened, values

GROUPS = 8
"""Groups of passes, at most: seven degrees of freedom for an interval."""

BLOCK = 8
"""Side in pixels of the blocks for sampling and for testing marks."""

BLOCKS = 256
"""Blocks sampled, at most: 16,384 pixels, all of a 128 x 128 image. It bounds memory and time."""


@dataclass(frozen=True)
class Grouped:
    """Means of groups of passes at some pixels.

    Attributes
    ----------
    means
        (K, P, 3): the mean of each group, in doubles. Group k holds passes k, k + 8, k + 16, …
    sizes
        (K,): passes of each group.
    places
        (P,): the pixels, counted in reading order.
    blocks
        (P,): the block of each pixel, numbered from 0 to ``sampled - 1``.
    sampled, total
        Blocks that were sampled, and blocks with a counted pixel.
    """

    means: np.ndarray
    sizes: np.ndarray
    places: np.ndarray
    blocks: np.ndarray
    sampled: int
    total: int

    def by_block(self, values: np.ndarray) -> np.ndarray:
        """Return the sums (B, ...) over the sampled blocks of values (P, ...) of the pixels."""
        sums = np.zeros((self.sampled, *values.shape[1:]))
        np.add.at(sums, self.blocks, values)
        return sums


@dataclass(frozen=True)
class DifferenceEstimate(Estimate):
    """The mean difference of two halves, and how its noise is distributed.

    Attributes
    ----------
    third
        (H, W, 3): third cumulant of ``mean``, without bias from 4 passes on; 0 with fewer.
        Negative where single contributions to the reference are large.
    grouped
        Means of groups of passes at a sample of pixels.
    """

    third: np.ndarray
    grouped: Grouped


class DifferenceSums(Accumulator):
    """Running sums of the passes of a difference, for a :class:`DifferenceEstimate`.

    Parameters
    ----------
    counted
        (H, W): the pixels from which blocks are sampled.
    compact
        See :class:`reference.rendering.sums.Mean`.
    """

    SUMS: tuple[str, ...] = (*Accumulator.SUMS, "cubes")

    def __init__(self, counted: np.ndarray, compact: bool = False):
        super().__init__(compact)
        self._sample = sample(counted)
        flat = 3 * self._sample[0][:, None] + np.arange(3)
        self._index = mi.UInt32(flat.ravel().astype(np.uint32))
        self._groups = np.zeros((GROUPS, flat.size))

    def add(self, image: Any, less: Any = None) -> None:
        """Add a pass: a tensor (H, W, 3), less another one if given."""
        super().add(image, less)
        if self._index.shape[0]:
            found = values(flattened(image, less), self._index)
            self._groups[(self.count - 1) % GROUPS] += np.array(found)

    def _step(self, sums, image):
        count, step = self.count, image - sums["mean"]
        share = step / dr.opaque(mi.Float64, count)
        # The update of a third central moment by one value (Pébay 2008, equation 2.8) takes the old
        # mean and squares.
        cubic = dr.opaque(mi.Float64, (count - 1) * (count - 2))
        sums["cubes"] += share * (share * step * cubic - 3 * sums["squares"])
        super()._step(sums, image)

    def state(self) -> dict[str, Callable[..., np.ndarray]]:
        """Return functions that make the array of each sum, for :meth:`restore`."""
        return super().state() | {"groups": self._groups.copy}

    def shapes(self, size: tuple[int, int]) -> dict[str, tuple[int, ...]]:
        """Return the shapes of the arrays of a :meth:`state`, of images (H, W)."""
        return super().shapes(size) | {"groups": self._groups.shape}

    def restore(self, state: dict[str, Any]) -> None:
        """Resume from the arrays of another :meth:`state`, which are removed from it."""
        super().restore(state)
        self._groups = np.array(state["groups"])

    def estimate(self, dtype: type = float, last: bool = False) -> DifferenceEstimate:
        """Return the estimate so far, like the base; the third cumulant in doubles."""
        third, n = self._array("cubes", float, last), self.count
        # κ3 of a pass is n Σ/((n − 1)(n − 2)) without bias, and of the mean 1/n² of it.
        third *= 1.0 / (n * (n - 1) * (n - 2)) if n >= 4 else 0.0
        plain = super().estimate(dtype, last)
        return DifferenceEstimate(**vars(plain), third=third, grouped=self._grouped())

    def _grouped(self):
        sizes = np.bincount(np.arange(self.count) % GROUPS, minlength=GROUPS)
        sizes = sizes[sizes > 0]
        means = self._groups[: len(sizes)] / sizes[:, None]
        places, blocks, total = self._sample
        shape = (len(sizes), len(places), 3)
        sampled = int(blocks.max()) + 1 if len(blocks) else 0
        return Grouped(means.reshape(shape), sizes, places, blocks, sampled, total)


class SumsOfHalves(DifferenceSums):
    """Running sums of a difference; its mean is the difference of the halves' means.

    Add each pass here before adding it to those.

    Parameters
    ----------
    counted, compact
        See :class:`DifferenceSums`.
    halves
        The :class:`Mean` of each half.
    """

    SUMS = tuple(name for name in DifferenceSums.SUMS if name != "mean")

    def __init__(self, counted: np.ndarray, halves: tuple[Mean, Mean], compact: bool = False):
        super().__init__(counted, compact)
        self._halves = halves

    def mean(self, dtype: type = float, last: bool = False) -> np.ndarray:
        """Return the mean of the passes so far; with ``last`` too, the halves keep theirs."""
        test, reference = self._halves
        found = test.mean()
        found -= reference.mean()
        return found.astype(dtype, copy=False)

    def _sums(self, number, size):
        if not self._halves[0].count:
            mean = dr.zeros(mi.Float64, size)
        else:
            test, reference = (half.part("mean", number) for half in self._halves)
            mean = test - reference
        return super()._sums(number, size) | {"mean": mean}


def block_numbers(counted: np.ndarray) -> np.ndarray:
    """Return the number of the block of each counted pixel, (N,), in reading order."""
    rows, columns = np.nonzero(counted)
    across = -(-counted.shape[1] // BLOCK)
    return rows // BLOCK * across + columns // BLOCK


def sample(counted: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
    """Draw blocks that hold counted pixels; always the same for the same image.

    Returns
    -------
    places, blocks, total
        Pixels in reading order and the block of each, as in :class:`Grouped`.
    """
    own = block_numbers(counted)
    numbers = np.unique(own)
    # A random draw, not every n-th block: a stride could align with the image.
    chosen = np.random.default_rng(0).permutation(len(numbers))[:BLOCKS]
    chosen = numbers[np.sort(chosen)]
    inside = np.isin(own, chosen)
    places = np.flatnonzero(counted)[inside]
    return places, np.searchsorted(chosen, own[inside]), len(numbers)
