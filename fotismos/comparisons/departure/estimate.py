"""Is it more than noise, and how large is it without? The mean distance and the visible shares.

Everything is said of *replicates*: K pictures of one difference (passes, repeats, groups of
either) whose noise is independent. :func:`estimate` gives the mean distance and the share of pixels
above each threshold, each with an interval that holds the truth in 95 % of the cases, and
:func:`fotismos.comparisons.departure.criterion.decide` judges by such a share alone.

A distance of noisy pictures is too large, by an unknown amount where noise is skewed or has heavy
tails. A *signed* difference is right in the mean, whatever its noise is. All lower ends rest on
that.

**Directions.** Half of the replicates guess, at each pixel, in which direction and how far the
pictures differ: ``h`` (3,). The other half is measured along it, ``g = h·G x / |h|`` with the
difference ``x`` and the local metric ``G`` of the distance (``D² ≈ x·G x``, and never more than the
chord). The guess is independent of the noise in ``x``. So the mean of ``g`` over any set of pixels
that the guess selects is at most the mean of their true distances (Cauchy and Schwarz). Guesses are
pooled over tiles of several sizes, as relative differences, since neighbours often depart alike.

**Lower ends.** Of a set with mean ``m`` and variance ``v`` of ``g`` without noise, at least
``(m - t)² / ((m - t)² + v)`` lie above ``t < m`` (Cantelli 1910). And a pixel measured above
``t + k s``, ``s`` its noise, is above ``t``, or its noise is above ``k s``: the share measured
there less that of such noise is proven, too. The largest bound of all sets and factors counts;
constants below say by how many errors each is lowered. Light of rare samples may be missing from
one picture: contributions as large as the largest residual ``e`` in ``n`` pixels of K replicates
add ``e m/(nK)`` to the variance of a mean, as for a Poisson number of them.

**Upper ends.** A pixel above ``t`` is measured above ``t - k s``, or its noise is above ``k s``.
And at most the mean of ``D²/t²`` lies above ``t`` (Markov), of which products of different
replicates are an estimate without bias. The mean is at most that of the roots of ``D²`` without
noise, over pixels or over blocks; noise is taken out of ``D²`` by adding it once more (Cook and
Stefanski, J. Am. Stat. Assoc. 89, 1994).

**Together.** Mean and shares bound each other: ``mean >= ∫ share(t) dt``, ``t share(t) <= mean``,
and ``mean <= t + share(t) (largest - t)``. Shares never rise with the threshold.

**One replicate** shows no noise. Then cells of 4 x 4 pixels take turns as on a chessboard: half of
them guess for the tile, the others are measured. That finds what is alike over a tile, as noise is
not.

Errors are those of sums over blocks of 8 x 8 and of 16 x 16 pixels, the larger of the two: a filter
or a denoiser correlates neighbours. Large pictures are sampled in blocks, at most 16,384 pixels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import hypot, sqrt
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fotismos.comparisons.departure.colour import Array
from fotismos.comparisons.departure.criterion import TOLERANCE
from fotismos.comparisons.departure.metrics import Metric, Pixelwise
from fotismos.comparisons.records.departure import DEFAULT_VIEWING, Viewing, VisibleShare
from fotismos.heuristic.convention import Floats
from fotismos.reference.records import Interval
from fotismos.reference.rendering.sums import BLOCK, Grouped, sample

NoiseShown = Literal["all", "part", "none"]
"""Whether replicates show the noise of both pictures, of one alone, or of none."""

MOST_CONTRASTS = 3
"""Noise is made of the replicates in this many independent ways, at most."""

FINEST = -1
TILE_SIDES = (1, 2, 4, 8, 16, 0, FINEST)
"""Sides in pixels of the tiles over which guesses are pooled; 0 is the whole picture, FINEST a
guess of all sizes."""

GARROTE = 3.0
"""How many times its noise's variance is taken off what a tile adds to a guess."""

COUNTED_SIDES = (1, FINEST)
"""Those whose sets' pixels are counted, too: their guesses tell neighbours apart."""

THRESHOLD_PARTS = (0.1, 0.25, 0.5, 0.75)
"""Parts of a threshold, by which a pixel may be measured wrong."""

GUESSED_LEVELS = (0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 5.0)
"""A set holds the pixels whose guessed distance is at least one of these, over the threshold."""

NOISY_GUESSED_LEVELS = ((0.5, 1.0), (0.5, 2.0), (0.5, 3.0), (1.0, 1.0), (1.0, 2.0), (1.0, 3.0))
"""Further sets: so far above a level by so many errors of the guess."""

NOISE_DEVIATIONS = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0)
"""How many deviations of a pixel's noise it is measured beyond a threshold."""

FEWEST_PIXELS = 24
"""Pixels of the smallest set: fewer have no normal mean."""

FEWEST_REPLICATES = 4
"""Fewest replicates that show how noise is distributed."""

CELL = 4
"""Side in pixels of the chessboard's cells."""

MEAN_LOW_ERRORS = 3.5
MEAN_HIGH_ERRORS = 2.6
"""Standard errors by which the ends of a mean are moved outwards."""

