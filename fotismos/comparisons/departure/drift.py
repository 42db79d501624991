"""What moved between two runs of one picture by more than their noise.

A run is several images of one picture, each with its own random numbers: passes of a renderer, or
repeats from any program. Tested are the means of both runs over *parts*: the whole picture, blocks,
or what shapes cover. In each channel of a part of N pixels, ``t = Σ d / N e`` is Student's, with
the differences d of the pixels' means of m images before and n after. Where both have as many, and
at least `FEWEST`, the standard error e is known in three ways, else in the first alone. Each is a
test of its own, and the smallest chance counts, times their number (Bonferroni).

**By pixels.** All pixels of a part are pooled, so that two images are enough::

    (N e)² = r max(P, Q)
    P = (1/m + 1/n) Σ s²      s² the pooled variance of a pixel over the images
    Q = Σ (d − Σ d / N)²
    r = the mean over tiles of (variance of the tile's sum / sum of its pixels' variances), ≥ 1

P can be too small by chance: where noise has few values (edges in a PNG, fireflies cut off at 1),
or is skewed and m ≠ n. Then Q, the spread of the differences themselves, is larger. If nothing
changed and m = n, each d is symmetric about 0, and the tails of ``Σ d / √Σ d²`` are no heavier than
a normal variable's, however the noise is distributed (Efron, J. Am. Stat. Assoc. 64, 1969): a
firefly raises both sums. It also means that a change of fewer than about 30 pixels in a part counts
as fireflies.

r is 1 for independent pixels; a reconstruction filter, which correlates neighbours, raises it.
Noise that is correlated over a part of a tile is correlated with a part of the next one: r falls
short by a share that is half as large in tiles of twice the side. If r is likely larger there
(:data:`LIKELY`), ``2 r(2 tiles) - r(tile)`` counts; if it is surely larger (:data:`SURE`), noise
is taken to reach along the whole picture, as in stripes. A pattern that tiles repeat shows in the
sums over the same pixel of all tiles, and multiplies r. Longer patterns are not noticed. With f
degrees of freedom of r, t has ``1 / (1/f + r/N)``.

**By images.** e is that of the part's own means over the images, e₁ before and e₂ now, whatever
happens within it: ``e² = e₁² + e₂²``, with Satterthwaite's degrees of freedom (Welch 1947).

**By pairs.** e is that of the differences of the i-th images, with n − 1 degrees of freedom. If
both runs drew the same random numbers, these cancel, and the smallest changes show.

If nothing varies at all, any change beyond rounding is a drift.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import ceil

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fotismos.comparisons.departure.blocks import block_sums, ratio
from fotismos.comparisons.departure.colour import Array

LINEAR_ROUNDING = 1e-6
"""The difference that rounding can make in a colour."""

RELATIVE_ROUNDING = 1e-5
"""Share of a value that rounding can change: other machines order float32 sums otherwise."""

SIDE = 16
TILES = 8
"""Side in pixels of a block; tiles of whole blocks along the longer side of the picture, at
most."""

LIKELY = 0.97
SURE = 0.995
"""Chances with which independent tiles have a smaller variance of their sums: beyond the first,
noise is taken to reach a little further than a tile, beyond the second much further."""

FEWEST = 8
"""Images on each side that show the spread of a part's means: fewer may be equal by chance."""

POWER = 0.95
QUANTILE = 1.645
"""The chance with which the smallest visible change is caught, and its quantile."""


@dataclass(frozen=True)
class Run:
    """Images of a picture: how many, mean and variance of each pixel, correlation r of its noise.

    Images are linear, (H, W, 3, ...): further axes hold further pictures, r is (...).
    """

    images: Sequence[Array]
    mean: Array
    variance: Array
    correlation: Array

    @property
    def count(self) -> int:
        """The number of images."""
        return len(self.images)

    @classmethod
    def of(cls, images: Iterable[ArrayLike]) -> "Run":
        """Return the statistics of images (H, W, 3, ...) of one size."""
        known = [np.asarray(image) for image in images]
        mean = np.zeros(())
        squares = np.zeros(())
        sums: dict[str, list[Array]] = {name: [] for name in SUMS}
        for count, image in enumerate(known, start=1):
            values = image.astype(np.float64)
            # Welford's update takes the step from the old mean and from the new one.
            step = values - mean
            mean = mean + step / count
            squares = squares + step * (values - mean)
            for name, of_images in sums.items():
                of_images.append(SUMS[name](values))
        variance = squares / max(len(known) - 1, 1)
        correlation = _correlation(sums, variance, len(known))
        return cls(images=known, mean=mean, variance=variance, correlation=correlation)

    def changed(self, change: Callable[[Array], Array]) -> "Run":
        """Return the run with a change of the light in each image that leaves its noise."""
        return replace(
            self, images=[change(image) for image in self.images], mean=change(self.mean)
        )


