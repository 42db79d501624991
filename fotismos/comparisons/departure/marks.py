"""Mark the pixels that are certain to differ, and those left undetermined.

**The guarantee.** The expected share of wrong marks among all marks is at most `LEVEL`. If the two
images do not differ at all, the chance of any mark is at most `LEVEL`.

Two steps share this level. First, blocks of 8 x 8 pixels are tested, with a chance of `BLOCK_LEVEL`
of any false alarm (Bonferroni). Their means are nearly normal, and they are few: no pixel needs a
tail of 1e-6, which no number of passes supports. Then the pixels of differing blocks are tested at
a false discovery rate of ``LEVEL − BLOCK_LEVEL`` (Benjamini and Hochberg 1995), which needs tails
of about 0.01.

**Skewed noise.** Path-traced noise is a sum of rare large contributions. A pixel that got fewer
than its share looks darker *and* more certain than it is. So the variance is that of the tested
hypothesis, not of the sample: if nothing differed, the missing light ``d`` would come in
contributions as large as those seen, with their variance ::

    V0 = V + c |d|,    c = |κ3| / κ2

with V the variance of the mean, and κ2, κ3 the second and third cumulants of its noise, pooled over
nearby blocks. For a Poisson number of equal contributions this is exactly the variance under the
hypothesis; to first order it is Johnson's correction of Student's t for skewness (J. Am. Stat.
Assoc. 73, 1978). The term counts only on the side where light can be missing.

**Few passes.** The variance of a pixel is pooled with nearby ones, as far as these are alike
(Smyth, Stat. Appl. Genet. Mol. Biol. 3, 2004), and is never less than its own.

**Certain somewhere.** A block that differs shows, with a chance of `BLOCK_LEVEL` of any false
alarm, that the images do. Where no block is large enough, the mean of the whole image may be: it is
tested likewise, with the spread of its groups of passes, and the two tests share the level.

**Undetermined.** An unmarked pixel is undetermined if its 95 % interval reaches a difference of
`VISIBLE` in the metric; with fewer than `FEWEST` passes, every pixel is. No rule can detect light
that no path in the image has sampled.

If only the positions of camera rays are random, and both images share them, there is no noise:
pixels that differ by more than rounding differ.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fotismos.comparisons.departure.blocks import (
    bands,
    block_sums,
    neighbourhood,
    ratio,
    spread_out,
)
from fotismos.comparisons.departure.colour import Array
from fotismos.comparisons.departure.criterion import TOLERANCE
from fotismos.comparisons.departure.estimate import CELL, NoiseShown
from fotismos.reference import student
from fotismos.reference.rendering.passes import require_finite
from fotismos.reference.rendering.sums import BLOCK, DifferenceEstimate

LEVEL = 0.05
BLOCK_LEVEL = 0.01
VISIBLE = TOLERANCE
FEWEST = 4
"""Passes: a third moment needs three, and one more shows its scatter."""

MARKED = 1.0
UNDETERMINED = 0.5
ABSOLUTE_ROUNDING = 1e-6
RELATIVE_ROUNDING = 1e-5

_NORMAL = 1e6
"""Degrees of freedom of variances that are practically known."""

Distance = Callable[[Array, Array], Array]


@dataclass(frozen=True)
class Marks:
    """Marks (H, W) of pixels, and whether the images certainly differ somewhere."""

    image: NDArray[np.float32]
    is_certain: bool


def find(
    difference: DifferenceEstimate,
    test: ArrayLike,
    counted: ArrayLike,
    distance: Distance,
    *,
    exact: bool = False,
    noise_shown: NoiseShown = "all",
    level: float = LEVEL,
) -> Marks:
    """Return marks (H, W): 1 where a difference is shown, 0.5 if undetermined, 0 elsewhere.

    With them, whether a difference is certain anywhere.

    ``difference`` is the test image (H, W, 3) less the reference, pass by pass. Pixels that are not
    ``counted`` (H, W) are 0. ``distance(test, reference) -> (N,)`` takes linear colours (N, 3), and
    is in the unit of `VISIBLE`. ``exact`` says that only the positions of camera rays are random,
    and both images share them. ``noise_shown`` says whose noise the passes show: of two single
    pictures none. Noise that they do not show is taken to be independent in cells of a few pixels,
    so a difference is certain only where it is alike over a tile. ``level`` replaces `LEVEL`;
    blocks take the same share of it.
    """
    test = np.asarray(test)
    counted = np.asarray(counted, bool)
    require_finite(difference.mean, "mean difference")
    require_finite(difference.standard_error, "standard error of the difference")
    marks = np.zeros(counted.shape, np.float32)
    beyond = counted.copy()
    for rows in bands(len(counted)):
        mean = difference.mean[rows]
        shown = test[rows]
        size = np.maximum(np.abs(shown), np.abs(shown - mean))
        rounding = np.maximum(ABSOLUTE_ROUNDING, RELATIVE_ROUNDING * size)
        beyond[rows] &= np.any(np.abs(mean) > rounding, axis=-1)
    # What needs no test of blocks: no noise, noise that is not shown, or too little known of it.
    if exact:
        marks[beyond] = MARKED
        return Marks(image=marks, is_certain=bool(beyond.any()))
    if noise_shown != "all" and not _is_even(difference.mean, counted):
        marks[beyond] = UNDETERMINED
        return Marks(image=marks, is_certain=False)
    if noise_shown == "none":
        marks[beyond] = UNDETERMINED
        return Marks(image=marks, is_certain=True)
    if difference.passes < FEWEST:
        marks[counted] = UNDETERMINED
        return Marks(image=marks, is_certain=False)
    # Blocks first, then the pixels of those that differ.
    around = _Around.of(difference, counted)
    share = BLOCK_LEVEL / LEVEL * level
    rate = level - share
    # Half of the blocks' share each, for the blocks and for the image as a whole.
    differing = around.differing(share / 2, _inflation(difference))
    is_certain = bool(differing.any()) or _whole_differs(difference, around, level=share / 2)
    inside = spread_out(differing, counted.shape) & counted
    chances = np.ones(counted.shape)
    for rows in bands(len(counted)):
        chances[rows][inside[rows]] = _Pixels.of(difference, around, rows, inside).chances(rate)
    marks[inside & beyond & (chances <= _discoveries(chances[inside], rate))] = MARKED
    # Of all others, those that may differ visibly.
    rest = counted & (marks == 0.0)
    for rows in bands(len(counted)):
        pixels = _Pixels.of(difference, around, rows, rest)
        marks[rows][rest[rows]] = UNDETERMINED * pixels.are_open(test[rows][rest[rows]], distance)
    return Marks(image=marks, is_certain=is_certain and bool(beyond.any()))


CELLS_ALONG_TILE = 4
"""Cells along a tile: their noise is taken to be independent."""

INDEPENDENT_RATIO = 0.86
"""Median of five times the share of squares between a tile's quarters if its cells' noise is
independent: the share then follows Beta(3/2, 6)."""


def _is_even(difference: Array, counted: Array) -> bool:
    """Return whether a difference (H, W, 3) is alike over a tile somewhere, as noise is not.

    Student's t of the means of a tile's cells, for all whole tiles and channels (Bonferroni). A
    filter makes neighbouring cells alike: the squares between quarters of a tile are then more than
    their share of all squares. The variance of the tile's mean is that many times as large at least
    twice over: from cells to quarters, and from quarters to the tile.
    """
    height = counted.shape[0] // (CELL * CELLS_ALONG_TILE)
    width = counted.shape[1] // (CELL * CELLS_ALONG_TILE)
    if not height or not width:
        return False
    shape = (height, CELLS_ALONG_TILE, CELL, width, CELLS_ALONG_TILE, CELL)
    # A rest at the right and at the bottom is left out.
    rows = height * CELL * CELLS_ALONG_TILE
    columns = width * CELL * CELLS_ALONG_TILE
    inside = np.asarray(counted)[:rows, :columns].reshape(shape).all(axis=(1, 2, 4, 5))
    values = np.asarray(difference, float)[:rows, :columns]
    cells = values.reshape(*shape, 3).mean(axis=(2, 5))
    grids = cells.transpose(0, 2, 1, 3, 4)[inside]
    if not grids.size:
        return False
    half = CELLS_ALONG_TILE // 2
    tiles = grids.reshape(-1, CELLS_ALONG_TILE * CELLS_ALONG_TILE, 3)
    quarters = grids.reshape(-1, 2, half, 2, half, 3).mean(axis=(2, 4)).reshape(-1, 4, 3)
    variance = tiles.var(axis=1, ddof=1)
    alike = ratio(half**2 * quarters.var(axis=1, ddof=1), variance)[variance > 0]
    inflation = max(1.0, float(np.median(alike)) / INDEPENDENT_RATIO) ** 2 if alike.size else 1.0
    mean = np.abs(tiles.mean(axis=1))
    error = np.sqrt(inflation * variance) / CELLS_ALONG_TILE
    limit = student.quantile(
        CELLS_ALONG_TILE * CELLS_ALONG_TILE - 1, 1 - BLOCK_LEVEL / (2 * mean.size)
    )
    return bool((mean > np.maximum(limit * error, ABSOLUTE_ROUNDING)).any())


def _discoveries(chances: Array, rate: float) -> float:
    """Return the largest chance that counts as a discovery (Benjamini and Hochberg); −1 if none."""
    # The largest `p(i) <= rate i / n`; all smaller chances are discoveries with it.
    ordered = np.sort(chances)
    passed = ordered <= rate * np.arange(1, len(ordered) + 1) / max(len(ordered), 1)
    return float(ordered[passed][-1]) if passed.any() else -1.0


def _chances(
    difference: Array, variance: Array, sizes: Array, freedom: Array, most: float = 1.0
) -> Array:
    """Return the chances (...) of differences (..., 3) at least this large under the hypothesis.

    ``sizes`` (2, ..., 3) are the sizes of contributions that may be missing from the reference, and
    from the test image. The chance is over all three channels; without variance it is 1, and so is
    any above ``most``.
    """
    from scipy.special import ndtri, stdtr

    # Where the test image is brighter, light may be missing from the reference, else from it.
    size = np.where(difference > 0.0, sizes[0], sizes[1])
    supposed = variance + size * np.abs(difference)
    deviations = np.zeros(supposed.shape)
    np.divide(np.abs(difference), np.sqrt(supposed), out=deviations, where=supposed > 0.0)
    # Student's tails are slow to compute, and never lighter than the normal distribution's.
    near = deviations.max(axis=-1) >= -ndtri(most / 6.0)
    chances = np.ones(near.shape)
    # Six times one tail: two signs of three channels (Bonferroni).
    chances[near] = 6.0 * stdtr(freedom[near], -deviations[near]).min(axis=-1)
    return np.where(chances <= most, chances, 1.0)


@dataclass(frozen=True)
class _Around:
    """Pooled moments of the pixels' means, by block (h, w, 3).

    ``sizes`` (2, h, w, 3) are sizes of contributions for `_chances`: κ3/κ2 of nearby noise;
    ``largest_sizes`` (2, 1, 1, 3) are the largest of the image.
    """

    pixels: Array
    difference: Array
    variance: Array
    sizes: Array
    largest_sizes: Array
    pooled_variance: Array
    pooled_freedom: Array
    own_freedom: int

    @classmethod
    def of(cls, difference: DifferenceEstimate, counted: NDArray[np.bool_]) -> "_Around":
        parts = [_sums(difference, counted, rows) for rows in bands(len(counted))]
        pixels, mean, variance, squares, *skewed = map(np.concatenate, zip(*parts, strict=True))
        # (2, h, w, 3): contributions to the reference make cumulants below 0, which come first.
        third = np.array(skewed[:2])
        moved = np.array(skewed[2:])
        # If noise is large on both sides, the cubes of one would hide those of the other.
        one_sided = ratio(neighbourhood(third, 1), neighbourhood(moved, 1))
        largest = one_sided.max(axis=(1, 2))[:, None, None]
        around = neighbourhood(variance)
        # Near noise the sign of its skewness tells the side; without any, nothing is excluded.
        both = ratio(neighbourhood(third[0] - third[1]), around)
        sizes = np.where(around > 0.0, np.maximum([both, -both], 0.0), largest)
        # Variances differ among blocks: a block counts as much as its eight neighbours.
        near = [neighbourhood(sums) + 8.0 * sums for sums in (pixels, variance, squares)]
        pooled = ratio(near[1], near[0])
        # Mean square over squared mean, less 1: the relative variance of the pixels' variances.
        scatter = ratio(ratio(near[2], near[0]), pooled**2) - 1.0
        freedom = difference.passes - 1
        return cls(
            pixels=pixels,
            difference=ratio(mean, pixels),
            # Of a block's mean, as if its pixels were independent: `_inflation` corrects it.
            variance=ratio(variance, pixels**2),
            sizes=sizes,
            largest_sizes=largest,
            pooled_variance=pooled,
            pooled_freedom=_prior_freedom(scatter, freedom),
            own_freedom=freedom,
        )

    @cached_property
    def quantile(self) -> Array:
        """Student's quantile at 97.5 % for the pixels of each block, which share their freedom."""
        from scipy.special import stdtrit

        return np.asarray(stdtrit(self.pooled_freedom + self.own_freedom, 0.975))

    def differing(self, level: float, inflation: float) -> NDArray[np.bool_]:
        """Return which blocks (h, w) differ.

        The image's largest contributions count: rare ones may only have been seen elsewhere.
        """
        # One contribution moves the mean of a block by its size over the number of pixels.
        sizes = ratio(self.largest_sizes, self.pixels) * inflation
        # A quarter, since neighbours and their squares are not quite independent.
        freedom = np.maximum(neighbourhood(self.pixels) * self.own_freedom / 4.0, 1.0)
        chances = _chances(self.difference, self.variance * inflation, sizes=sizes, freedom=freedom)
        # Bonferroni, over the blocks that hold counted pixels.
        tested = self.pixels[..., 0] > 0
        return tested & (chances <= level / max(int(np.count_nonzero(tested)), 1))


