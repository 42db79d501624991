"""What moved between two runs of a picture: means of its parts, and single pixels.

A run is a number of pictures of one thing (passes or repeats), each with its own random numbers.
Compared are m before with n after. With the differences d of the pixels' means, tested is their
mean over each part of N pixels (the picture, a block, a shape), in each channel::

    t = Σ d / √(r max(P, Q))
    P = (1/m + 1/n) Σ s²      s² the pooled variance of a pixel over both runs
    Q = Σ (d − Σ d / N)²
    r = the mean over tiles of (variance of the tile's sum / sum of its pixels' variances), ≥ 1

P pools all pixels of a part, so that two repeats are enough. P can be too small by chance: where
noise has few values (edges in a PNG, fireflies cut off at 1), or is skewed and m ≠ n. Then Q, the
spread of the differences themselves, is larger. If nothing changed and m = n, each d is symmetric
about 0, and the tails of ``Σ d / √Σ d²`` are no heavier than a normal variable's, however the noise
is distributed (Efron, J. Am. Stat. Assoc. 64, 1969): a firefly raises both sums. It also means
that a change of fewer than about 30 pixels in a part counts as fireflies.

r is 1 for independent pixels; a reconstruction filter, which correlates neighbours, raises it.
Noise that is correlated over a part of a tile is correlated with a part of the next one: r falls
short by a share that is half as large in tiles of twice the side. If r is likely larger there
(:data:`LIKELY`), ``2 r(2 tiles) - r(tile)`` counts; if it is surely larger (:data:`SURE`), noise
is taken to reach along the whole picture, as in stripes. A pattern that tiles repeat shows in the
sums over the same pixel of all tiles, and multiplies r. Longer patterns are not noticed. With f
degrees of freedom of r, t has ``1 / (1/f + r/N)``.

If no pixel varies at all, any change beyond rounding is a drift. Several partitions share one level
by Šidák's correction, :func:`level_of_each`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import ceil
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fotismos.comparisons.departure.blocks import block_sums, ratio
from fotismos.comparisons.departure.colour import Array
from fotismos.heuristic.errors import InputError

SIDE = 16
TILES = 8
"""Side in pixels of blocks; tiles of whole blocks along the longer side of the picture, at most."""

LIKELY = 0.97
SURE = 0.995
"""Chances with which independent tiles have a smaller variance of their sums: beyond the first,
noise is taken to reach a little further than a tile, beyond the second much further."""

POWER = 0.95
QUANTILE = 1.645
"""The chance with which the smallest visible change is caught, and its quantile."""

LINEAR_ROUNDING = 1e-6
RELATIVE_ROUNDING = 1e-5
"""The difference that rounding can make in a colour, and as a share of it."""


@dataclass(frozen=True)
class Run:
    """Pictures of one thing: how many, mean and variance of each pixel, correlation r of its noise.

    Images are linear, (H, W, 3); r is (3,).
    """

    count: int
    mean: Array
    variance: Array
    correlation: Array

    @classmethod
    def of(cls, images: Iterable[ArrayLike]) -> Run:
        """Return the statistics of images (H, W, 3) of one size, in one pass over them."""
        mean: Array = np.zeros((0, 0, 3))
        squares: Array = np.zeros(())
        known = set()
        sums: dict[str, list[Array]] = {name: [] for name in SUMS}
        count = 0
        for count, image in enumerate(images, start=1):
            values = np.asarray(image, np.float64)
            if count > 1 and values.shape != mean.shape:
                raise InputError(
                    f"pictures of {values.shape[1]} x {values.shape[0]} and {mean.shape[1]} x"
                    f" {mean.shape[0]} pixels cannot be compared: give all in one size."
                )
            # Welford's update takes the step from the old mean and from the new one.
            step = values - (mean if count > 1 else 0.0)
            mean = values - step * (1.0 - 1.0 / count)
            squares = squares + step * (values - mean)
            for name, of_pictures in sums.items():
                of_pictures.append(SUMS[name](values))
            known.add(hash(values.tobytes()))
        # Two of one seed would hide noise; all may be equal, where a picture has none.
        if 1 < len(known) < count:
            raise InputError("some repeats are equal: give each its own seed.")
        variance = squares / max(count - 1, 1)
        return cls(
            count=count,
            mean=mean,
            variance=variance,
            correlation=_correlation(sums, variance, count),
        )


@dataclass(frozen=True)
class Drift:
    """Means over N parts (N, 3) before and now, and the difference's uncertainty.

    ``error`` is its standard error, with so many degrees of ``freedom``.
    """

    before: Array
    after: Array
    error: Array
    freedom: Array

    @property
    def rounding(self) -> Array:
        """The difference that rounding can make."""
        size = np.maximum(np.abs(self.before), np.abs(self.after))
        return np.maximum(LINEAR_ROUNDING, RELATIVE_ROUNDING * size)

    def p(self) -> Array:
        """Return the chance of a difference at least as large if nothing changed."""
        from scipy.special import stdtr  # loaded late: half a second

        size = np.abs(self.after - self.before)
        with np.errstate(divide="ignore", invalid="ignore"):  # no noise
            p = 2.0 * stdtr(self.freedom, -size / self.error)
        return np.where(size <= self.rounding, 1.0, p)

    def corrected(self) -> Array:
        """Return the chance of one as small among as many independent tests (Šidák)."""
        return sidak(self.p(), self.before.size)

    def moved(self, level: float) -> NDArray[np.bool_]:
        """Return which means moved, at a level over all of them."""
        return ~(self.corrected() >= level)  # a NaN does not pass

    def limit(self, level: float) -> Array:
        """Return the smallest change of each mean that is caught with the chance `POWER`.

        With the critical value c and ν degrees of freedom, the change is this many errors (Johnson
        and Welch 1940): ``c (1 − 1/4ν) + z √(1 + c²/2ν)``.
        """
        from scipy.special import stdtrit

        c = -stdtrit(self.freedom, level_of_each(level, self.before.size) / 2.0)
        errors = c * (1.0 - 0.25 / self.freedom)
        errors += QUANTILE * np.sqrt(1.0 + c**2 / (2.0 * self.freedom))
        return np.asarray(np.maximum(errors * self.error, self.rounding))


def drift(before: Run, after: Run, parts: NDArray[Any]) -> Drift:
    """Return the means over parts; ``parts`` (H, W) numbers them from 0, -1 is in none.

    ``before`` has at least two pictures; ``after`` may be one, whose noise is taken for equal.
    """
    first, second = _weights(before, after)
    d = after.mean - before.mean
    noise = noise_of_difference(before, after)
    r = np.maximum(first * before.correlation + second * after.correlation, 1.0)
    free = before.count + after.count - 2
    # The channels' noise may be one.
    f = np.maximum(_total(_tiles(noise) > 0) * free / 3.0, 1.0)
    inside = parts >= 0
    numbers = parts[inside].astype(np.int64)
    count = int(numbers.max(initial=-1)) + 1

    def over(image: Array) -> Array:
        channels = [np.bincount(numbers, image[inside][:, c], count) for c in range(3)]
        return np.stack(channels, axis=-1)

    pixels = np.maximum(over(np.ones_like(d)), 1.0)
    # Q; it counts only if some pixel varies, else a change would hide in its own spread.
    spread = np.maximum(over(d * d) - over(d) ** 2 / pixels, 0.0)
    square = r * np.maximum(over(noise), spread * noise.any(axis=(0, 1, 2)))
    return Drift(
        before=over(before.mean) / pixels,
        after=over(after.mean) / pixels,
        error=np.sqrt(square) / pixels,
        freedom=1.0 / (1.0 / f + r / pixels),
    )


def in_blocks(shape: tuple[int, ...], side: int = SIDE) -> NDArray[np.int64]:
    """Return the number of the block of each pixel of an image (H, W), in reading order."""
    rows, columns = np.indices(shape[:2]) // side
    return np.asarray(rows * (int(columns.max()) + 1) + columns)


def pixels_moved(before: Run, after: Run, level: float) -> NDArray[np.bool_]:
    """Return which pixels (H, W) moved in any channel; ``level`` is the share of false ones.

    Welch's t would need many pictures; the variance of a pixel is pooled over its block, and never
    less than its own (Benjamini and Hochberg 1995 choose the pixels).
    """
    from scipy.special import stdtr

    noise = noise_of_difference(before, after)
    blocks = in_blocks(noise.shape)
    pooled = np.stack(
        [
            (np.bincount(blocks.ravel(), noise[..., c].ravel()) / np.bincount(blocks.ravel()))[
                blocks
            ]
            for c in range(3)
        ],
        axis=-1,
    )
    error = np.sqrt(np.maximum(pooled, noise))
    size = np.abs(after.mean - before.mean)
    free = before.count + after.count - 2
    with np.errstate(divide="ignore", invalid="ignore"):  # no noise
        chances = 6.0 * stdtr(free, -size / error).min(axis=-1)
    largest = np.maximum(np.abs(before.mean), np.abs(after.mean))
    is_rounding = size <= np.maximum(LINEAR_ROUNDING, RELATIVE_ROUNDING * largest)
    chances = np.where(is_rounding.all(axis=-1), 1.0, np.nan_to_num(chances))
    return np.asarray(chances <= discoveries(chances.ravel(), level))


def discoveries(chances: Array, rate: float) -> float:
    """Return the largest chance that counts as a discovery (Benjamini and Hochberg); −1 if none."""
    # The largest `p(i) <= rate i / n`; all smaller chances are discoveries with it.
    ordered = np.sort(chances)
    passed = ordered <= rate * np.arange(1, len(ordered) + 1) / max(len(ordered), 1)
    return float(ordered[passed][-1]) if passed.any() else -1.0


def sidak(p: ArrayLike, tests: int) -> NDArray[np.float64]:
    """Return the chance of a p-value as small as `p` among this many independent tests."""
    # `1 − (1 − p)^n`, in a form that keeps its digits for small p.
    with np.errstate(divide="ignore"):  # p = 1
        chances: NDArray[np.float64] = -np.expm1(tests * np.log1p(-np.asarray(p, float)))
        return chances


def level_of_each(level: float, checks: int) -> float:
    """Return the level of each of several checks, so that together they have `level`."""
    return float(-np.expm1(np.log1p(-level) / checks))


def noise_of_difference(before: Run, after: Run) -> Array:
    """Return the variance of the difference of both means, at each pixel."""
    first, second = _weights(before, after)
    pooled: Array = first * before.variance + second * after.variance
    return (1.0 / before.count + 1.0 / after.count) * pooled


def _weights(before: Run, after: Run) -> tuple[float, float]:
    """Return the weights of both variances, by degrees of freedom: a single picture has none."""
    free = before.count + after.count - 2
    return (before.count - 1) / free, (after.count - 1) / free


def _correlation(sums: Mapping[str, Sequence[Array]], variance: Array, count: int) -> Array:
    """Return r (3,) from each picture's sums over tiles, and the pixels' variance (H, W, 3).

    ``sums`` are over tiles, over tiles of twice the side, and over the same pixel of all tiles.
    """
    from scipy.special import chdtri  # loaded late: half a second

    found = {}
    chance = {}
    for name, of_repeats in sums.items():
        alone = SUMS[name](variance)
        r = ratio(np.var(of_repeats, axis=0) * count / max(count - 1, 1), alone)
        # The channels' noise may be one.
        tested = _total(alone > 0)
        freedom = np.maximum(tested / 3.0 * (count - 1), 1.0)
        found[name] = ratio(_total(r), tested)
        chance[name] = freedom
    correlation = found["tiles"]
    twice = found["twice"]
    freedom = chance["twice"]
    grown = twice / np.maximum(correlation, 1e-30)
    # Noise that reaches beyond a tile: as in an endless picture, or else as along a stripe of it.
    beyond = np.where(grown > chdtri(freedom, 1.0 - LIKELY) / freedom, 2.0 * twice - correlation, 0)
    stripes = max(variance.shape[:2]) / _side(variance, 2)
    is_sure = grown > chdtri(freedom, 1.0 - SURE) / freedom
    correlation = np.maximum(correlation, np.where(is_sure, stripes * twice, beyond))
    # A pattern that every tile repeats: its sum grows with the number of tiles.
    freedom = chance["folded"]
    repeats = found["folded"] > chdtri(freedom, 1.0 - SURE) / freedom
    return np.where(repeats, correlation * found["folded"], correlation)


def _folded(image: Array) -> Array:
    """Return sums (side, side, ...) over the same pixel of all whole tiles."""
    height, width, *channels = image.shape
    side = min(_side(image), height, width)
    rows = height // side
    columns = width // side
    whole = image[: rows * side, : columns * side]
    tiles = whole.reshape([rows, side, columns, side, *channels])
    folded: Array = tiles.sum(axis=(0, 2))
    return folded


def _side(image: Array, scale: int = 1) -> int:
    """Return the side of tiles in pixels; ``scale`` is a factor on it."""
    return scale * SIDE * ceil(int(max(image.shape[:2])) / TILES / SIDE)


def _tiles(image: Array, scale: int = 1) -> Array:
    """Return sums over whole tiles (rows, columns, ...); of a smaller picture, over itself."""
    # Tiles are whole blocks; a rest at the right and at the bottom is left out.
    side = _side(image, scale)
    height = max(image.shape[0] // side * side, side)
    width = max(image.shape[1] // side * side, side)
    return block_sums(image[:height, :width], side)


def _total(values: np.ndarray) -> Array:
    total: NDArray[np.float64] = values.sum(axis=(0, 1, 2))
    return total


SUMS: dict[str, Callable[[Array], Array]] = {
    "tiles": _tiles,
    "twice": partial(_tiles, scale=2),
    "folded": _folded,
}
"""The sums of a picture in which its noise is examined."""
