"""Which pixels are shown to differ, which are not, and which are left open.

**The guarantee.** Of the marked pixels a share of at most `LEVEL` is expected to be marked wrongly.
Where the two images do not differ at all, the chance of any mark is at most `LEVEL`.

Two steps share it. First blocks of 8 x 8 pixels are tested, all together at a chance of
`BLOCK_LEVEL` for any false alarm (Bonferroni). Their means are nearly normal, and they are few: no
pixel needs a tail of 1e-6, which no number of passes bears out. Then the pixels of the blocks that
differ are tested at a false discovery rate of ``LEVEL − BLOCK_LEVEL`` (Benjamini and Hochberg
1995), which asks for tails of a hundredth or so.

**Skewed noise.** Path-traced noise is a sum of rare large contributions. A pixel that has had fewer
than its share looks darker *and* surer than it is. So its doubt is that of the hypothesis tested,
not that of the sample: if nothing differed, the missing light ``d`` would have come in
contributions as large as those seen, and have brought their variance with it ::

    V0 = V + c |d|,    c = |κ3| / κ2

with V the variance of the mean and κ2, κ3 the second and third cumulants of its noise, pooled over
the blocks around. For a Poisson number of equal contributions this is exactly the variance under
the hypothesis; to first order it is Johnson's correction of Student's t for skewness (J. Am. Stat.
Assoc. 73, 1978). The term counts only on the side where light can be missing.

**Few passes.** The variance of a pixel is pooled with those around it, as far as these are alike
(Smyth, Stat. Appl. Genet. Mol. Biol. 3, 2004), and is never taken to be less than its own.

**Open.** A pixel is undetermined that is not marked, but whose 95 % interval reaches a difference
of `VISIBLE` in the metric; with fewer than `FEWEST` passes, every pixel. No rule can know of light
of which no path anywhere in the image has brought a sample.

Where only the places of camera rays are random, and both images share these, there is no noise at
all: what differs by more than rounding differs.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from comparisons.departure.blocks import bands, block_sums, neighbourhood, ratio, spread_out
from reference.rendering.moments import BLOCK, DifferenceEstimate
from reference.rendering.renderer import require_finite

LEVEL, BLOCK_LEVEL = 0.05, 0.01
VISIBLE = 2.0
FEWEST = 4
"""Passes: a third moment needs three, and one more tells how it scatters."""

MARKED, UNDETERMINED = 1.0, 0.5
ABSOLUTE_ROUNDING, RELATIVE_ROUNDING = 1e-6, 1e-5

_NORMAL = 1e6
"""Degrees of freedom of what is as good as known."""

Array = NDArray[np.float64]
Distance = Callable[[Array, Array], Array]


def find(
    difference: DifferenceEstimate,
    test: ArrayLike,
    counted: ArrayLike,
    distance: Distance,
    *,
    exact: bool = False,
    level: float = LEVEL,
) -> NDArray[np.float32]:
    """The marks (H, W): 1 where a difference is shown, 0.5 where it is left open, 0 elsewhere.

    difference
        That of the test image and the reference, test less reference, pass by pass.
    test
        The test image (H, W, 3), linear.
    counted
        Boolean (H, W): the pixels that are tested; all others are 0.
    distance
        ``(test, reference) -> (N,)`` of linear colours (N, 3), in units of which `VISIBLE` is one.
    exact
        Whether nothing but the places of camera rays is random, and both images share them.
    level
        In place of `LEVEL`; blocks take a fifth of it, as they do there.

    Raises `NonFiniteError`.
    """
    test, counted = np.asarray(test), np.asarray(counted, bool)
    require_finite(difference.mean, "mean difference")
    require_finite(difference.standard_error, "standard error of the difference")
    marks = np.zeros(counted.shape, np.float32)
    beyond = counted.copy()
    for rows in bands(len(counted)):
        beyond[rows] &= _beyond_rounding(difference.mean[rows], test[rows])
    if exact:
        marks[beyond] = MARKED
        return marks
    if difference.passes < FEWEST:
        marks[counted] = UNDETERMINED
        return marks
    around = _Around.of(difference, counted)
    share = BLOCK_LEVEL / LEVEL * level
    differing = around.differing(share, _inflation(difference))
    inside = spread_out(differing, counted.shape) & counted
    chances = np.ones(counted.shape)
    for rows in bands(len(counted)):
        chances[rows][inside[rows]] = _Pixels.of(difference, around, rows, inside).chances()
    marks[inside & beyond & (chances <= _discoveries(chances[inside], level - share))] = MARKED
    rest = counted & (marks == 0.0)
    for rows in bands(len(counted)):
        pixels = _Pixels.of(difference, around, rows, rest)
        marks[rows][rest[rows]] = UNDETERMINED * pixels.are_open(test[rows][rest[rows]], distance)
    return marks


def _beyond_rounding(difference: Array, test: Array) -> NDArray[np.bool_]:
    size = np.maximum(np.abs(test), np.abs(test - difference))
    rounding = np.maximum(ABSOLUTE_ROUNDING, RELATIVE_ROUNDING * size)
    return np.any(np.abs(difference) > rounding, axis=-1)


def _discoveries(chances: Array, rate: float) -> float:
    """The largest chance that Benjamini and Hochberg take for a discovery; −1 for none."""
    ordered = np.sort(chances)
    passed = ordered <= rate * np.arange(1, len(ordered) + 1) / max(len(ordered), 1)
    return float(ordered[passed][-1]) if passed.any() else -1.0


def _chances(difference: Array, variance: Array, sizes: Array, freedom: Array) -> Array:
    """Chances (...) of differences (..., 3) at least this large if there were none.

    ``sizes`` (2, ..., 3) are those of contributions that may be missing from the reference, and
    from the test image. The chance is that of the three channels together; where there is no
    variance at all nothing is shown.
    """
    from scipy.special import stdtr

    size = np.where(difference > 0.0, *sizes)
    doubted = variance + size * np.abs(difference)
    deviations = np.zeros(doubted.shape)
    np.divide(np.abs(difference), np.sqrt(doubted), out=deviations, where=doubted > 0.0)
    return np.minimum(3.0 * 2.0 * stdtr(freedom, -deviations).min(axis=-1), 1.0)


@dataclass(frozen=True)
class _Around:
    """What is pooled, by block (h, w, 3), of the pixels' means.

    ``sizes`` (2, h, w, 3) are those of contributions, as `_chances` takes them: κ3/κ2 of the noise
    around; ``largest_sizes`` (2, 1, 1, 3) the largest of the image.
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
    def of(cls, difference: DifferenceEstimate, counted: NDArray[np.bool_]) -> _Around:
        parts = [_sums(difference, counted, rows) for rows in bands(len(counted))]
        pixels, mean, variance, squares, *skewed = map(np.concatenate, zip(*parts, strict=True))
        third, moved = np.array(skewed[:2]), np.array(skewed[2:])
        # Where noise is large on both sides the cubes of the one would hide those of the other.
        one_sided = ratio(neighbourhood(third, 1), neighbourhood(moved, 1))
        largest = one_sided.max(axis=(1, 2))[:, None, None]
        around = neighbourhood(variance)
        both = ratio(neighbourhood(third[0] - third[1]), around)
        sizes = np.where(around > 0.0, np.maximum([both, -both], 0.0), largest)
        # Variances differ from block to block: the own one counts as much as the eight around it.
        near = [neighbourhood(sums) + 8.0 * sums for sums in (pixels, variance, squares)]
        pooled = ratio(near[1], near[0])
        scatter = ratio(ratio(near[2], near[0]), pooled**2) - 1.0
        freedom = difference.passes - 1
        return cls(
            pixels=pixels,
            difference=ratio(mean, pixels),
            variance=ratio(variance, pixels**2),
            sizes=sizes,
            largest_sizes=largest,
            pooled_variance=pooled,
            pooled_freedom=_prior_freedom(scatter, freedom),
            own_freedom=freedom,
        )

    @cached_property
    def quantile(self) -> Array:
        """Student's quantile at 97.5 % for the pixels of each block: they share their freedom."""
        from scipy.special import stdtrit

        return stdtrit(self.pooled_freedom + self.own_freedom, 0.975)

    def differing(self, level: float, inflation: float) -> NDArray[np.bool_]:
        """The blocks (h, w) that differ.

        The largest contributions of the image count: what is rare may have been seen elsewhere.
        """
        sizes = ratio(self.largest_sizes, self.pixels) * inflation
        # A quarter, since neighbours and their squares are not quite independent.
        freedom = np.maximum(neighbourhood(self.pixels) * self.own_freedom / 4.0, 1.0)
        chances = _chances(self.difference, self.variance * inflation, sizes, freedom)
        tested = self.pixels[..., 0] > 0
        return tested & (chances <= level / max(int(np.count_nonzero(tested)), 1))