@dataclass(frozen=True)
class Drift:
    """Means over parts (N, 3, ...) before and now, and the uncertainty of their difference.

    ``errors`` (T, N, 3, ...) are its standard error as known in T ways, with so many degrees of
    ``freedom``.
    """

    before: Array
    after: Array
    errors: Array
    freedom: Array

    @property
    def tests(self) -> int:
        """The number of means that are tested."""
        return int(np.prod(self.before.shape[:2]))

    @property
    def rounding(self) -> Array:
        """The difference that rounding can make."""
        size = np.maximum(np.abs(self.before), np.abs(self.after))
        return np.maximum(LINEAR_ROUNDING, RELATIVE_ROUNDING * size)

    def p(self) -> Array:
        """Return the chance of a difference at least as large if nothing changed."""
        p: Array = np.minimum(len(self.errors) * self._chances().min(axis=0), 1.0)
        return p

    @property
    def error(self) -> Array:
        """The standard error that tells most."""
        best = self._chances().argmin(axis=0)
        error: Array = np.take_along_axis(self.errors, best[None], axis=0)[0]
        return error

    def _chances(self) -> Array:
        """Return the chance by each standard error, (T, N, 3, ...)."""
        from scipy.special import stdtr  # loaded late: half a second

        size = np.abs(self.after - self.before)
        with np.errstate(divide="ignore", invalid="ignore"):  # no noise
            p = 2.0 * stdtr(self.freedom, -size / self.errors)
        return np.where(size <= self.rounding, 1.0, p)

    def moved(self, level: float) -> NDArray[np.bool_]:
        """Return which means moved, with the chance ``level`` that any does if nothing changed."""
        return ~(sidak(self.p(), self.tests) >= level)  # a NaN does not pass

    def limit(self, level: float) -> Array:
        """Return the smallest change of each mean that is caught with the chance `POWER`.

        With the critical value c and ν degrees of freedom, the change is this many errors (Johnson
        and Welch 1940): ``c (1 − 1/4ν) + z √(1 + c²/2ν)``. Pairs do not count: their spread is
        known only once something changed.
        """
        from scipy.special import stdtrit

        freedom = self.freedom[:2]
        c = -stdtrit(freedom, level_of_each(level, self.tests) / (2.0 * len(self.errors)))
        factors = c * (1.0 - 0.25 / freedom)
        factors += QUANTILE * np.sqrt(1.0 + c**2 / (2.0 * freedom))
        limit: Array = np.maximum((factors * self.errors[:2]).min(axis=0), self.rounding)
        return limit


def drift(before: Run, after: Run, parts: NDArray[np.integer]) -> Drift:
    """Compare the means of two runs over parts.

    ``parts`` (H, W) are their numbers from 0 to N - 1, each of some pixel; -1 is in none. The first
    run has at least two images; the second may have one, whose noise is taken for equal.
    """
    order = np.argsort(parts, axis=None, kind="stable")
    numbers = parts.ravel()[order]
    order = order[numbers >= 0]
    numbers = numbers[numbers >= 0]
    starts = np.searchsorted(numbers, np.arange(numbers[-1] + 1))

    def summed(image: Array) -> Array:
        """Return the sums (N, ...) of an image (H, W, ...) over the parts."""
        flat = image.reshape(-1, *image.shape[2:])[order]
        sums: Array = np.add.reduceat(flat, starts, axis=0, dtype=np.float64)
        return sums

    ways = [_by_pixels(before, after, summed)]
    if before.count == after.count >= FEWEST:
        first = np.array([summed(image) for image in before.images])
        second = np.array([summed(image) for image in after.images])
        ways += [_by_images(first, second), _by_pairs(second - first)]
    errors, freedoms = zip(*ways, strict=True)
    pixels = summed(np.ones_like(before.mean[:, :, :1]))
    return Drift(
        before=summed(before.mean) / pixels,
        after=summed(after.mean) / pixels,
        errors=np.array(errors) / pixels,
        freedom=np.array(np.broadcast_arrays(*freedoms)),
    )


def _by_pixels(before: Run, after: Run, summed: Callable[[Array], Array]) -> tuple[Array, Array]:
    """Return the standard errors of sums of differences by their pixels, and their freedom."""
    m = before.count
    n = after.count
    first, second = _weights(before, after)
    d = after.mean - before.mean
    noise = noise_of_difference(before, after)
    r = np.maximum(first * before.correlation + second * after.correlation, 1.0)
    # The channels' noise may be one.
    f = np.maximum(_total(_tiles(noise) > 0) * (m + n - 2) / 3.0, 1.0)
    pixels = summed(np.ones_like(d[:, :, :1]))
    # Q; it counts only if some pixel varies, else a change would hide in its own spread.
    spread = np.maximum(summed(d * d) - summed(d) ** 2 / pixels, 0.0) * noise.any(axis=(0, 1, 2))
    error = np.sqrt(r * np.maximum(summed(noise), spread))
    return error, np.broadcast_to(1.0 / (1.0 / f + r / pixels), error.shape)