SET_MEAN_ERRORS = 1.5
SET_VARIANCE_ERRORS = 0.1
FEW_REPLICATES_ERRORS = 1.2
"""The same of a set's mean, and of its variance, for shares by Cantelli's inequality, which leaves
far more room than its errors take; the last is added, over the number of replicates."""

COUNT_LOW_ERRORS = 1.5
SHARE_HIGH_ERRORS = 2.0
"""The same of shares by counts, and of upper ends of shares."""

ROOT_BIAS = 0.3
"""How much the mean of the signed root of ``D² + s Z``, Z normal, may lack of D, in units of √s."""

FLOOR_MARGIN = 1.25
"""Factor by which a noise floor, itself an estimate, may be too small."""

DIRECTION_BIAS = 0.02
"""How wrong a direction's measure may be, in units of a pixel's noise: colour spaces are curved."""

SQUARE_NOISE_BIAS = 0.08
"""Uncertainty of the noise in a mean square, as a share of it, for the same reason."""

LEAST_SHARE = 0.003
"""Taken off the lower ends of shares: fewer pixels prove nothing."""

TAILS_WHERE_DIFFERENT = 3.0
"""How much more often than elsewhere noise may be large at the pixels that differ."""

DERIVATIVE_STEP = 1e-3
"""Relative step of the numerical derivative."""

LIGHT_ADDED = 0.02
"""Light that is added to a pixel's, where differences are relative."""

TINY = 1e-30
ROUNDING = 1e-12
"""Relative differences of replicates that are rounding."""


@dataclass(frozen=True)
class Replicates:
    """K replicates of the difference of a test picture from a reference, at P pixels.

    ``shown`` (P, 3) is the test picture there, ``differences`` (K, P, 3) are the replicates, each
    the mean of ``sizes`` (K,) passes; ``rows`` and ``columns`` (P,) are the pixels. ``sampled`` is
    the share of the picture's blocks that they are drawn from. ``noise_shown`` says whose noise
    they show: what they do not show counts as a difference, and so it is in no lower end.
    """

    shown: Array
    differences: Array
    sizes: Array
    rows: NDArray[Any]
    columns: NDArray[Any]
    sampled: float = 1.0
    noise_shown: NoiseShown = "all"

    @classmethod
    def of(cls, test: Array, grouped: Grouped, noise_shown: NoiseShown = "all") -> Replicates:
        """Return the groups of passes of a comparison; ``test`` (H, W, 3) is linear."""
        rows, columns = np.divmod(grouped.places, test.shape[1])
        return cls(
            shown=test.reshape(-1, 3)[grouped.places].astype(np.float64),
            differences=grouped.means,
            sizes=np.asarray(grouped.sizes, float),
            rows=rows,
            columns=columns,
            sampled=grouped.sampled / max(grouped.total, 1),
            noise_shown=noise_shown,
        )

    @classmethod
    def of_images(
        cls,
        test: ArrayLike,
        reference: ArrayLike,
        counted: NDArray[np.bool_],
        noise_shown: NoiseShown = "all",
    ) -> Replicates:
        """Return replicates of pictures (K, H, W, 3), of which one may be single, (H, W, 3).

        A single one is taken as given: its noise is a difference. Of two sides with K pictures,
        those of one number belong together, so that common random numbers cancel.
        """
        places, blocks, total = sample(counted)
        sides = [
            np.reshape(np.asarray(side, float), (-1, counted.size, 3))[:, places]
            for side in (test, reference)
        ]
        differences = sides[0] - sides[1]
        rows, columns = np.divmod(places, counted.shape[1])
        return cls(
            shown=sides[0].mean(axis=0),
            differences=differences,
            sizes=np.ones(len(differences)),
            rows=rows,
            columns=columns,
            sampled=len(np.unique(blocks)) / max(total, 1),
            noise_shown=noise_shown,
        )

    @cached_property
    def mean(self) -> Array:
        """The mean difference (P, 3)."""
        return np.asarray(np.average(self.differences, axis=0, weights=self.sizes))

    @cached_property
    def noise(self) -> Array:
        """Noise (C, P, 3) as large as that of the mean; none (C = 0) of one replicate."""
        return np.asarray(np.tensordot(contrasts(self.sizes), self.differences, 1))

    @property
    def as_one(self) -> Replicates:
        """The mean, as if there were no replicates of it."""
        return replace(self, differences=self.mean[None], sizes=np.ones(1))


@dataclass(frozen=True)
class Estimate:
    """A mean distance without noise, and the shares of pixels above thresholds, with intervals."""

    mean: Interval
    visible: tuple[VisibleShare, ...]


def estimate(
    metric: Pixelwise,
    replicates: Replicates,
    viewing: Viewing = DEFAULT_VIEWING,
    measured: Floats | None = None,
) -> Estimate:
    """Return a metric's mean and shares without noise.

    ``measured`` (N,) are the distances of all counted pixels, if replicates are a sample of them.
    """
    if replicates.noise_shown == "none":
        replicates = replicates.as_one
    evidence = Evidence(metric=metric, viewing=viewing, replicates=replicates)
    whole = evidence.measured if measured is None else np.asarray(measured)
    return evidence.estimate(whole)


