"""Compare repeats of a picture with earlier ones: tell drift from their noise.

Repeats are renderings of one picture, by any renderer, each with its own random numbers. A baseline
keeps the mean and the variance of each pixel over m of them; n new ones are compared with it. With
the differences d of the pixels' means, tested is their mean over the picture and over each block of
`SIDE` by `SIDE` pixels, N pixels in all, in each channel::

    t = Σ d / √(r max(P, Q))
    P = (1/m + 1/n) Σ s²      s² the pooled variance of a pixel over the repeats
    Q = Σ (d − Σ d / N)²
    r = the mean over tiles of (variance of the tile's sum / sum of its pixels' variances), ≥ 1

P pools all pixels of a sum, so that two repeats are enough. P can be too small by chance: where
noise has few values (edges in a PNG, fireflies cut off at 1), or is skewed and m ≠ n. Then Q, the
spread of the differences themselves, is larger. If nothing changed and m = n, each d is symmetric
about 0, and the tails of ``Σ d / √Σ d²`` are no heavier than a normal variable's, however the noise
is distributed (Efron, J. Am. Stat. Assoc. 64, 1969): a firefly raises both sums. It also means
that a change of fewer than about 30 pixels in a block counts as fireflies.

r is 1 for independent pixels; a reconstruction filter, which correlates neighbours, raises it.
Noise that is correlated over a part of a tile is correlated with a part of the next one: r falls
short by a share that is half as large in tiles of twice the side. If r is likely larger there
(:data:`LIKELY`), ``2 r(2 tiles) - r(tile)`` counts; if it is surely larger (:data:`SURE`), noise
is taken to reach along the whole picture, as in stripes. A pattern that tiles repeat shows in the
sums over the same pixel of all tiles, and multiplies r. Longer patterns are not noticed. With f
degrees of freedom of r, t has ``1 / (1/f + r/N)``.

Half of the significance is for the means of the picture, half for the blocks, each half corrected
for its number of tests (Šidák). If no pixel varies at all, any change beyond rounding is a drift.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import ceil, floor, log10

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fotismos.comparisons.check.measurement import LINEAR_ROUNDING
from fotismos.comparisons.check.moved import (
    RELATIVE_ROUNDING,
    level_of_each,
    moved,
    sidak,
    where_moved,
)
from fotismos.comparisons.departure.blocks import block_sums, ratio
from fotismos.comparisons.departure.colour import Array
from fotismos.comparisons.departure.criterion import decide
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.departure.noise import MARGIN
from fotismos.comparisons.pictures import require_one_size
from fotismos.comparisons.records.check import Move, PictureGate, SmallestChanges
from fotismos.comparisons.records.departure import Colour, VisibleShare
from fotismos.heuristic.errors import InputError

SIDE = 16
TILES = 8
"""Side in pixels of the blocks that are tested; tiles of whole blocks along the longer side of the
picture, at most."""

LIKELY = 0.97
SURE = 0.995
"""Chances with which independent tiles have a smaller variance of their sums: beyond the first,
noise is taken to reach a little further than a tile, beyond the second much further."""

POWER = 0.95
QUANTILE = 1.645
"""The chance with which the smallest visible change is caught, and its quantile."""


@dataclass(frozen=True)
class Repeats:
    """Repeats of a picture: how many, mean and variance of each pixel, correlation r of its noise.

    Images are linear, (H, W, 3, ...): further axes hold further pictures, r is (...).
    """

    count: int
    mean: Array
    variance: Array
    correlation: Array

    @classmethod
    def of(cls, images: Iterable[ArrayLike]) -> "Repeats":
        """Return the statistics of images (H, W, 3, ...) of one size, in one pass over them."""
        mean = np.zeros(())
        squares = np.zeros(())
        known = set()
        sums: dict[str, list[Array]] = {name: [] for name in SUMS}
        count = 0
        for count, image in enumerate(images, start=1):
            values = np.asarray(image, np.float64)
            if count > 1:
                require_one_size((mean, values))
            # Welford's update takes the step from the old mean and from the new one.
            step = values - mean
            mean = mean + step / count
            squares = squares + step * (values - mean)
            for name, of_repeats in sums.items():
                of_repeats.append(SUMS[name](values))
            known.add(hash(values.tobytes()))
        # Two of one seed would hide noise; all may be equal, where a picture has none.
        if 1 < len(known) < count:
            raise InputError("some repeats are equal: give each its own seed.")
        variance = squares / max(count - 1, 1)
        return cls(count, mean, variance, _correlation(sums, variance, count))


@dataclass(frozen=True)
class Means:
    """Means over blocks (rows, columns, 3, ...) before and now, and the difference's uncertainty.

    ``error`` is its standard error, with so many degrees of ``freedom``.
    """

    before: Array
    after: Array
    error: Array
    freedom: Array

    @property
    def tests(self) -> int:
        """The number of tests to correct for: twice that of the means, for half the level."""
        return 2 * int(np.prod(self.before.shape[:3]))

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

    def moved(self, level: float) -> NDArray[np.bool_]:
        """Return which means moved, at this level together with the other half of the tests."""
        return ~(sidak(self.p(), self.tests) >= level)  # a NaN does not pass

    def limit(self, level: float) -> Array:
        """Return the smallest change of each mean that is caught with the chance `POWER`.

        With the critical value c and ν degrees of freedom, the change is this many errors (Johnson
        and Welch 1940): ``c (1 − 1/4ν) + z √(1 + c²/2ν)``.
        """
        from scipy.special import stdtrit

        c = -stdtrit(self.freedom, level_of_each(level, self.tests) / 2.0)
        errors = c * (1.0 - 0.25 / self.freedom)
        errors += QUANTILE * np.sqrt(1.0 + c**2 / (2.0 * self.freedom))
        error: NDArray[np.float64] = np.maximum(errors * self.error, self.rounding)
        return error


def _weights(before: Repeats, after: Repeats) -> tuple[float, float]:
    """Return the weights of both variances, by degrees of freedom: a single repeat has none."""
    free = before.count + after.count - 2
    return (before.count - 1) / free, (after.count - 1) / free


def noise_of_difference(before: Repeats, after: Repeats) -> Array:
    """Return the variance of the difference of both means, at each pixel."""
    first, second = _weights(before, after)
    pooled: Array = first * before.variance + second * after.variance
    return (1.0 / before.count + 1.0 / after.count) * pooled


def means(before: Repeats, after: Repeats) -> tuple[Means, Means]:
    """Return the means over the picture, and over its blocks.

    The baseline has at least two repeats; ``after`` may be one, whose noise is taken for equal.
    """
    m = before.count
    n = after.count
    first, second = _weights(before, after)
    d = after.mean - before.mean
    noise = noise_of_difference(before, after)
    r = np.maximum(first * before.correlation + second * after.correlation, 1.0)
    # The channels' noise may be one.
    f = np.maximum(_total(_tiles(noise) > 0) * (m + n - 2) / 3.0, 1.0)

    def over(side: int) -> Means:
        pixels = block_sums(np.ones_like(d[:, :, :1]), side)
        total = block_sums(d, side)
        # Q; it counts only if some pixel varies, else a change would hide in its own spread.
        spread = np.maximum(block_sums(d * d, side) - total**2 / pixels, 0.0)
        square = r * np.maximum(block_sums(noise, side), spread * noise.any(axis=(0, 1, 2)))
        old = block_sums(before.mean, side) / pixels
        new = block_sums(after.mean, side) / pixels
        return Means(
            before=old,
            after=new,
            error=np.sqrt(square) / pixels,
            freedom=1.0 / (1.0 / f + r / pixels),
        )

    return over(max(d.shape[:2])), over(SIDE)


def _correlation(sums: Mapping[str, Sequence[Array]], variance: Array, count: int) -> Array:
    """Return r (...) from each repeat's sums over tiles, and the pixels' variance (H, W, 3, ...).

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