def _whole_differs(difference: DifferenceEstimate, around: _Around, level: float) -> bool:
    """Return whether the mean of all counted pixels differs, by the spread of groups of passes.

    The groups are of the sampled blocks; neighbours may share noise, which their spread includes.
    """
    grouped = difference.grouped
    count = len(grouped.sizes)
    if count < FEWEST:
        return False
    means = grouped.means.mean(axis=1)
    mean = np.average(means, axis=0, weights=grouped.sizes)
    squares = (grouped.sizes[:, None] * (means - mean) ** 2).sum(axis=0)
    variance = squares / ((count - 1) * grouped.sizes.sum())
    sizes = around.largest_sizes[:, 0, 0] / len(grouped.places)
    freedom = np.full((1, 3), count - 1.0)
    chances = _chances(mean[None], variance[None], sizes=sizes[:, None], freedom=freedom)
    return bool(chances[0] <= level)


def _sums(difference: DifferenceEstimate, counted: NDArray[np.bool_], rows: slice) -> list[Array]:
    """Return sums over the blocks of some rows.

    The sums are of pixels, differences, variances, and squared variances; of third cumulants below
    and above 0, without sign; and of the variances of the pixels that have them.
    """
    here = counted[rows, :, None]
    variance = _variance(difference, rows) * here
    third = difference.third[rows] * here
    skewed = [np.maximum(-third, 0.0), np.maximum(third, 0.0)]
    moved = [variance * (third < 0.0), variance * (third > 0.0)]
    plain = [here * np.ones(3), difference.mean[rows] * here, variance, variance**2]
    return [block_sums(part) for part in (*plain, *skewed, *moved)]


