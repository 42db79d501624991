"""Running sums of passes: their mean, its standard error or interval, and how its noise is spread.

Every standard error here comes from the spread of passes, which are independent. Path-traced noise
is skewed: rare paths carry much of the light, and until one arrives a pixel looks darker, with a
smaller error, than it is. The third moment of the passes measures such contributions, and means of
groups of passes show how any number computed from the image scatters.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import hypot
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fotismos.heuristic.convention import Array
from fotismos.reference.records import Interval
from fotismos.reference.student import quantile

GROUPS = 8
"""Groups of passes, at most: seven degrees of freedom for an interval."""

BLOCK = 8
"""Side in pixels of the blocks for sampling and for testing marks."""

BLOCKS = 256
"""Blocks sampled, at most: 16,384 pixels, all of a 128 x 128 image. It bounds memory and time."""

PART = 2**15
"""Doubles that NumPy sums at a time."""

MEAN = ("mean",)
DEVIATION = ("mean", "squares")
NOISE = ("mean", "squares", "signed")
"""What an :class:`Accumulator` can sum."""


@dataclass(frozen=True)
class Grouped:
    """Means of groups of passes at P pixels, in K groups.

    Group k holds passes k, k + 8, … ``means`` (K, P, 3) are doubles, ``sizes`` (K,) counts passes,
    ``places`` (P,) are the pixels in reading order, ``blocks`` (P,) the block of each, from 0 to
    ``sampled - 1``, of ``total`` blocks with a counted pixel.
    """

    means: np.ndarray
    sizes: np.ndarray
    places: np.ndarray
    blocks: np.ndarray
    sampled: int
    total: int

    @classmethod
    def of(
        cls, means: np.ndarray, sizes: np.ndarray, sample: tuple[np.ndarray, np.ndarray, int]
    ) -> "Grouped":
        """Put means of groups, three per pixel, to a sample of pixels as :func:`sample` draws."""
        places, blocks, total = sample
        return cls(
            means=means.reshape(len(sizes), len(places), 3),
            sizes=sizes,
            places=places,
            blocks=blocks,
            sampled=int(blocks.max()) + 1 if len(blocks) else 0,
            total=total,
        )

    def by_block(self, values: np.ndarray) -> np.ndarray:
        """Return the sums (B, ...) over the sampled blocks of values (P, ...) of the pixels."""
        sums = np.zeros((self.sampled, *values.shape[1:]))
        np.add.at(sums, self.blocks, values)
        return sums


@dataclass(frozen=True)
class Estimate:
    """An image from ``passes`` independent passes; arrays are (H, W, 3), linear.

    ``standard_error`` is the sample standard deviation over the root of ``passes``; ``noise`` has
    the distribution of ``mean``'s error: the passes with alternating signs, over their number.
    """

    mean: np.ndarray
    standard_error: np.ndarray
    noise: np.ndarray
    passes: int


@dataclass(frozen=True)
class DifferenceEstimate(Estimate):
    """The mean difference of two halves, and how its noise is distributed.

    ``third`` (H, W, 3) is the third cumulant of ``mean``, without bias from 4 passes on, 0 with
    fewer: negative where single contributions to the reference are large.
    """

    third: np.ndarray
    grouped: Grouped


def without_noise(mean: np.ndarray, counted: np.ndarray, passes: int) -> DifferenceEstimate:
    """Return the estimate of a difference (H, W, 3) that was the same in all passes."""
    none = np.broadcast_to(np.float32(0.0), mean.shape)
    places, _, _ = drawn = sample(counted)
    sizes = _sizes(passes)
    alike = mean.reshape(-1, 3)[places].astype(float)
    return DifferenceEstimate(
        mean=mean,
        standard_error=none,
        noise=none,
        passes=passes,
        third=none,
        grouped=Grouped.of(np.stack([alike] * len(sizes)), sizes=sizes, sample=drawn),
    )


class NumPyDoubles:
    """Doubles of NumPy."""

    def doubles(self, image: Any) -> Array:
        """Return the values of an image (H, W, 3), (3 H W,)."""
        return np.asarray(image, np.float64).ravel()

    def zeros(self, size: int) -> Array:
        """Return zeros (size,)."""
        return np.zeros(size)

    def parts(
        self, value: Array, sums: dict[str, Array]
    ) -> Iterator[tuple[Array, dict[str, Array]]]:
        """Yield parts of values and of their sums, small enough for the processor's cache."""
        for start in range(0, len(value), PART):
            part = slice(start, start + PART)
            yield value[part], {name: total[part] for name, total in sums.items()}

    def number(self, value: int) -> Any:
        """Return a number as a factor of doubles."""
        return float(value)

    def index(self, places: np.ndarray) -> Any:
        """Return places (P,) in an image as an index of its doubles."""
        return places

    def gather(self, values: Array, index: Any) -> np.ndarray:
        """Return the doubles (P,) at an index."""
        kept: np.ndarray = values[index]
        return kept

    def evaluate(self, sums: dict[str, Array]) -> None:
        """Compute sums that are not yet."""