def _sums(difference: DifferenceEstimate, counted: NDArray[np.bool_], rows: slice) -> list[Array]:
    """Sums over the blocks of some rows.

    Of pixels, differences, variances, their squares; of third cumulants below and above 0, without
    sign; and of the variances of the pixels that have them.
    """
    here = counted[rows, :, None]
    variance, third = _variance(difference, rows) * here, difference.third[rows] * here
    skewed = [np.maximum(-third, 0.0), np.maximum(third, 0.0)]
    moved = [variance * (third < 0.0), variance * (third > 0.0)]
    plain = [here * np.ones(3), difference.mean[rows] * here, variance, variance**2]
    return [block_sums(part) for part in (*plain, *skewed, *moved)]


def _variance(difference: DifferenceEstimate, rows: slice) -> Array:
    # In doubles: squares leave the range of single precision.
    return difference.standard_error[rows].astype(np.float64) ** 2


@dataclass(frozen=True)
class _Pixels:
    """Some pixels (N, 3), with what is pooled around them; ``sizes`` (2, N, 3).

    ``quantile`` is Student's at 97.5 %, for ``freedom``.
    """

    difference: Array
    variance: Array
    sizes: Array
    freedom: Array
    quantile: Array

    @classmethod
    def of(
        cls, difference: DifferenceEstimate, around: _Around, rows: slice, mask: NDArray[np.bool_]
    ) -> _Pixels:
        """Those of some rows that are in a mask (H, W) of the whole image."""
        mask = mask[rows]
        mean, own = difference.mean[rows][mask], _variance(difference, rows)[mask]
        blocks = slice(rows.start // BLOCK, -(-rows.stop // BLOCK))
        near = around.pooled_freedom, around.quantile, around.pooled_variance
        prior, quantile, pooled, *sizes = (
            spread_out(values[blocks], mask.shape)[mask] for values in (*near, *around.sizes)
        )
        freedom = prior + around.own_freedom
        moderated = (prior * pooled + around.own_freedom * own) / freedom
        return cls(mean, np.maximum(own, moderated), np.array(sizes), freedom, quantile)

    def chances(self) -> Array:
        return _chances(self.difference, self.variance, self.sizes, self.freedom)

    def are_open(self, shown: Array, distance: Distance) -> NDArray[np.bool_]:
        """Whether the 95 % interval of each pixel reaches a visible difference.

        It ends at the largest ``u`` with ``u² <= t² (V + c u)``: light that is missing from the
        reference makes the true difference smaller. Open is also where neither a pixel nor any
        other has noise: nothing has come that could vary.
        """
        t = self.quantile
        half = t * t * self.sizes / 2.0
        below, above = half + np.sqrt(half**2 + t * t * self.variance)
        ends = shown - self.difference + below, shown - self.difference - above
        largest = np.maximum(*(distance(shown, end) for end in ends))
        return (largest > VISIBLE) | (below + above == 0.0).all(axis=-1)


def _prior_freedom(scatter: Array, freedom: int) -> Array:
    """Degrees of freedom of pooled variances, from the relative variance of single ones.

    If true variances follow a scaled inverse χ² of ``d0`` degrees of freedom, those measured with
    ``d`` have a relative variance of ``2 (d + d0 − 2) / (d (d0 − 4))``; solved for ``d0``.
    """
    more = scatter * freedom - 2.0
    found = ratio(2.0 * freedom - 4.0 + 4.0 * scatter * freedom, more)
    return np.where(more > 0.0, np.minimum(found, _NORMAL), _NORMAL)


def _inflation(difference: DifferenceEstimate) -> float:
    """How many times the variance of a block's mean exceeds that of independent pixels; 1 or more.

    A wide reconstruction filter makes neighbours share their samples.
    """
    grouped = difference.grouped
    own = difference.standard_error.reshape(-1, 3)[grouped.places].astype(np.float64) ** 2
    independent = grouped.by_block(own)
    sums = np.stack([grouped.by_block(one) for one in grouped.means])
    weights = grouped.sizes[:, None, None]
    found = (weights * (sums - np.average(sums, axis=0, weights=grouped.sizes)) ** 2).sum(axis=0)
    found /= max(len(weights) - 1, 1) * weights.sum()
    noisy = independent > 0.0
    return max(1.0, float((found[noisy] / independent[noisy]).mean())) if noisy.any() else 1.0