def _variance(difference: DifferenceEstimate, rows: slice) -> Array:
    # In double precision: squares leave the range of single precision.
    return difference.standard_error[rows].astype(np.float64) ** 2


@dataclass(frozen=True)
class _Pixels:
    """Some pixels (N, 3), with pooled moments; ``sizes`` are (2, N, 3).

    ``quantile`` is Student's at 97.5 % for ``freedom``.
    """

    difference: Array
    variance: Array
    sizes: Array
    freedom: Array
    quantile: Array

    @classmethod
    def of(
        cls, difference: DifferenceEstimate, around: _Around, rows: slice, mask: NDArray[np.bool_]
    ) -> "_Pixels":
        """Return the pixels of some rows that are in a mask (H, W) of the whole image."""
        mask = mask[rows]
        mean = difference.mean[rows][mask]
        variance = _variance(difference, rows)[mask]
        # Bands hold whole blocks, so they begin where a block does.
        blocks = slice(rows.start // BLOCK, -(-rows.stop // BLOCK))
        by_block = (around.pooled_freedom, around.quantile, around.pooled_variance, *around.sizes)
        by_pixel = [spread_out(values[blocks], mask.shape)[mask] for values in by_block]
        prior, quantile, pooled, *sizes = by_pixel
        # Smyth: the pooled variance weighs as much as its degrees of freedom.
        freedom = prior + around.own_freedom
        moderated = (prior * pooled + around.own_freedom * variance) / freedom
        return cls(
            difference=mean,
            variance=np.maximum(variance, moderated),
            sizes=np.array(sizes),
            freedom=freedom,
            quantile=quantile,
        )

    def chances(self, most: float) -> Array:
        return _chances(
            self.difference, self.variance, sizes=self.sizes, freedom=self.freedom, most=most
        )

    def are_open(self, shown: Array, distance: Distance) -> NDArray[np.bool_]:
        """Return whether the 95 % interval of each pixel reaches a visible difference.

        It ends at the largest ``u`` with ``u² <= t² (V + c u)``: light that is missing from the
        reference makes the true difference smaller. Pixels are also open if the whole image has no
        noise: no light has arrived that could vary.
        """
        t = self.quantile
        # The larger root of `u² = t² (V + c u)`, for light missing from either image.
        half = t * t * self.sizes / 2.0
        below, above = half + np.sqrt(half**2 + t * t * self.variance)
        are_visible: NDArray[np.bool_] = (below + above == 0.0).all(axis=-1)
        # The true reference at both ends: larger by `below` where it lacks light.
        for end in (below, -above):
            rest = ~are_visible
            reached = shown[rest] - self.difference[rest] + end[rest]
            are_visible[rest] = distance(shown[rest], reached) > VISIBLE
        return are_visible


def _prior_freedom(scatter: Array, freedom: int) -> Array:
    """Return the degrees of freedom of pooled variances, from the relative variance of single ones.

    If true variances follow a scaled inverse χ² with ``d0`` degrees of freedom, variances measured
    with ``d`` have a relative variance of ``2 (d + d0 − 2) / (d (d0 − 4))``, solved for ``d0``.
    """
    # No more scatter than that of χ² itself: all pixels have one variance, known by pooling.
    more = scatter * freedom - 2.0
    prior = ratio(2.0 * freedom - 4.0 + 4.0 * scatter * freedom, more)
    return np.where(more > 0.0, np.minimum(prior, _NORMAL), _NORMAL)


def _inflation(difference: DifferenceEstimate) -> float:
    """Return the variance of a block's mean over that of independent pixels; at least 1.

    With a wide reconstruction filter, neighbours share samples.
    """
    grouped = difference.grouped
    variance = difference.standard_error.reshape(-1, 3)[grouped.places].astype(np.float64) ** 2
    independent = grouped.by_block(variance)
    sums = np.stack([grouped.by_block(mean) for mean in grouped.means])
    # The variance of the weighted mean of K groups: `Σ w (m − mean)² / ((K − 1) Σ w)`.
    weights = grouped.sizes[:, None, None]
    spread = (weights * (sums - np.average(sums, axis=0, weights=grouped.sizes)) ** 2).sum(axis=0)
    spread /= max(len(weights) - 1, 1) * weights.sum()
    noisy = independent > 0.0
    return max(1.0, float((spread[noisy] / independent[noisy]).mean())) if noisy.any() else 1.0