class DrJitDoubles(NumPyDoubles):
    """Doubles of Dr.Jit: for passes that it rendered, NumPy would take as long as the rendering."""

    def __init__(self) -> None:
        import drjit as dr  # loaded late: sums of pictures need neither
        import mitsuba as mi

        self._dr = dr
        self._mi = mi

    def doubles(self, image: Any) -> Array:
        tensor = image if self._dr.is_tensor_v(image) else self._mi.TensorXd(image)
        return self._mi.Float64(tensor.array)

    def zeros(self, size: int) -> Array:
        return self._dr.zeros(self._mi.Float64, size)

    def parts(
        self, value: Array, sums: dict[str, Array]
    ) -> Iterator[tuple[Array, dict[str, Array]]]:
        yield value, sums

    def number(self, value: int) -> Any:
        # An input of the kernel, so that all passes share one.
        return self._dr.opaque(self._mi.Float64, value)

    def index(self, places: np.ndarray) -> Any:
        return self._mi.UInt32(places.astype(np.uint32))

    def gather(self, values: Array, index: Any) -> np.ndarray:
        return np.array(self._dr.gather(self._mi.Float64, values, index))

    def evaluate(self, sums: dict[str, Array]) -> None:
        self._dr.eval(sums)


class Accumulator:
    """Running sums of passes, for an :class:`Estimate`; or fewer, for a mean and its error.

    The first pass decides who computes: NumPy if it is made of NumPy's arrays, else Dr.Jit.
    """

    def __init__(self, moments: Sequence[str] = NOISE) -> None:
        self.count = 0
        self._moments = tuple(moments)
        self._shape = ()
        self._sums: dict[str, Array] = {}
        self._by = NumPyDoubles()

    def add(self, image: Any, less: Any = None) -> None:
        """Add a pass: a tensor or array (H, W, 3), less another one if given."""
        given = (image,) if less is None else (image, less)
        if self.count == 0 and not all(isinstance(each, np.ndarray) for each in given):
            self._by = DrJitDoubles()
        value = self._by.doubles(image)
        if less is not None:
            value = value - self._by.doubles(less)
        if self.count == 0:
            self._shape = tuple(image.shape)
            self._sums = {name: self._by.zeros(len(value)) for name in self._moments}
        self.count += 1
        self._add(value)
        self._by.evaluate(self._sums)

    def _add(self, value: Array) -> None:
        for part, sums in self._by.parts(value, self._sums):
            self._add_part(part, sums)

    def _add_part(self, value: Array, sums: dict[str, Array]) -> None:
        count = self.count
        step = value - sums["mean"]
        share = step / self._by.number(count)
        if "cubes" in sums:
            # The update of a third central moment by one value (Pébay 2008, equation 2.8) takes the
            # old mean and squares.
            cubic = self._by.number((count - 1) * (count - 2))
            sums["cubes"] += share * (share * step * cubic - 3 * sums["squares"])
        sums["mean"] += share
        if "squares" in sums:
            # Welford's update takes the step from the old mean and from the new one.
            sums["squares"] += step * (value - sums["mean"])
        if "signed" in sums:
            sums["signed"] += value * self._by.number(1 if count % 2 else -1)

    def _array(self, name: str) -> np.ndarray:
        return np.array(self._sums[name]).reshape(self._shape)

    def mean(self, dtype: type = float) -> np.ndarray:
        """Return the mean of the passes so far."""
        return self._array("mean").astype(dtype, copy=False)

    def standard_error(self, dtype: type = float) -> np.ndarray:
        """Return the standard error of the mean."""
        squares = self._array("squares")
        squares /= max(self.count - 1, 1) * self.count
        deviation: np.ndarray = np.sqrt(squares, out=squares).astype(dtype, copy=False)
        return deviation

    def noise(self, dtype: type = float) -> np.ndarray:
        """Return the noise image of :class:`Estimate`; the number of passes should be even."""
        return (self._array("signed") / self.count).astype(dtype, copy=False)

    def estimate(self, dtype: type = float) -> Estimate:
        """Return the estimate so far; the number of passes should be even and at least 2."""
        return Estimate(
            mean=self.mean(dtype),
            standard_error=self.standard_error(dtype),
            noise=self.noise(dtype),
            passes=self.count,
        )