def _by_images(before: Array, after: Array) -> tuple[Array, Array]:
    """Return standard errors by the sums (n, N, 3, ...) of as many images, and their freedom."""
    count = len(before)
    first = before.var(axis=0, ddof=1) / count
    second = after.var(axis=0, ddof=1) / count
    square = first + second
    freedom = (count - 1) * ratio(square**2, first**2 + second**2)
    return np.sqrt(square), np.maximum(freedom, 1.0)


def _by_pairs(difference: Array) -> tuple[Array, Array]:
    """Return the standard errors by the sums (n, N, 3, ...) of differences, and their freedom."""
    count = len(difference)
    error = difference.std(axis=0, ddof=1) / np.sqrt(count)
    return error, np.full(error.shape, count - 1.0)


def whole(shape: Sequence[int]) -> NDArray[np.int_]:
    """Return the whole picture (H, W) as one part."""
    return np.zeros(shape[:2], int)


def blocks(shape: Sequence[int], side: int = SIDE) -> NDArray[np.int_]:
    """Return square blocks of a picture (H, W) as parts, row by row; those at the edge are cut."""
    height, width = shape[:2]
    rows = np.arange(height) // side
    columns = np.arange(width) // side
    numbers: NDArray[np.int_] = rows[:, None] * (columns[-1] + 1) + columns
    return numbers


def noise_of_difference(before: Run, after: Run) -> Array:
    """Return the variance of the difference of both means, at each pixel."""
    first, second = _weights(before, after)
    pooled: Array = first * before.variance + second * after.variance
    return (1.0 / before.count + 1.0 / after.count) * pooled


def sidak(p: ArrayLike, tests: int) -> NDArray[np.float64]:
    """Return the chance of a p-value as small as `p` among this many independent tests."""
    # `1 − (1 − p)^n`, in a form that keeps its digits for small p.
    with np.errstate(divide="ignore"):  # p = 1
        chances: NDArray[np.float64] = -np.expm1(tests * np.log1p(-np.asarray(p, float)))
        return chances


def level_of_each(level: float, tests: int) -> float:
    """Return the level of each of several tests, so that together they have `level`."""
    return float(-np.expm1(np.log1p(-level) / tests))


def _weights(before: Run, after: Run) -> tuple[float, float]:
    """Return the weights of both variances, by degrees of freedom: a single image has none."""
    free = before.count + after.count - 2
    return (before.count - 1) / free, (after.count - 1) / free


def _correlation(sums: Mapping[str, Sequence[Array]], variance: Array, count: int) -> Array:
    """Return r (...) from each image's sums over tiles, and the pixels' variance (H, W, 3, ...).

    ``sums`` are over tiles, over tiles of twice the side, and over the same pixel of all tiles.
    """
    from scipy.special import chdtri  # loaded late: half a second

    correlations = {}
    freedoms = {}
    for name, of_images in sums.items():
        alone = SUMS[name](variance)
        r = ratio(np.var(of_images, axis=0) * count / max(count - 1, 1), alone)
        # The channels' noise may be one.
        tested = _total(alone > 0)
        freedoms[name] = np.maximum(tested / 3.0 * (count - 1), 1.0)
        correlations[name] = ratio(_total(r), tested)
    correlation = correlations["tiles"]
    # Larger in larger tiles than χ² allows by chance, if tiles were independent.
    twice = correlations["twice"]
    freedom = freedoms["twice"]
    grown = twice / np.maximum(correlation, 1e-30)
    # Noise that reaches beyond a tile: as in an endless picture, or else as along a stripe of it.
    beyond = np.where(grown > chdtri(freedom, 1.0 - LIKELY) / freedom, 2.0 * twice - correlation, 0)
    stripes = max(variance.shape[:2]) / _side(variance, 2)
    is_sure = grown > chdtri(freedom, 1.0 - SURE) / freedom
    correlation = np.maximum(correlation, np.where(is_sure, stripes * twice, beyond))
    # A pattern that every tile repeats: its sum grows with the number of tiles.
    folded = correlations["folded"]
    freedom = freedoms["folded"]
    repeats = folded > chdtri(freedom, 1.0 - SURE) / freedom
    return np.where(repeats, correlation * folded, correlation)


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
