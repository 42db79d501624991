"""The price of a scene: the samples that pass, the effects needed, and what a plan saves.

**Samples.** With few samples a picture is noisy, and fails where the noise alone is visible. How
noisy it is cannot be computed from one count: samples of a pass are stratified, so noise does not
fall as ``1 / √n``. So pictures of 4, 16 and 64 samples are rendered, each with its own seed, and
means of passes of 64 make pictures of 256. The picture that is judged is the converged reference
plus the deviation of the difference of both halves, which trace the same rays: edges, which both
share, cancel, and channels share their noise. ``j`` of ``K`` passes deviate from the others by more
than from the truth, by ``√(K / (K − j))``. Beyond 256 the deviation is scaled: by ``1 / √n``, and
where halves of the passes show that noise falls more slowly, between that and what they show. Where
it falls so slowly that bright paths are rare, what no pass has seen is unknown: more samples may be
needed (`HEAVY`).

**Effects.** Causes render images in which some effects are simulated. The fewest with which an
image surely passes are needed; what is not among them may be left out. Images are compared with the
one in which all are simulated, with which they share paths and most of the noise.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np
from msgspec import structs

from fotismos.comparisons.departure.criterion import LIMIT
from fotismos.comparisons.departure.estimate import shares_above
from fotismos.comparisons.departure.metrics import LEADING, THRESHOLDS, Pixelwise
from fotismos.comparisons.departure.noise import USUAL
from fotismos.comparisons.prepared import Prepared
from fotismos.comparisons.records.comparison import (
    MOST_SPP,
    EffectsThatPass,
    Price,
    SamplesThatPass,
    Saving,
)
from fotismos.comparisons.records.departure import Viewing, VisibleShare
from fotismos.comparisons.records.images import Comparison
from fotismos.heuristic.convention import Doubles, Floats
from fotismos.reference.records import Interval
from fotismos.reference.rendering.gbuffer import gbuffer, size_of_width
from fotismos.reference.rendering.passes import Progress, Stream, pass_seed, passes

WIDTH = 128
NARROWEST = 24
"""Widths of the pictures whose noise is measured, in pixels."""

SAMPLES = 2**21
"""Samples of all of them, at most; not seconds: a result must not depend on the machine."""

PASS = 64
PASSES = 8
"""Samples per pixel of a pass, and passes."""

GROUPS = (1, 4)
"""Passes whose mean is one picture."""

SINGLE = (4, 16)
PICTURES = 2
"""Counts of samples below a pass, and pictures of each."""

EXACT = 1e-4
"""Noise, over the mean of a picture, that is rounding."""

HEAVY = 1.25
"""Growth of the noise with half of the samples, below which bright paths are rare."""

SURE = 2.0
"""Standard errors to each side of a share of pixels."""


def with_price(comparison: Comparison, ready: Prepared, progress: Progress | None) -> Comparison:
    """Return a comparison whose price names the samples that pass and the effects needed."""
    begin = perf_counter()
    record = comparison.record
    price = record.price
    assert price is not None, "the physical half was rendered"
    leading: Any = ready.metrics[LEADING.name]
    causes = comparison.causes
    price = structs.replace(
        price,
        samples=samples_that_pass(ready, leading),
        needed=None if causes is None else effects_that_pass(causes.visible),
        left_out=ready.plan.omissions(),
        saved=saving(ready, price),
    )
    comparison = replace(comparison, record=structs.replace(record, price=price))
    return comparison.timed("price", perf_counter() - begin)


# --- Samples ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class NoisyPictures:
    """A converged picture (N, 3), and how noisy ones deviate from it, {spp: (J, N, 3)}."""

    clean: Floats
    deviations: Mapping[int, Floats]
    metric: Pixelwise
    viewing: Viewing

    def distances(self, spp: int, factor: float = 1.0) -> Iterator[Doubles]:
        """Yield how far each picture of some samples is, (N,), its deviations times a factor."""
        fixed = self.metric.coordinates(self.clean, self.viewing)
        for deviation in self.deviations[spp]:
            shown = self.clean + factor * deviation
            yield self.metric.difference(fixed, self.metric.coordinates(shown, self.viewing))

    def visible(self, spp: int, factor: float = 1.0) -> Doubles:
        """Return the share of pixels above each threshold (T,), over all pictures."""
        found = self.distances(spp, factor)
        shares = np.array([shares_above(distances, THRESHOLDS) for distances in found])
        mean: Doubles = shares.mean(axis=0)
        return mean

    @property
    def growth(self) -> float:
        """How much farther pictures of half as many samples are, by those with the most samples.

        In linear values, since colour spaces compress large deviations. At most √2, which is usual,
        and at least 1.
        """
        *_, fewer, most = sorted(self.deviations)
        few = np.abs(self.deviations[fewer]).mean()
        many = np.abs(self.deviations[most]).mean()
        if many <= 0.0:
            return USUAL
        return float(np.clip((few / many) ** (1.0 / np.log2(most / fewer)), 1.0, USUAL))


def samples_that_pass(ready: Prepared, metric: Pixelwise) -> tuple[SamplesThatPass, ...]:
    """Return the samples with which the physical half passes, for each threshold."""
    noisy = _noisy_pictures(ready, metric)
    if noisy is None:
        return ()
    shares = {spp: noisy.visible(spp) for spp in noisy.deviations}
    # Beyond the pictures that were rendered: as usual, and as slowly as they show.
    slower = dict(shares)
    growth = noisy.growth
    largest = max(shares)
    spp = 4 * largest
    while spp <= MOST_SPP:
        doublings = float(np.log2(spp / largest))
        shares[spp] = noisy.visible(largest, USUAL**-doublings)
        slower[spp] = noisy.visible(largest, growth**-doublings)
        spp *= 4
    return tuple(
        _passing(
            threshold,
            {spp: float(found[place]) for spp, found in shares.items()},
            {spp: float(found[place]) for spp, found in slower.items()},
            pixels=len(noisy.clean),
            is_heavy=growth < HEAVY,
        )
        for place, threshold in enumerate(THRESHOLDS)
    )


def _noisy_pictures(ready: Prepared, metric: Pixelwise) -> NoisyPictures | None:
    """Render passes, and pictures with fewer samples; None if no pixel counts."""
    size = size_of_width(ready.scene, ready.size, _width(ready))
    counted = gbuffer(ready.scene, size, film=ready.size).hit
    if not counted.any():
        return None
    pictures, long = _deviating(ready, size, PASS, PASSES, counted)
    short = {spp: _deviating(ready, size, spp, PICTURES, counted)[1] for spp in SINGLE}
    middle = long.mean(axis=0)
    deviations = {spp: images - middle for spp, images in short.items()}
    deviations |= {size * PASS: _means_apart(long, size) for size in GROUPS}
    return NoisyPictures(
        clean=pictures.mean(axis=0),
        deviations=deviations,
        metric=metric,
        viewing=ready.options.viewing,
    )


def _width(ready: Prepared) -> int:
    """Return the width of the pictures, for which the samples suffice."""
    columns, rows = ready.size
    of_a_pixel = PASS * PASSES + PICTURES * sum(SINGLE)
    affordable = np.sqrt(SAMPLES / of_a_pixel * columns / rows)
    return int(np.clip(affordable, min(NARROWEST, columns), min(WIDTH, columns)))


def _deviating(
    ready: Prepared, size: tuple[int, int], spp: int, count: int, counted: Floats
) -> tuple[Floats, Floats]:
    """Render pictures of some samples, and return those of the reference and of the difference.

    Both (K, N, 3), of the counted pixels. A picture in place of the textbook half has no rays.
    """
    renderers = [half.sampled(spp) for half in ready.rendered]
    # Each count has its own passes.
    seed = pass_seed(ready.options.seed, spp, Stream.PRICE)
    loop = passes(renderers, seed, count, size=size, stream=Stream.PRICE)
    pictures = np.array(
        [[np.array(image, float)[counted] for image in rendered] for rendered in loop]
    )
    reference = pictures[:, -1]
    return reference, reference if len(renderers) == 1 else reference - pictures[:, 0]


def _means_apart(passes_of: Floats, size: int) -> Floats:
    """Return how means of ``size`` of K passes deviate from the truth, (K // size, N, 3).

    By how they deviate from the other passes, which have noise of their own.
    """
    count = len(passes_of)
    total = passes_of.sum(axis=0)
    deviations = []
    for first in range(0, count, size):
        chosen = passes_of[first : first + size].sum(axis=0)
        others = (total - chosen) / (count - size)
        deviations.append((chosen / size - others) * np.sqrt((count - size) / count))
    return np.array(deviations)


def _passing(
    threshold: float,
    shares: Mapping[int, float],
    slower: Mapping[int, float],
    pixels: int,
    is_heavy: bool,
) -> SamplesThatPass:
    """Return the fewest samples whose share of visible pixels is allowed, with an interval.

    ``slower`` are the shares if noise falls as slowly as the passes show. If it ``is_heavy``, the
    interval has no upper end.
    """

    def first(is_allowed: Callable[[int], bool]) -> int | None:
        return next((spp for spp in sorted(shares) if is_allowed(spp)), None)

    error = {spp: SURE * np.sqrt(share * (1 - share) / pixels) for spp, share in slower.items()}
    return SamplesThatPass(
        threshold=threshold,
        value=first(lambda spp: shares[spp] <= LIMIT),
        low=first(lambda spp: shares[spp] - error[spp] <= LIMIT),
        high=None if is_heavy else first(lambda spp: slower[spp] + error[spp] <= LIMIT),
    )


# --- Effects ---------------------------------------------------------------------------------

Visible = Mapping[tuple[str, ...], Sequence[VisibleShare]]
"""The visible shares of the images of sets of effects, by their labels."""


def effects_that_pass(visible: Visible) -> tuple[EffectsThatPass, ...]:
    """Return the fewest effects with which an image passes, for each threshold."""
    return tuple(_fewest(visible, place, threshold) for place, threshold in enumerate(THRESHOLDS))


def _fewest(visible: Visible, place: int, threshold: float) -> EffectsThatPass:
    """Return the smallest set that surely passes; of several, the one furthest below.

    There is always one: with all effects an image is compared with itself.
    """
    passing = [effects for effects, shares in visible.items() if shares[place].high <= LIMIT]
    effects = min(passing, key=lambda labels: (len(labels), visible[labels][place].high))
    share = visible[effects][place]
    interval = Interval(value=share.value, low=share.low, high=share.high)
    return EffectsThatPass(threshold=threshold, effects=effects, visible=interval)


# --- Pruning ---------------------------------------------------------------------------------


def saving(ready: Prepared, price: Price) -> Saving | None:
    """Return what a plan saves, by times that are measured, and by the noise of two pictures.

    None if it saves nothing, and of pictures.
    """
    whole = ready.unpruned
    if whole is None or not price.everything_s or not price.reference_s:
        return None
    size = size_of_width(ready.scene, ready.size, _width(ready))
    renderers = [half.sampled(PASS) for half in (*ready.rendered, whole)]
    loop = passes(renderers, ready.options.seed, 2, size=size, stream=Stream.PRICE)
    first, second = [np.array(rendered, float) for rendered in loop]
    # The difference from the textbook half, whose rays are the same, has no noise of edges.
    heuristic, plan, everything = first - second
    noise = float(np.sqrt(np.mean((plan - heuristic) ** 2)))
    noise_of_everything = float(np.sqrt(np.mean((everything - heuristic) ** 2)))
    is_exact = noise <= EXACT * np.abs(first[1]).mean()
    return Saving(
        time=price.everything_s / price.reference_s,
        noise=None if is_exact else noise_of_everything / noise,
    )
