"""Running sums of passes: their mean, its standard error, and its noise.

Every standard error here comes from the spread of passes, which are independent.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import prod
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from heuristic.arrays import Array

POWERS = {"signed": 1, "squares": 2, "cubes": 3}
ROOTS = {1: lambda value: value, 2: dr.sqrt, 3: dr.cbrt}

PART = 2**20
"""Values of a sum updated at a time: Dr.Jit's memory comes in powers of two."""


@dataclass(frozen=True)
class Estimate:
    """An image from ``passes`` independent passes; arrays are (H, W, 3), linear.

    Attributes
    ----------
    mean
        Mean of the passes.
    standard_error
        Standard error of ``mean``: the sample standard deviation over the root of ``passes``.
    noise
        An image with the distribution of ``mean``'s error: the sum of the passes with alternating
        signs, divided by their number.
    """

    mean: np.ndarray
    standard_error: np.ndarray
    noise: np.ndarray
    passes: int


class Mean:
    """The running mean of passes.

    Kept as Dr.Jit arrays of double precision, because NumPy would take as long as the rendering; in
    parts of :data:`PART` values, so updates take almost no extra memory.

    Parameters
    ----------
    compact
        Whether all sums except the mean are kept in single precision, as roots of their power,
        which gives them the images' range. Each pass adds less than 2e-7 of a sum to its error.
    """

    SUMS: tuple[str, ...] = ("mean",)

    def __init__(self, compact: bool = False):
        self.count = 0
        self._compact = compact
        self._shape = ()
        self._parts: list[dict[str, Array]] = []

    def add(self, image: Any, less: Any = None) -> None:
        """Add a pass: a tensor (H, W, 3), less another one if given."""
        flat = flattened(image, less)
        if self.count == 0:
            self._shape = tuple(image.shape)
            self._parts = [
                {name: self._packed(name, dr.zeros(mi.Float64, len(part))) for name in self.SUMS}
                for part in self._ranges()
            ]
        self.count += 1
        for number, (part, kept) in enumerate(zip(self._ranges(), self._parts, strict=True)):
            places = dr.arange(mi.UInt32, len(part)) + dr.opaque(mi.UInt32, part.start)
            sums = self._sums(number, len(part))
            self._step(sums, values(flat, places))
            kept.update((name, self._packed(name, sums[name])) for name in self.SUMS)
            del sums
            dr.eval(kept)

    def mean(self, dtype: type = float, last: bool = False) -> np.ndarray:
        """Return the mean of the passes so far, as :meth:`Accumulator.estimate` does."""
        return self._array("mean", dtype, last)

    def part(self, name: str, number: int) -> Array:
        """Return a part of a sum."""
        return self._unpacked(name, self._parts[number][name])

    def state(self) -> dict[str, Callable[..., np.ndarray]]:
        """Return functions that make the array of each sum, for :meth:`restore`."""
        sums = {name: partial(self._array, name) for name in self.SUMS}
        return {"count": lambda: np.array(self.count)} | sums

    def shapes(self, size: tuple[int, int]) -> dict[str, tuple[int, ...]]:
        """Return the shapes of the arrays of a :meth:`state`, of images (H, W)."""
        return {"count": ()} | dict.fromkeys(self.SUMS, (*size, 3))

    def restore(self, state: dict[str, Any]) -> None:
        """Resume from the arrays of another :meth:`state`, which are removed from it."""
        self.count = int(state["count"])
        self._shape = state[self.SUMS[0]].shape
        self._parts = [{} for _ in self._ranges()]
        for name in self.SUMS:
            flat = state.pop(name).reshape(-1)
            for part, kept in zip(self._ranges(), self._parts, strict=True):
                kept[name] = self._packed(name, mi.Float64(flat[part.start : part.stop]))
            dr.eval(self._parts)

    def _step(self, sums, image):
        sums["mean"] += (image - sums["mean"]) / dr.opaque(mi.Float64, self.count)

    def _sums(self, number, size):
        """Return the sums of a part of ``size`` values, in doubles."""
        return {name: self.part(name, number) for name in self.SUMS}

    def _packed(self, name, total):
        power = POWERS.get(name)
        if not self._compact or power is None:
            return total
        return mi.Float32(dr.mulsign(ROOTS[power](dr.abs(total)), total))

    def _unpacked(self, name, kept):
        power = POWERS.get(name)
        if not self._compact or power is None:
            return kept
        root = mi.Float64(kept)
        return root if power == 1 else root * root * (root if power == 3 else 1.0)

    def _ranges(self):
        size = prod(self._shape)
        return [range(start, min(start + PART, size)) for start in range(0, size, PART)]

    def _array(self, name, dtype=float, last=False):
        """Return a sum as an array; ``last`` frees its memory."""
        found = np.empty(prod(self._shape), dtype)
        for part, kept in zip(self._ranges(), self._parts, strict=True):
            total = self._unpacked(name, kept.pop(name) if last else kept[name])
            found[part.start : part.stop] = np.array(total)
        if last:
            dr.flush_malloc_cache()
        return found.reshape(self._shape)


class Deviations(Mean):
    """The running mean and spread of passes."""

    SUMS: tuple[str, ...] = ("mean", "squares")

    def standard_error(self, dtype: type = float, last: bool = False) -> np.ndarray:
        """Return the standard error of the mean, as :meth:`Accumulator.estimate` does."""
        error = self._array("squares", float, last)
        error /= max(self.count - 1, 1) * self.count
        np.sqrt(error, out=error)
        return error.astype(dtype, copy=False)

    def _step(self, sums, image):
        step = image - sums["mean"]
        super()._step(sums, image)
        sums["squares"] += step * (image - sums["mean"])


class Accumulator(Deviations):
    """Running sums of passes, for an :class:`Estimate`."""

    SUMS: tuple[str, ...] = (*Deviations.SUMS, "signed")

    def _step(self, sums, image):
        super()._step(sums, image)
        # Rounded like the sum, so equal passes cancel.
        image = mi.Float64(mi.Float32(image)) if self._compact else image
        sums["signed"] += image * dr.opaque(mi.Float64, 1 if self.count % 2 else -1)

    def noise(self, dtype: type = float, last: bool = False) -> np.ndarray:
        """Return the noise image of :class:`Estimate`; the number of passes should be even."""
        noise = self._array("signed", dtype, last)
        noise /= self.count
        return noise

    def estimate(self, dtype: type = float, last: bool = False) -> Estimate:
        """Return the estimate so far; the number of passes should be even and at least 2.

        Parameters
        ----------
        dtype
            Type of the arrays.
        last
            Whether the sums are no longer needed: each is freed as soon as its array is made.
        """
        noise, error = self.noise(dtype, last), self.standard_error(dtype, last)
        return Estimate(self.mean(dtype, last), error, noise, self.count)


def flattened(image: Any, less: Any = None) -> Any:
    """Return the values of one tensor or array (H, W, 3) or two as Dr.Jit arrays."""
    given = [one for one in (image, less) if one is not None]
    return [(one if dr.is_tensor_v(one) else mi.TensorXd(one)).array for one in given]


def values(images: Any, places: Array) -> Array:
    """Return some values of the first flat image in doubles, less those of a second one."""
    found = [mi.Float64(dr.gather(type(image), image, places)) for image in images]
    return found[0] - found[1] if len(found) == 2 else found[0]


def add_difference(sums: Any, images: Any) -> None:
    """Add the images of both halves, and their difference, to three sums."""
    heuristic, reference = images
    # First, since it may use the means of earlier passes.
    sums[2].add(heuristic, reference)
    sums[0].add(heuristic)
    sums[1].add(reference)