# --- Baselines -----------------------------------------------------------------------------------


# --- A tolerance ---------------------------------------------------------------------------------


SURE_ERRORS = 3.0
"""Standard errors of shares of pixels, to each side: a gate must not fail by chance."""


def picture_gate(before: Repeats, after: Repeats, threshold: float, bound: float) -> PictureGate:
    """Judge repeats by a tolerance: at most a share ``bound`` of the pixels above a threshold.

    If a share p differs visibly, and noise alone lifts a share q above the threshold, a share
    s = p + q (1 - p) is measured at most. So ``p >= (s - q) / (1 - q)``; q is known from noise that
    is drawn with the repeats' variance, and widened for its error. As many differ at most as are
    above the threshold with the noise added to their distance. Equal repeats have no noise. A
    single picture does not show its own, and does not fail if the baseline has any.
    """
    require_one_size((before.mean, after.mean))
    distances = LEADING(after.mean, before.mean)
    size = distances.size
    measured = float((distances > threshold).mean())
    noise = noise_of_difference(before, after)
    value = low = high = measured
    if noise.any():
        drawn = np.random.default_rng(0).normal(size=noise.shape) * np.sqrt(noise)
        by_noise = LEADING(before.mean + MARGIN * drawn, before.mean)
        lifted = float((by_noise > threshold).mean())
        error = SURE_ERRORS * np.sqrt((measured * (1 - measured) + lifted * (1 - lifted)) / size)
        kept = max(1 - lifted, 1 / size)
        value = float(np.clip((measured - lifted) / kept, 0, 1))
        low = float(np.clip((measured - lifted - error) / kept, 0, 1))
        if after.count == 1:  # its noise is unknown, and skewed noise may lift more
            low = 0.0
        high = max(float((distances + by_noise > threshold).mean()), value)
    visible = VisibleShare(threshold=threshold, value=value, low=low, high=high)
    return PictureGate(visible=visible, bound=bound, state=decide([visible], threshold, bound))