def by_floor(metric: Metric, values: Floats, noise: Floats) -> Estimate:
    """Return a metric without noise by the triangle inequality, for metrics of neighbourhoods.

    ``values`` (N,) are its distances, and ``noise`` (N,) those of noise alone: the error of a mean
    distance is at most the distance of the reference from the truth. Noise is taken to add its
    square. A pixel's noise is not the one that it has here, so shares are bounded by its share.
    """
    power = 2 if metric.squared else 1
    mean = metric.mean(values) ** (1 / power)
    floor = metric.mean(noise) ** (1 / power)
    half = FLOOR_MARGIN * floor
    low = max(mean - half, 0.0)
    value = max(sqrt(max(mean**2 - floor**2, 0.0)), low)
    thresholds = np.asarray(metric.visible, float)
    share = shares_above(values, thresholds)
    # Without noise the share is what it is; with noise, any share is possible at first.
    least = [np.zeros(len(share)) if noise.any() else share]
    most = [np.ones(len(share)) if noise.any() else share]
    for part in THRESHOLD_PARTS:
        # A pixel is wrong by this part of a threshold only where its noise is as large.
        hidden = shares_above(FLOOR_MARGIN * noise, part * thresholds)
        least.append(shares_above(values, (1.0 + part) * thresholds) - hidden)
        most.append(shares_above(values, (1.0 - part) * thresholds) + hidden)
    ends = np.array([value, low, mean + half]) ** power
    return _result(metric, ends, np.array([share, np.max(least, axis=0), np.min(most, axis=0)]))


@dataclass(frozen=True)
class Selection:
    """A set of pixels that some replicates select and others measure.

    ``share`` is its part of the pixels, ``mean`` that of the measured distances, ``error`` its
    standard error; ``variance`` is that of the distances without noise, ``variance_error`` its
    error.
    """

    share: float
    mean: float
    error: float
    variance: float
    variance_error: float


@dataclass(frozen=True)
class Guess:
    """Guessed distances and their measurement by other replicates or pixels, (P,) each.

    ``distance`` is guessed, with an error of ``deviation``. ``measured`` and ``noise`` (C, P) lie
    along the guessed difference. ``used`` says which pixels were measured, by a part of the
    replicates, whose noise is ``scale`` times as large; ``own`` is its variance, and ``near`` that
    of its neighbours.
    """

    distance: Array
    measured: Array
    noise: Array
    own: Array
    deviation: Array
    used: NDArray[np.bool_]
    near: Array
    scale: float