class DifferenceSums(Accumulator):
    """Running sums of the passes of a difference, for a :class:`DifferenceEstimate`.

    ``counted`` (H, W) are the pixels from which blocks are sampled.
    """

    def __init__(self, counted: np.ndarray) -> None:
        super().__init__((*NOISE, "cubes"))
        self._sample = sample(counted)
        # Places of the sampled channels in the flat image, (P, 3).
        self._places = (3 * self._sample[0][:, None] + np.arange(3)).ravel()
        self._index: Any = None
        self._groups = np.zeros((GROUPS, self._places.size))

    def _add(self, value: Array) -> None:
        if self._places.size:
            if self._index is None:
                self._index = self._by.index(self._places)
            self._groups[(self.count - 1) % GROUPS] += self._by.gather(value, self._index)
        super()._add(value)

    def estimate(self, dtype: type = float) -> DifferenceEstimate:
        """Return the estimate so far, like the base; the third cumulant in doubles."""
        third = self._array("cubes")
        n = self.count
        # κ3 of a pass is n Σ/((n − 1)(n − 2)) without bias, and of the mean 1/n² of it.
        third *= 1.0 / (n * (n - 1) * (n - 2)) if n >= 4 else 0.0
        sizes = _sizes(self.count)
        means = self._groups[: len(sizes)] / sizes[:, None]
        grouped = Grouped.of(means, sizes=sizes, sample=self._sample)
        plain = super().estimate(dtype)
        return DifferenceEstimate(**vars(plain), third=third, grouped=grouped)


def _sizes(passes: int) -> np.ndarray:
    """Return how many passes are in each group; with few there are fewer groups."""
    sizes = np.bincount(np.arange(passes) % GROUPS, minlength=GROUPS)
    return sizes[sizes > 0]


def block_numbers(counted: np.ndarray) -> np.ndarray:
    """Return the number of the block of each counted pixel, (N,), in reading order."""
    rows, columns = np.nonzero(counted)
    across = -(-counted.shape[1] // BLOCK)
    numbers: np.ndarray = rows // BLOCK * across + columns // BLOCK
    return numbers


def sample(counted: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
    """Draw blocks that hold counted pixels; always the same for the same image.

    It returns places, blocks and total as in :class:`Grouped`.
    """
    blocks = block_numbers(counted)
    numbers = np.unique(blocks)
    # A random draw, not every n-th block: a stride could align with the image.
    chosen = np.random.default_rng(0).permutation(len(numbers))[:BLOCKS]
    chosen = numbers[np.sort(chosen)]
    inside = np.isin(blocks, chosen)
    places = np.flatnonzero(counted)[inside]
    return places, np.searchsorted(chosen, blocks[inside]), len(numbers)


def add_difference(sums: Sequence[Accumulator], images: Any) -> None:
    """Add the images of both halves, and their difference, to three sums."""
    heuristic, reference = images
    sums[0].add(heuristic)
    sums[1].add(reference)
    sums[2].add(heuristic, reference)


LEVEL = 0.95


def jackknife_error(left_out: ArrayLike) -> NDArray[np.float64]:
    """Return the standard error of a statistic from its values (n, ...), each without one repeat.

    It holds for nonlinear statistics too, whose values for single, noisier repeats would not
    average to their value for the mean.
    """
    left_out = np.asarray(left_out, float)
    error: NDArray[np.float64] = np.sqrt((len(left_out) - 1) * left_out.var(axis=0))
    return error


def student(value: float, error: float, count: int, bias: float = 0.0) -> Interval:
    """Return the interval around a value whose standard error comes from ``count`` repeats.

    ``bias`` is an error that all repeats share, which widens it: ``half = hypot(t error, bias)``.
    """
    half = hypot(quantile(count - 1, 0.5 + LEVEL / 2) * error, bias)
    return Interval(value=value, low=value - half, high=value + half)


def jackknifed(values: ArrayLike, bias: float = 0.0) -> Interval:
    """Return the first of values (1 + n), with an interval from the others.

    The first is of all repeats, each other one leaves out one of them. ``bias`` is what all share.
    A statistic that is not linear has a bias of its own, which shrinks with the repeats: by
    Quenouille's estimate ``(n - 1) (mean of the others - first)``, which widens the interval.
    """
    value, *others = np.asarray(values, float)
    count = len(others)
    own = (count - 1) * (float(np.mean(others)) - float(value))
    error = float(jackknife_error(others))
    return student(float(value), error, count=count, bias=hypot(bias, own))