# --- What moved, and what could not be seen ------------------------------------------------------


@dataclass(frozen=True)
class PictureCheck:
    """Repeats compared with earlier ones: what was tested, and what moved.

    ``level`` is the chance of a false alarm.
    """

    before: Repeats
    after: Repeats
    picture: Means
    blocks: Means
    moved: tuple[Move, ...]
    level: float

    def smallest_changes(self) -> SmallestChanges:
        """Return the smallest changes that the check catches."""
        whole = self.picture.limit(self.level)
        blocks = self.blocks.limit(self.level)
        return SmallestChanges(
            power=POWER,
            mean=colour(whole[0, 0]),
            block=colour(np.median(blocks, axis=(0, 1))),
            noisiest=colour(blocks.max(axis=(0, 1))),
        )

    def cause(self) -> str:
        """Return the sentence on factors or offsets that leave nothing moved, or else on where.

        Over the blocks' means x before and y now, with weights w of 1 / error², the offset of a
        channel is ``Σ w (y − x) / Σ w``, and its factor ``1 + Σ w z (y − x) / Σ w z x``, where z is
        the mean of all repeats.
        """
        m = self.before.count
        n = self.after.count
        old = self.blocks.before
        new = self.blocks.after
        weight = 1.0 / np.maximum(self.blocks.error, self.blocks.rounding) ** 2
        level = weight * (m * old + n * new) / (m + n)
        found = []
        for name, start, weights, base, image in (
            ("factor", 1.0, level, old, self.before.mean),
            ("offset", 0.0, weight, np.ones_like(old), np.ones(3)),
        ):
            size = np.maximum((weights * base).sum(axis=(0, 1)), 1e-30)
            value = (weights * (new - old)).sum(axis=(0, 1)) / size
            # If the baseline, changed alike, agrees everywhere, the change explains all.
            shifted = replace(self.before, mean=self.before.mean + value * image)
            if not any(mean.moved(self.level).any() for mean in means(shifted, self.after)):
                shown = map(_interval, start + value, 2.0 / np.sqrt(size))
                found.append(f"a constant {name} of {', '.join(shown)} in R, G, B")
        if found:
            return f"The whole picture moved by {' or by '.join(found)}. Nothing else moved."
        count = int(self.blocks.moved(self.level).any(axis=-1).sum())
        return f"No factor or offset explains it: the picture {where_moved(old, new, count)}."


def check_pictures(before: Repeats, after: Repeats, level: float) -> PictureCheck:
    """Compare repeats with earlier ones; ``level`` is the chance of a false alarm."""
    require_one_size((before.mean, after.mean))
    picture, blocks = means(before, after)
    moves = moved([*_moves(picture, level), *_moves(blocks, level, is_block=True)], level)
    return PictureCheck(
        before=before, after=after, picture=picture, blocks=blocks, moved=tuple(moves), level=level
    )


def colour(values: Array) -> Colour:
    """Return an array (3,) as a colour."""
    red, green, blue = values
    return float(f"{red:.8g}"), float(f"{green:.8g}"), float(f"{blue:.8g}")


def _moves(tested: Means, level: float, is_block: bool = False) -> Iterator[Move]:
    p = tested.p()
    corrected = sidak(p, tested.tests)
    for row, column, channel in np.argwhere(tested.moved(level)).tolist():
        index = row, column, channel
        before = float(tested.before[index])
        after = float(tested.after[index])
        error = float(tested.error[index])
        block = (row + 1, column + 1) if is_block else None
        yield Move(
            quantity=f"mean {'RGB'[channel]}"
            + (f", block {row + 1},{column + 1}" if block else ""),
            half=None,
            block=block,
            before=before,
            after=after,
            error=error,
            standard_errors=(after - before) / error if error > 0 else None,
            p=float(p[index]),
            p_corrected=float(corrected[index]),
        )


def _interval(value: float, half: float) -> str:
    return f"{value:.{min(7, max(2, 1 - floor(log10(half))))}f} ± {half:.1g}"