@dataclass(frozen=True)
class Evidence:
    """All that replicates prove of a metric's distances."""

    metric: Pixelwise
    viewing: Viewing
    replicates: Replicates

    def estimate(self, whole: Floats) -> Estimate:
        """Return mean and shares; ``whole`` (N,) are the distances of all counted pixels."""
        thresholds = np.asarray(self.metric.visible, float)
        if not len(self.replicates.shown) or self._is_exact:
            shares = shares_above(whole, thresholds)
            return _result(self.metric, np.full(3, self.metric.mean(whole)), np.array([shares] * 3))
        value, high = self._mean_and_high(whole)
        if self.metric.averages_squares or self.metric.squared:
            mean = np.maximum([value, 2.0 * value - high, high], 0.0)
            if self.metric.averages_squares:
                mean = np.sqrt(mean)
            return _result(self.metric, mean, np.zeros((3, len(thresholds))))
        # Noise that is not shown looks like a difference: only what is alike over tiles is proven.
        proven = self
        if self.replicates.noise_shown != "all":
            proven = replace(self, replicates=self.replicates.as_one)
        low = min(proven.mean_low(), high)
        margin = self._sampling_errors(thresholds)
        span = np.maximum(self._largest_distance - thresholds, TINY)
        # No share is proven where the mean may be 0.
        least = np.zeros(len(thresholds))
        if low > 0.0:
            least = proven.shares_low(thresholds) - margin - LEAST_SHARE
        ends = [
            self._shares_without_noise(whole, thresholds),
            np.maximum(least, (low - thresholds) / span),
            self.shares_high(whole, thresholds) + margin,
        ]
        return _result(self.metric, np.array([value, low, high]), np.array(ends))

    # --- Distances --------------------------------------------------------------------------------

    @property
    def _is_exact(self) -> bool:
        """Whether replicates that show all noise show none."""
        replicates = self.replicates
        differences = replicates.differences
        if replicates.noise_shown != "all" or len(differences) < 2:
            return False
        return bool(np.ptp(differences, axis=0).max() <= ROUNDING * np.abs(differences).max())

    @cached_property
    def _batch(self) -> tuple[Array, Array]:
        """Squared distances (6, P) along steps, and distances (1 + 2 C, P) of noisy means."""
        replicates = self.replicates
        directions = np.concatenate([np.eye(3), np.eye(3)[[0, 0, 1]] + np.eye(3)[[1, 2, 2]]])
        steps = directions[:, None] * self._step[:, None]
        mean = replicates.mean
        noisy = [mean[None], mean + replicates.noise, mean - replicates.noise]
        distances = self._distances(np.concatenate([steps, *noisy]))
        return np.square(distances[:6] / self._step), distances[6:]

    def _distances(self, differences: Array) -> Array:
        """Return the distances (...) of references by their differences (..., P, 3)."""
        shown = self.replicates.shown
        references = self.metric.coordinates(shown - differences, self.viewing)
        own = np.broadcast_to(self.metric.coordinates(shown, self.viewing), references.shape)
        distances = self.metric.difference(references, own)
        return np.asarray(np.sqrt(distances) if self.metric.squared else distances)

    @property
    def _step(self) -> Array:
        return np.asarray(DERIVATIVE_STEP * (self.replicates.shown.mean(axis=-1) + LIGHT_ADDED))

    @property
    def measured(self) -> Array:
        """The distances (P,) of the mean."""
        _, distances = self._batch
        plain: Array = distances[0]
        return plain

    @property
    def _noisier(self) -> Array:
        """The distances (2, C, P) with noise added to the mean, and taken off it."""
        _, distances = self._batch
        return distances[1:].reshape(2, -1, distances.shape[1])

    @cached_property
    def _tensor(self) -> Array:
        """The local metric (P, 3, 3): ``D² = x·G x`` of small ``x``."""
        squares, _ = self._batch
        tensor = np.zeros((squares.shape[1], 3, 3))
        for axis in range(3):
            tensor[:, axis, axis] = squares[axis]
        for number, (i, j) in enumerate(((0, 1), (0, 2), (1, 2)), start=3):
            mixed = (squares[number] - squares[i] - squares[j]) / 2.0
            tensor[:, i, j] = mixed
            tensor[:, j, i] = mixed
        return tensor

    def _sizes(self, differences: Array) -> Array:
        """Return the lengths (...) of differences (..., P, 3) in the local metric."""
        squares = np.einsum("...i,...i->...", differences, self._through(differences))
        return np.asarray(np.sqrt(np.maximum(squares, 0.0)))

    def _through(self, differences: Array) -> Array:
        """Return ``G x`` of differences (..., P, 3)."""
        return np.asarray(np.einsum("pij,...pj->...pi", self._tensor, differences))

    @cached_property
    def _noise_sizes(self) -> Array:
        """The lengths (C, P) of the noise."""
        return self._sizes(self.replicates.noise)

    @cached_property
    def _largest_residual(self) -> float:
        """The largest residual of a replicate: one contribution that others may lack."""
        differences = self.replicates.differences
        count = len(differences)
        if count < 2:
            return 0.0
        residuals = differences - differences.mean(axis=0)
        return float(self._sizes(residuals).max()) * sqrt(count / (count - 1))

    @cached_property
    def _unseen(self) -> Array:
        """How far (P,) a pixel may be off by light that rare samples brought elsewhere."""
        differences = self.replicates.differences
        light = self.replicates.shown + LIGHT_ADDED
        lacking = (np.median(differences, axis=0) - differences.mean(axis=0)) / light
        largest = 3.0 * self._largest_residual / (len(differences) * len(light))
        return self._sizes(lacking.mean(axis=0) * light) + largest

    @property
    def _largest_distance(self) -> float:
        """The largest distance that a pixel may have."""
        return float(self.measured.max() + self._noise_sizes.max(initial=0.0))

    # --- The mean ---------------------------------------------------------------------------------

    @cached_property
    def _squares(self) -> Array:
        """Squared distances (P,) without noise, which may be negative."""
        before: Array = np.square(self.measured)
        if not len(self.replicates.noise):
            return before
        return np.asarray(2.0 * before - np.square(self._noisier).mean(axis=(0, 1)))

    def _mean_and_high(self, whole: Floats) -> tuple[float, float]:
        """Return the mean without noise and its upper end; of squares if the metric's are."""
        is_square = self.metric.averages_squares or self.metric.squared
        plain = np.square(self.measured) if is_square else self.measured
        squares_given = self.metric.averages_squares
        raw = float(np.mean(np.square(whole) if squares_given else whole, dtype=np.float64))
        count = len(plain)
        if not len(self.replicates.noise):
            return raw, raw
        added, taken = np.square(self._noisier) if is_square else self._noisier
        own = self._block_squares((added - taken) / 2.0) / count**2
        if is_square:
            bias = plain - self._squares
            error = sqrt(own + self._scatter(bias))
            # Light itself is not curved.
            value = raw - float(bias.mean())
            return value, value + MEAN_HIGH_ERRORS * error + SQUARE_NOISE_BIAS * max(
                float(bias.mean()), 0.0
            )
        # First upper end: the mean of roots, of blocks or of pixels, whichever is larger.
        squares = self._squares
        blocks = self._tiles(BLOCK)
        of_blocks = _root(_pooled(squares, blocks))
        # The mean of roots of noisy squares is too small where the true ones are.
        along = (np.square(added) - np.square(taken)) / 2.0
        variance = np.mean([np.square(_pooled(values, blocks)) for values in along], axis=0)
        sizes = np.bincount(blocks)[blocks]
        variance += 2.0 * _pooled(np.square(plain**2 - squares), blocks) / sizes
        lost = ROOT_BIAS * float(np.sqrt(np.sqrt(variance)).mean())
        error = sqrt(own + self._scatter(plain - of_blocks))
        roots = max(float(of_blocks.mean()), float(_root(squares).mean()))
        # Second: no mean is larger than the root of the mean square.
        whole_error = sqrt(self._block_squares(along)) / count
        largest = sqrt(max(float(squares.mean()) + MEAN_HIGH_ERRORS * whole_error, 0.0))
        largest = min(roots + lost + MEAN_HIGH_ERRORS * error, largest)
        largest = hypot(
            largest, sqrt(SQUARE_NOISE_BIAS * max(float((plain**2 - squares).mean()), 0.0))
        )
        # Third: noise makes distances larger in the mean, not smaller.
        largest = min(largest, float(plain.mean()) + MEAN_HIGH_ERRORS * sqrt(own))
        # The value: the middle of two rules. One takes off too much where noise lies along the
        # difference, the other too little where a block's pixels are not alike.
        before = _pooled(plain, blocks)
        after = _pooled(self._noisier.mean(axis=(0, 1)), blocks)
        lower = _root(2.0 * np.square(before) - np.square(after))
        middle = float((lower + np.minimum(of_blocks, before)).mean()) / 2.0
        # The sample's mean is not quite that of all pixels.
        shift = raw - float(plain.mean())
        return max(middle + shift, 0.0), max(largest + shift, 0.0)

    def mean_low(self) -> float:
        """Return a lower bound of the mean distance."""
        selections, _ = self._evidence
        # Pixels outside of a set are at least 0 apart, so each set bounds the mean of all.
        bounds = [
            chosen.share * (chosen.mean - MEAN_LOW_ERRORS * chosen.error) for chosen in selections
        ]
        return max([0.0, *bounds])

    # --- Shares -----------------------------------------------------------------------------------

    def shares_low(self, thresholds: Array) -> Array:
        """Return lower bounds (T,) of the shares of pixels above thresholds."""
        selections, counts = self._evidence
        bounds = [np.zeros(len(thresholds)), *counts]
        # Few replicates say little of how large noise is.
        errors = SET_VARIANCE_ERRORS + FEW_REPLICATES_ERRORS / len(self.replicates.differences)
        for chosen in selections:
            # Cantelli: `(m - t)² / ((m - t)² + v)` of the set lie above t.
            beyond = np.maximum(chosen.mean - SET_MEAN_ERRORS * chosen.error - thresholds, 0.0) ** 2
            variance = chosen.variance + errors * chosen.variance_error
            bounds.append(chosen.share * beyond / np.maximum(beyond + variance, TINY))
        return np.asarray(np.max(bounds, axis=0))

    def shares_high(self, whole: Floats, thresholds: Array) -> Array:
        """Return upper bounds (T,) of the shares of pixels above thresholds."""
        pixels = len(self.measured)
        if not len(self.replicates.noise):
            return shares_above(whole, thresholds)
        noise_sizes = self._noise_sizes
        deviation = np.sqrt(_pooled(np.square(noise_sizes).mean(axis=0), self._tiles(BLOCK)))
        correlation = self._correlation

        def bound(shares: Array, chance: Array | float) -> Array:
            """Return the end where ``shares`` are measured above and noise hides a ``chance``."""
            spread = np.maximum(shares, 1.0 / pixels) * np.maximum(chance, 1.0 / pixels)
            error = np.sqrt(correlation * spread / pixels)
            return np.asarray((shares + SHARE_HIGH_ERRORS * error) / (1.0 - chance))

        bounds = []
        # By noise over its deviation nearby, then by noise over a part of the threshold.
        for factor in NOISE_DEVIATIONS:
            chance = TAILS_WHERE_DIFFERENT * float((noise_sizes > factor * deviation).mean())
            if chance < 0.5:
                shares = shares_above(self.measured + factor * deviation, thresholds)
                bounds.append(bound(shares, chance))
        for part in THRESHOLD_PARTS:
            hidden = TAILS_WHERE_DIFFERENT * shares_above(noise_sizes.ravel(), part * thresholds)
            shares = shares_above(self.measured, (1.0 - part) * thresholds)
            bounds.append(bound(shares, np.minimum(hidden, 0.9)))
        # Markov's inequality.
        bounds.append(self._mean_square_high() / thresholds**2)
        high = np.min([np.ones(len(thresholds)), *bounds], axis=0)
        is_few = len(self.replicates.differences) < FEWEST_REPLICATES
        if is_few or self.replicates.noise_shown == "part":
            # They do not show how all noise is distributed: as much may hide a difference.
            high = np.maximum(
                high, shares_above(self.measured + noise_sizes.max(axis=0), thresholds)
            )
        return np.asarray(high)

    def _mean_square_high(self) -> float:
        """Return an upper end of the mean squared distance, by products of replicates."""
        differences = self.replicates.differences
        count = len(differences)
        mean = differences.mean(axis=0)
        own = np.square(self._sizes(differences)).sum(axis=0)
        # The products of different ones: the square of the sum less the squares of each.
        squares = (np.square(count * self._sizes(mean)) - own) / (count * (count - 1))
        along = 2.0 * np.einsum("pi,cpi->cp", self._through(mean), self.replicates.noise)
        error = sqrt(self._block_squares(along)) / len(squares)
        near = max(float(squares.mean()), 0.0) + SHARE_HIGH_ERRORS * error
        # The local metric does not hold for large differences: those count as they are.
        added, taken = self._noisier
        odd = (np.square(added) - np.square(taken)) / 2.0
        error = sqrt(self._block_squares(odd)) / len(squares)
        far = max(float(self._squares.mean()), 0.0) + SHARE_HIGH_ERRORS * error
        return max(near, far)

    def _shares_without_noise(self, whole: Floats, thresholds: Array) -> Array:
        """Return the shares (T,) whose distances, shrunk towards their blocks', are above."""
        plain = self.measured
        noise = self._noisier
        if not noise.size:
            return shares_above(whole, thresholds)
        blocks = self._tiles(BLOCK)
        squares = self._squares
        # How much of the scatter within a block is noise: Stein's factor.
        # What changes sign with the noise goes with the difference; the rest is noise squared.
        odd = (np.square(noise[0]) - np.square(noise[1])) / 2.0
        variance = _pooled(np.square(odd).mean(axis=0), blocks)
        variance += 2.0 * _pooled(np.square(plain**2 - squares), blocks)
        middle = _pooled(squares, blocks)
        scatter = _pooled(np.square(squares - middle), blocks)
        kept = np.clip(1.0 - variance / np.maximum(scatter, TINY), 0.0, 1.0)
        clean = _root(middle + kept * (squares - middle))
        added = shares_above(plain, thresholds) - shares_above(clean, thresholds)
        return np.clip(shares_above(whole, thresholds) - added, 0.0, 1.0)

    def _sampling_errors(self, thresholds: Array) -> Array:
        """Return the errors (T,) of shares because only some blocks are measured."""
        if self.replicates.sampled >= 1.0:
            return np.zeros(len(thresholds))
        blocks = np.unique(self._tiles(BLOCK), return_inverse=True)[1]
        sizes = np.bincount(blocks)
        left = np.zeros((len(thresholds), len(sizes)))
        for above, row in zip(self.measured > thresholds[:, None], left, strict=True):
            row[:] = np.bincount(blocks, above) - sizes * above.mean()
        scatter = np.square(left).sum(axis=1) * (1.0 - self.replicates.sampled)
        return SHARE_HIGH_ERRORS * np.asarray(np.sqrt(scatter)) / len(self.measured)

    # --- Guesses ----------------------------------------------------------------------------------

    @cached_property
    def _evidence(self) -> tuple[list[Selection], list[Array]]:
        """The sets of all tiles and levels that hold enough pixels, and shares (T,) by counts."""
        selections = []
        counts: list[Array] = []
        is_single = len(self.replicates.differences) == 1
        unit = TOLERANCE if self.metric.visible else max(float(self.measured.mean()), TINY)
        for side in TILE_SIDES:
            if is_single and side and side < 2 * CELL:
                continue
            guesses = [self._guess(side, turn) for turn in range(len(self._turns))]
            levels = [(level, 0.0) for level in GUESSED_LEVELS]
            if not is_single:
                levels += NOISY_GUESSED_LEVELS
            for level, errors in levels:
                chosen = [
                    guess.used & (guess.distance >= level * unit + errors * guess.deviation)
                    for guess in guesses
                ]
                if sum(map(np.count_nonzero, chosen)) >= FEWEST_PIXELS * len(guesses):
                    selections.append(self._selection(guesses, chosen))
                    if side in COUNTED_SIDES and errors == 0.0 and not is_single:
                        bounds = [self._counts(*pair) for pair in zip(guesses, chosen, strict=True)]
                        counts.extend(np.mean(bounds, axis=0))
        return selections, counts

    def _selection(self, guesses: list[Guess], chosen: list[NDArray[np.bool_]]) -> Selection:
        """Return the sums over a set, of all turns together."""
        turns = len(guesses)
        pairs = list(zip(guesses, chosen, strict=True))
        pixels = sum(np.count_nonzero(inside) for inside in chosen)
        used = sum(np.count_nonzero(guess.used) for guess in guesses)
        mean = sum(guess.measured[inside].sum() for guess, inside in pairs) / pixels
        square = sum((guess.measured**2 - guess.own)[inside].sum() for guess, inside in pairs)
        noise = np.sum([guess.noise * inside for guess, inside in pairs], axis=0)
        # The variance of the sum, and how much more it is than that of independent pixels.
        spread = self._block_squares(noise)
        own = [np.mean(guess.noise**2, axis=0)[inside] for guess, inside in pairs]
        correlation = max(1.0, spread / max(turns * sum(v.sum() for v in own), TINY))
        # Of squares of normal variables: `4 g² σ² + 2 σ⁴`.
        of_squares = sum(
            (4.0 * np.maximum(guess.measured[inside] ** 2 - v, 0.0) * v + 2.0 * v**2).sum()
            for (guess, inside), v in zip(pairs, own, strict=True)
        )
        noise_size = sum(np.sqrt(v).sum() for v in own) / pixels
        count = len(self.replicates.differences)
        # Light of rare samples, in contributions as large as the largest residual.
        missing = self._largest_residual * max(mean, 0.0) * turns / (pixels * count)
        return Selection(
            share=pixels / used,
            mean=float(mean) - DIRECTION_BIAS * noise_size,
            error=sqrt(spread / pixels**2 + missing),
            variance=max(float(square / pixels - mean**2), 0.0),
            variance_error=sqrt(correlation * of_squares * turns) / pixels,
        )

    def _counts(self, guess: Guess, inside: NDArray[np.bool_]) -> list[Array]:
        """Return lower bounds (T,) of shares, by a set's pixels measured beyond their noise."""
        total = len(inside)
        measured = guess.measured[inside]
        if len(measured) < FEWEST_PIXELS:
            return [np.zeros(len(self.metric.visible))] * len(NOISE_DEVIATIONS)
        noise = np.concatenate([guess.noise[:, inside], -guess.noise[:, inside]]) * guess.scale
        deviation = np.sqrt(guess.near[inside])
        share = len(measured) / total
        unseen = self._unseen[inside]
        bounds = []
        for factor in NOISE_DEVIATIONS:
            chance = float((noise > factor * deviation).mean())
            beyond = measured - factor * deviation - unseen
            shares = share * shares_above(beyond, self.metric.visible)
            false = share * max(chance, 1.0 / len(measured))
            error = sqrt(2.0 * self._correlation * false / total)
            proven = shares - share * chance - COUNT_LOW_ERRORS * error
            bounds.append(proven / max(1.0 - chance, TINY))
        return bounds

    @cached_property
    def _turns(self) -> list[tuple[NDArray[np.bool_], NDArray[np.bool_]]]:
        """Which replicates (K,) guess, and at which pixels (P,); all others are measured."""
        replicates = self.replicates
        count = len(replicates.differences)
        if count == 1:
            cells = (replicates.rows // CELL + replicates.columns // CELL) % 2 == 0
            only = np.ones(1, bool)
            return [(only, cells), (only, ~cells)]
        numbers = np.arange(count)
        everywhere = np.ones(len(replicates.rows), bool)
        splits = [numbers % 2 == 0]
        if count >= 4:
            splits.append(numbers // 2 % 2 == 0)
        return [(half, everywhere) for first in splits for half in (first, ~first)]

    @cached_property
    def _cleaned(self) -> tuple[Array, Array]:
        """A guess (T, P, 3) of each turn, of all sizes, and how much its distance bends, (T, P).

        The distance is never more than its tangent or its chord. What is measured later has no part
        in it: else bright noise would count less than dark noise.
        """
        light = self.replicates.shown + LIGHT_ADDED
        guesses = []
        for guessing, seen in self._turns:
            relative = self._source(guessing) / light
            if guessing.all():
                guesses.append(_pooled(relative, self._tiles(2 * CELL), weight=seen) * light)
                continue
            scale = sqrt(len(guessing) / np.count_nonzero(guessing))
            guesses.append(self._clean(relative, self.replicates.noise * scale / light) * light)
        cleaned = np.array(guesses)
        bends = self._distances(cleaned) / np.maximum(self._sizes(cleaned), 1e-12)
        return cleaned, np.minimum(bends, 1.0)

    def _source(self, guessing: NDArray[np.bool_]) -> Array:
        return np.asarray(self.replicates.differences[guessing].mean(axis=0))

    def _guess(self, side: int, turn: int) -> Guess:
        """Let some replicates, or some pixels of one, guess; measure the others."""
        replicates = self.replicates
        guessing, seen = self._turns[turn]
        cleaned, bends = self._cleaned
        bend = bends[turn]
        is_single = len(replicates.differences) == 1
        light = replicates.shown + LIGHT_ADDED
        guess = cleaned[turn]
        if side != FINEST:
            tiles = self._tiles(side)
            guess = _pooled(self._source(guessing) / light, tiles, weight=seen) * light
        through = self._through(guess)
        length = np.sqrt(np.maximum(np.einsum("pi,pi->p", guess, through), 0.0))
        direction = through * (bend / np.maximum(length, 1e-12))[:, None]
        measuring = guessing if is_single else ~guessing
        along = np.einsum("pi,kpi->kp", direction, replicates.differences[measuring])
        measured = along.mean(axis=0)
        count = len(along)
        scale = sqrt(len(replicates.differences) / count)
        used = seen
        if is_single:
            # The scatter around the mean of a wide tile is all that tells of noise.
            used = ~seen
            wide = self._tiles(2 * BLOCK)
            noise = np.where(used, measured - _pooled(measured, wide, weight=used), 0.0)[None]
            near = np.zeros(len(seen))
        else:
            noise = np.einsum("pi,cpi->cp", direction, replicates.noise)
            near = _pooled(np.mean(noise**2, axis=0), self._tiles(BLOCK)) * scale**2
        return Guess(
            distance=length * bend,
            measured=measured,
            noise=noise,
            own=along.var(axis=0, ddof=1) / count if count > 1 else near,
            deviation=np.sqrt(near) / max(side, 1),
            used=used,
            near=near,
            scale=scale,
        )

    def _clean(self, relative: Array, noise: Array) -> Array:
        """Return relative differences (P, 3) without most of their noise, (C, P, 3).

        What a tile adds to the next larger one is kept as far as it exceeds its noise (Breiman's
        garrote, Technometrics 37, 1995).
        """
        clean = np.zeros_like(relative)
        noisy = np.zeros_like(noise)
        wide = self._tiles(2 * BLOCK)
        for side in (0, 16, 8, 4, 2, 1):
            tiles = self._tiles(side)
            step = _pooled(relative, tiles) - clean
            means = np.stack([_pooled(values, tiles) for values in noise])
            variance = _pooled(np.square(means - noisy).sum(axis=-1).mean(axis=0), wide)
            kept = 1.0 - GARROTE * variance / np.maximum(np.square(step).sum(axis=-1), TINY)
            clean = clean + np.clip(kept, 0.0, 1.0)[:, None] * step
            noisy = means
        return clean

    # --- Tiles ------------------------------------------------------------------------------------

    def _tiles(self, side: int) -> NDArray[np.int64]:
        """Return the number of each pixel's tile, (P,); 0 is the side of the whole picture."""
        replicates = self.replicates
        if not side:
            return np.zeros(len(replicates.rows), np.int64)
        across = int(replicates.columns.max()) // side + 1
        return np.asarray(replicates.rows // side * across + replicates.columns // side)

    def _block_squares(self, noise: Array) -> float:
        """Return the variance of the sum of noise (C, P), by blocks whose noise is independent."""
        largest = 0.0
        is_single = len(self.replicates.differences) == 1
        # The noise that one replicate shows adds up to 0 over tiles of `2 BLOCK`: smaller ones.
        for side in (CELL, BLOCK) if is_single else (BLOCK, 2 * BLOCK):
            tiles = self._tiles(side)
            sums = np.array([np.bincount(tiles, weights=values) for values in noise])
            largest = max(largest, float(np.square(sums).sum(axis=1).mean()))
        return largest

    @cached_property
    def _correlation(self) -> float:
        """The variance of the sum of the noise over that of independent pixels; at least 1."""
        replicates = self.replicates
        noise = (replicates.noise / (replicates.shown + LIGHT_ADDED)).sum(axis=-1)
        own = max(float(np.square(noise).sum(axis=1).mean()), TINY)
        return max(1.0, self._block_squares(noise) / own)

    def _scatter(self, values: Array) -> float:
        """Return the variance of the mean of values (P,) by that of their sums over blocks."""
        sums = np.bincount(self._tiles(BLOCK), weights=values - values.mean())
        return float(np.square(sums).sum()) / len(values) ** 2


def _result(metric: Metric, mean: Array, shares: Array) -> Estimate:
    """Return mean (3,) and shares (3, T) as an estimate: value, low, high of each.

    Ends of shares are moved inwards as far as other thresholds and the mean prove, and the mean's
    low end as far as the shares do: the mean of a distance is the integral of the shares above it.
    """
    value, low, high = mean.tolist()
    thresholds = np.asarray(metric.visible, float)
    share, least, most = np.clip(shares, 0.0, 1.0)
    least = np.maximum.accumulate(least[::-1])[::-1]
    if not (metric.averages_squares or metric.squared):
        low = max(low, float(least @ np.diff(thresholds, prepend=0.0)))
        high = max(low, high)
        most = np.minimum(most, high / np.maximum(thresholds, TINY))
    most = np.maximum(np.minimum.accumulate(most), least)
    share = np.clip(np.minimum.accumulate(share), least, most)
    rows = zip(metric.visible, share.tolist(), least.tolist(), most.tolist(), strict=True)
    return Estimate(
        mean=Interval(value=min(max(value, low), high), low=low, high=high),
        visible=tuple(
            VisibleShare(threshold=threshold, value=middle, low=lowest, high=highest)
            for threshold, middle, lowest, highest in rows
        ),
    )


def shares_above(distances: Floats, thresholds: Sequence[float] | Array) -> Array:
    """Return the share of distances (N,) above each threshold, (T,), which rise; 0 of none."""
    # Counts by the number of thresholds strictly below, summed from the top.
    counts = np.bincount(np.searchsorted(thresholds, distances), minlength=len(thresholds) + 1)
    return np.asarray(counts[:0:-1].cumsum()[::-1] / max(len(distances), 1))


def contrasts(sizes: Array) -> Array:
    """Return weights (m, K) of groups that make noise from their means, as large as the mean's.

    They are orthogonal to each other and add up to 0; their squares over the sizes add up to one
    over the number of passes.
    """
    count = len(sizes)
    # In units of each group's own deviation the weights of the mean are as `√sizes`: QR keeps
    # their direction as the first column, and makes the others orthogonal to it.
    waves = np.cos(np.pi * np.outer(np.arange(count) + 0.5, np.arange(count)) / count)
    waves[:, 0] = np.sqrt(sizes)
    basis, _ = np.linalg.qr(waves)
    weights: Array = basis[:, 1 : 1 + MOST_CONTRASTS] * np.sqrt(sizes / sizes.sum())[:, None]
    return weights.T


def _root(squares: Array) -> Array:
    """Return roots with the sign of what they are of."""
    return np.asarray(np.sign(squares) * np.sqrt(np.abs(squares)))


def _pooled(
    values: Array, tiles: NDArray[np.int64], weight: NDArray[np.bool_] | None = None
) -> Array:
    """Return the mean over each pixel's tile, of values (P, ...) at the pixels that count."""
    weights = np.ones(len(values)) if weight is None else weight.astype(float)
    pixels = np.maximum(np.bincount(tiles, weights=weights), 1e-12)
    columns = values.reshape(len(values), -1).T
    sums = np.stack([np.bincount(tiles, weights=weights * column) for column in columns], axis=-1)
    return np.asarray((sums / pixels[:, None])[tiles].reshape(values.shape))
