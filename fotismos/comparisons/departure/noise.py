"""Take noise out of a metric: its mean and its visible shares, each with an interval.

A distance is never negative, so noise raises it: near zero in proportion to the root of the noise's
variance, far from zero to the variance itself. One rule covers both: add the noise once more. Over
a block of pixels, let ``f0`` be the mean distance as measured, and ``f1`` the mean after noise of
the same distribution is added to the reference. Then (:func:`without_noise`) ::

    f² (without noise) = f0² − (f1² − f0²)

If the distance is noise alone, ``f1 = √2 f0`` and nothing remains; if it is far larger, the squares
grow in proportion to the variance. This is the simulation and extrapolation of Cook and Stefanski
(J. Am. Stat. Assoc. 89, 1994) with the extrapolant of a distance. A block's square may be negative,
and its root then counts as negative, which leaves little bias in the mean of many.

Where noise moves colours along one line, back and forth through the truth, the rule subtracts too
much. The same formula with means of squared distances is right there if the pixels of a block
depart alike; otherwise it subtracts too little. The estimate is the middle of the two. Half of
their difference is added to its interval, and so is a part of the noise, `CURVATURE`, since colour
spaces are curved.

**Heavy noise.** All of this supposes that noise in means of n passes falls as ``1 / √n``. Rare
bright samples fall more slowly, and the passes show it: means of half of the passes are compared
with those of the other half, single groups with single groups (:class:`Halves`). Where half as
many samples are less than `HEAVY` times as far apart, noise is heavy. Then the interval of a
mean holds all that noise as large as the distance ``h`` of the halves can do to each pixel's
distance ``v``, from ``√(v² − h²)`` to ``√(v² + h²)``. Beyond that, it holds the light that a pixel
without a rare sample lacks: the mean of the groups less their median, over all pixels. It begins at
0 where halves are as far apart as the images. Shares are widened by the pixels whose halves differ
visibly.

The added noise is a contrast of the groups of passes, of
:func:`fotismos.comparisons.departure.estimate.contrasts`. The intervals are
Student's, by the jackknife over the groups. With too few groups, or for a metric of neighbourhoods,
the triangle inequality gives a wider one: the error of a mean distance is at most the distance of
the reference from the truth, the noise floor.

**Shares above a threshold.** Differences of colour are shrunk (``_draws``) towards their
block's mean, as far as noise explains their spread, and given noise of the remaining size. So each
pixel has a chance p of being above. The share is the mean of p; pixels with p between 0 and 1 are
undecided, and the mean of ``p (1 − p)``, twice, widens the interval. It would include the truth if
all pixels of equal p were above, or none. Half of the noise's own part is added, as uncertainty of
the shrinkage. In tests with normal, skewed and rare noise, intervals hold the truth in 97 % of the
cases; they fail where all pixels lie just at a threshold, or noise is larger than it.

All of it is computed on sampled blocks (`fotismos.reference.rendering.sums.sample`), at most 16,384
pixels; the bias found there is applied to the whole image.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fotismos.comparisons.departure.blocks import ratio
from fotismos.comparisons.departure.colour import Array, linear
from fotismos.comparisons.departure.estimate import contrasts, shares_above
from fotismos.comparisons.departure.metrics import Distances, Metric, Pixelwise
from fotismos.comparisons.records.departure import Viewing, VisibleShare
from fotismos.heuristic.convention import Floats
from fotismos.reference.rendering.sums import Grouped, jackknife_error, student

SPLITS = 2
"""Random splits of the groups into halves, and draws of single ones."""

CURVATURE = 0.06
"""Uncertainty, as a share of the squared noise, from the curvature of colour spaces."""

MARGIN = 1.25
"""Factor by which a noise floor, itself an estimate, may be too small."""

USUAL = float(np.sqrt(2.0))
HEAVY = float(np.sqrt(1.75))
"""How much farther apart images of half as many samples are, if noise falls as ``1 / √n``, and
where it counts as heavy. In tests it is 1.38 or more for normal noise, and 1.30 or less for noise
of rare samples."""

FEWEST = 3
"""Fewest groups of passes for a jackknife: without one of them, two remain to make noise from."""


def without_noise(measured: ArrayLike, noisier: ArrayLike, growth: float = USUAL) -> Array:
    """Return distances without noise, from those measured and those with the noise added again.

    ``f² = f0² − (f1² − f0²) / (g² − 1)``, where the noise of half as many samples is ``g`` times
    as far. For ``g = √2`` it is ``2 f0² − f1²``. The root of a negative number is negative.
    """
    before = np.square(measured)
    squares = before - (np.square(noisier) - before) / (growth**2 - 1.0)
    return np.sign(squares) * np.sqrt(np.abs(squares))


def exactly(metric: Metric, values: Floats) -> dict[str, Any]:
    """Return the fields of a summary of distances (N,) without noise."""
    mean = metric.mean(values)
    shares = shares_above(values, metric.visible)
    return _fields(metric, mean, low=mean, high=mean, shares=np.array([shares] * 3))


def roughly(metric: Metric, values: Floats, noise: Floats) -> dict[str, Any]:
    """Debias distances (N,), given those from noise alone, by the triangle inequality."""
    mean = metric.mean(values)
    floor = metric.mean(noise)
    # A pixel's noise is not the one that it has here. So the largest is taken off the largest
    # distance: if there is nothing but noise, nothing remains.
    ordered = np.sort(values)
    taken = np.sort(noise)
    # The value, then both ends.
    shares = [
        shares_above(distances, metric.visible)
        for distances in (
            np.sqrt(np.maximum(ordered**2 - taken**2, 0.0)),
            ordered - MARGIN * taken,
            values + noise,
        )
    ]
    # Nor are there more than those that noise alone does not bring above.
    by_noise = shares_above(MARGIN * noise, metric.visible)
    shares[1] = np.minimum(shares[1], shares_above(values, metric.visible) - by_noise)
    # Noise added once more is taken to add its square: what remains is `√(mean² − floor²)`. The
    # triangle inequality holds for the roots of squares.
    power = 2 if metric.squared else 1
    mean = mean ** (1 / power)
    floor = floor ** (1 / power)
    clean = max(float(without_noise(mean, np.hypot(mean, floor))), 0.0)
    half = MARGIN * floor
    low = max(mean - half, 0.0) ** power
    high = (mean + half) ** power
    return _fields(metric, clean**power, low=low, high=high, shares=np.array(shares))


def _fields(metric: Metric, value: float, low: float, high: float, shares: Array) -> dict[str, Any]:
    """Return the mean without noise, its interval, and shares (3, T): values, low and high ends."""
    visible = _visible(metric, shares)
    return {"debiased": value, "low": low, "high": high, "visible": visible}


def _visible(metric: Metric, shares: Array) -> tuple[VisibleShare, ...]:
    """Return shares (3, T): values, low and high ends.

    They never rise with the threshold: ends that do are moved outwards.
    """
    shares = np.clip(shares, 0.0, 1.0)
    shares[1] = np.minimum.accumulate(shares[1])
    shares[2] = np.maximum.accumulate(shares[2][::-1])[::-1]
    shares[0] = np.clip(np.minimum.accumulate(shares[0]), shares[1], shares[2])
    return tuple(
        VisibleShare(threshold=threshold, value=share, low=lowest, high=highest)
        for threshold, (share, lowest, highest) in zip(
            metric.visible, shares.T.tolist(), strict=True
        )
    )


def debiased(
    metric: Pixelwise, test: Array, grouped: Grouped, viewing: Viewing, raw: Floats
) -> dict[str, Any] | None:
    """Return a metric without noise, as fields of a summary; None with too few groups of passes.

    ``test`` (H, W, 3) is linear, ``grouped`` holds groups of passes of its difference from the
    reference at a sample of pixels, and ``raw`` (N,) the distances of all counted pixels.
    """
    count = len(grouped.sizes)
    if count < FEWEST:
        return None
    shown = test.reshape(-1, 3)[grouped.places].astype(np.float64)
    distances = _distances_from(metric, shown, viewing)
    whole = _Extrapolated.of(metric, distances, grouped, range(count))
    left_out = [
        _Extrapolated.of(metric, distances, grouped, [k for k in range(count) if k != out]).clean
        for out in range(count)
    ]
    # Noise of the passes, and blocks that are not sampled: independent, so squares add up.
    error = float(np.hypot(jackknife_error(left_out), sampling_error(whole.added, grouped)))
    # The bias comes from the sample, the value that it is subtracted from is over all pixels.
    measured = _mean(metric, raw)
    added = whole.raw - whole.clean
    middle = max(measured - added, 0.0)
    half = student(0.0, error, count).high
    half += whole.gap / 2.0 + np.sqrt(middle**2 + CURVATURE * whole.noise**2) - middle
    value, low, high = np.maximum(measured - added + half * np.array([0, -1, 1]), 0.0)
    # Up to here a linear metric is a mean square.
    if metric.averages_squares:
        value, low, high = np.sqrt([value, low, high])
    between = distances_between(metric, shown, viewing)
    apart = Halves.of(between, grouped.means, grouped.sizes)
    if apart.are_heavy and not (metric.averages_squares or metric.squared):
        low = max(min(low, measured - apart.below), 0.0)
        high = max(high, measured + apart.above)
    shares = _widened(metric, _shares(metric.visible, distances, grouped, raw), apart)
    return _fields(metric, float(value), low=float(low), high=float(high), shares=shares)


def visible_shares(
    metric: Pixelwise, test: Array, grouped: Grouped, viewing: Viewing
) -> tuple[VisibleShare, ...]:
    """Return the shares of pixels (P, 3) above a metric's thresholds, without noise.

    ``grouped`` holds at least :data:`FEWEST` groups of passes of their difference from the
    reference, at all of them.
    """
    distances = _distances_from(metric, test, viewing)
    apart = Halves.of(distances_between(metric, test, viewing), grouped.means, grouped.sizes)
    mean = np.average(grouped.means, axis=0, weights=grouped.sizes)
    raw = distances(mean[None])[0]
    return _visible(
        metric, _widened(metric, _shares(metric.visible, distances, grouped, raw), apart)
    )


def _widened(metric: Metric, shares: Array, apart: Halves) -> Array:
    """Return shares (3, T) whose ends hold the pixels that heavy noise makes differ."""
    if not apart.are_heavy or metric.averages_squares:
        return shares
    noise = shares_above(apart.halves, metric.visible)
    return shares + np.array([[0.0], [-1.0], [1.0]]) * noise


def _distances_from(metric: Pixelwise, shown: Array, viewing: Viewing) -> Distances:
    """Return the distance (..., P) of references by their differences (..., P, 3) from an image."""
    coordinates = metric.coordinates(shown, viewing)

    def distances(differences: Array) -> Array:
        # All noise of the difference goes to the reference: the test image stays as shown.
        references = metric.coordinates(shown - differences, viewing)
        return metric.difference(references, np.broadcast_to(coordinates, references.shape))

    return distances


Between = Callable[[Array, Array], Array]


def distances_between(metric: Pixelwise, shown: Array, viewing: Viewing) -> Between:
    """Return the distance (N,) of two references, by their differences (N, 3) from an image."""

    def between(first: Array, second: Array) -> Array:
        one = metric.coordinates(shown - first, viewing)
        other = metric.coordinates(shown - second, viewing)
        return metric.difference(one, other)

    return between


@dataclass(frozen=True)
class Halves:
    """How far means of passes are from means of as many others, at P pixels.

    ``groups`` (P,) are of single groups, ``halves`` (P,) of halves of the groups; both are means
    over `SPLITS` random splits. ``measured`` (P,) are the distances of the mean of all, and
    ``unseen`` is how far the mean moves by the light that most pixels lack.
    """

    groups: Array
    halves: Array
    measured: Array
    unseen: float
    count: int

    @classmethod
    def of(cls, between: Between, means: Array, sizes: Array) -> Halves:
        """Split means (K, P, 3) of groups of passes at random, always alike."""
        count = len(sizes)
        rng = np.random.default_rng(0)
        apart: dict[int, list[Array]] = {1: [], count // 2: []}
        for _ in range(SPLITS):
            order = rng.permutation(count)
            for size, found in apart.items():
                first = means[order[:size]].mean(axis=0)
                second = means[order[size : 2 * size]].mean(axis=0)
                found.append(between(first, second))
        mean = np.average(means, axis=0, weights=sizes)
        lacking = (np.median(means, axis=0) - mean).mean(axis=0)
        return cls(
            groups=np.mean(apart[1], axis=0),
            halves=np.mean(apart[count // 2], axis=0),
            measured=between(mean, np.zeros_like(mean)),
            unseen=float(between(mean, mean + lacking).mean()),
            count=count,
        )

    @property
    def below(self) -> float:
        """By how much the mean distance may be too large."""
        if self.measured.mean() <= self.halves.mean():
            return float(self.measured.mean())
        squares = np.maximum(self.measured**2 - self.halves**2, 0.0)
        return float((self.measured - np.sqrt(squares)).mean()) + self.unseen

    @property
    def above(self) -> float:
        """By how much the mean distance may be too small."""
        larger = np.hypot(self.measured, self.halves)
        return float((larger - self.measured).mean()) + self.unseen

    @property
    def growth(self) -> float:
        """How much farther apart images of half as many samples are; with few groups the usual."""
        doublings = np.log2(max(self.count // 2, 1))
        if self.count <= FEWEST or not self.halves.any():
            return USUAL
        return float((self.groups.mean() / self.halves.mean()) ** (1.0 / doublings))

    @property
    def are_heavy(self) -> bool:
        """Whether noise falls more slowly than ``1 / √n``; with few groups it cannot be seen."""
        return self.growth < HEAVY


def _shares(
    thresholds: Sequence[float], distances: Distances, grouped: Grouped, raw: Floats
) -> Array:
    """Return shares (3, T) above thresholds, without noise: values, low and high ends."""
    if not thresholds:
        return np.zeros((3, 0))
    mean = np.average(grouped.means, axis=0, weights=grouped.sizes)
    noise = np.tensordot(contrasts(grouped.sizes), grouped.means, 1)
    plain, *drawn = distances(np.concatenate([mean[None], _draws(mean, noise, grouped)]))
    steps = np.arange(len(thresholds))
    # (P, T): whether a pixel is above a threshold, and the share of draws in which it is.
    before = np.searchsorted(thresholds, plain)[:, None] > steps
    chance = np.mean(
        [np.searchsorted(thresholds, values)[:, None] > steps for values in drawn], axis=0
    )
    added = before.mean(axis=0) - chance.mean(axis=0)
    # The last factor makes `p (1 − p)` of few draws unbiased.
    undecided = (chance * (1.0 - chance)).mean(axis=0) * len(drawn) / (len(drawn) - 1)
    # The noise's part comes from the sample, the value that it is subtracted from is of all pixels.
    value = shares_above(raw, thresholds) - added
    error = np.hypot(
        np.sqrt(undecided / len(mean)), sampling_error(grouped.by_block(before - chance), grouped)
    )
    half = 2.0 * (undecided + error) + np.abs(added) / 2.0
    return np.array([value, value - half, value + half])


def _draws(mean: Array, noise: Array, grouped: Grouped) -> Array:
    """Return differences (J, P, 3) that may be true, given their mean (P, 3) and noise (J, P, 3).

    Within a block, the spread is noise and truth. Pixels are moved towards the block's mean by the
    noise's share of the variance (James and Stein), by at most one standard deviation of the noise:
    single pixels may depart (Efron and Morris, J. Am. Stat. Assoc. 67, 1972). The block's mean is
    moved towards 0 likewise. Noise is added by the variance that is left.
    """
    blocks = grouped.blocks
    pixels = grouped.by_block(np.ones(len(mean)))[:, None]

    def split(image: Array) -> tuple[Array, Array]:
        middle = grouped.by_block(image) / pixels
        return middle, image - middle[blocks]

    # Means of blocks (B, 3) and what pixels add to them (P, 3); of noise with a J in front.
    middle, off = split(mean)
    noise_middle, noise_off = map(np.array, zip(*map(split, noise), strict=True))
    spread = grouped.by_block(np.mean(noise_off**2, axis=0)) / pixels
    # How much of a pixel's offset is kept: noise takes at most one deviation from it.
    true = 1.0 - ratio(spread, grouped.by_block(off**2) / pixels)[blocks]
    most = ratio(np.sqrt(spread)[blocks], np.abs(off))
    true = np.clip(np.maximum(true, 1.0 - most), 0.0, 1.0)
    # How much of a block's mean is kept, the same for its three channels.
    noise_size = np.mean(noise_middle**2, axis=0).sum(axis=1)
    size = (middle**2).sum(axis=1)
    level = np.clip(1.0 - ratio(noise_size, size), 0.0, 1.0)
    level = level[blocks, None]
    kept = level * middle[blocks] + true * off
    draws: Array = kept + np.sqrt(level) * noise_middle[:, blocks] + np.sqrt(true) * noise_off
    return draws


def _mean(metric: Metric, distances: Floats) -> float:
    """Return the mean of distances, of a linear metric the mean square."""
    return float(np.mean(distances**2) if metric.averages_squares else distances.mean())


@dataclass(frozen=True)
class _Extrapolated:
    """The mean as measured and without noise, and what noise adds to the sum of each block.

    ``gap`` is the difference of the two estimates of the mean, ``noise`` the root of what noise
    adds to the mean square of blocks.
    """

    raw: float
    clean: float
    added: Array
    gap: float
    noise: float

    @classmethod
    def of(
        cls, metric: Pixelwise, distances: Distances, grouped: Grouped, chosen: Sequence[int]
    ) -> _Extrapolated:
        means = grouped.means[chosen]
        sizes = grouped.sizes[chosen]
        mean = np.average(means, axis=0, weights=sizes)
        added_noise = np.tensordot(contrasts(sizes), means, 1)
        plain, *noisy = distances(np.concatenate([mean[None], mean + added_noise]))
        pixels = grouped.by_block(np.ones(len(plain)))
        before = grouped.by_block(plain)
        after = grouped.by_block(np.mean(noisy, axis=0))
        if metric.averages_squares or metric.squared:
            # Noise adds its variance to squares.
            power = 1 if metric.squared else 2
            added = grouped.by_block(np.mean(np.power(noisy, power), axis=0) - plain**power)
            # Light itself is not curved.
            curved = 0.0 if metric.coordinates is linear else 2.0 * CURVATURE
            gap = max(float(curved * added.sum() / pixels.sum()), 0.0)
            noise = 0.0
        else:
            pair = plain**2, np.mean(np.square(noisy), axis=0)
            squares = np.array([grouped.by_block(values) for values in pair])
            # Sums over blocks by both rules; that of a mean square is its root times the pixels.
            lower = without_noise(before, after)
            roots = np.sqrt(squares * pixels)
            upper = np.minimum(without_noise(roots[0], roots[1]), before)
            added = before - (lower + upper) / 2.0
            gap = max(float((upper - lower).sum() / pixels.sum()), 0.0)
            noise = np.sqrt(np.average((after**2 - before**2) / pixels**2, weights=pixels).clip(0))
        raw = _mean(metric, plain)
        return cls(raw, raw - added.sum() / pixels.sum(), added, gap, float(noise))


def sampling_error(added: Array, grouped: Grouped) -> Array:
    """Return the standard error of what noise adds to sums of blocks (B, ...), due to sampling."""
    pixels = grouped.by_block(np.ones(len(grouped.places)))
    # A ratio estimate: each block's scatter about its share by pixels.
    left = added - np.multiply.outer(pixels, added.sum(axis=0) / pixels.sum())
    share = 1.0 - grouped.sampled / grouped.total
    spread = np.sqrt((left**2).sum(axis=0) / max(len(left) - 1, 1))
    error: Array = np.sqrt(share * len(left)) * spread / pixels.sum()
    return error
