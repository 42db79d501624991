"""The price of a scene: the samples that pass, the effects needed, and what a plan saves.

**Samples.** With few samples a picture is noisy, and fails where the noise alone is visible. How
noisy it is cannot be computed from one count: samples of a pass are stratified, so noise does not
fall as ``1 / √n``. So pictures of 4, 16 and 64 samples are rendered, each with its own seed, and
means of passes of 64 make pictures of 256. The picture that is judged is the converged reference
plus the deviation of the difference of both halves, which trace the same rays: edges, which both
share, cancel, and channels share their noise. ``j`` of ``K`` passes deviate from the others by more
than from the truth, by ``√(K / (K − j))``. Beyond 256 the deviation is scaled: by ``1 / √n``, and
where halves of the passes show that noise falls more slowly, between that and what they show.

**Effects.** Causes render images in which some effects are simulated. The fewest with which an
image passes are needed; what is not among them may be left out.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np
from msgspec import structs

from fotismos.comparisons.comparison import Comparison
from fotismos.comparisons.departure.colour import Viewing
from fotismos.comparisons.departure.criterion import LIMIT
from fotismos.comparisons.departure.metrics import LEADING, THRESHOLDS, Pixelwise
from fotismos.comparisons.departure.noise import USUAL, VisibleShare, shares_above
from fotismos.comparisons.prepared import Prepared
from fotismos.comparisons.price_record import (
    MOST_SPP,
    EffectsThatPass,
    Price,
    SamplesThatPass,
    Saving,
)
from fotismos.heuristic.convention import Doubles, Floats
from fotismos.reference.planning.plan import Plan
from fotismos.reference.planning.rules import RULES
from fotismos.reference.records import Interval
from fotismos.reference.rendering.gbuffer import gbuffer, image_size, resize, size_of_width
from fotismos.reference.rendering.renderer import Progress, Renderer, Stream, pass_seed, passes

WIDTH = 128
NARROWEST = 24
"""Widths of the pictures whose noise is measured, in pixels."""

BUDGET_S = 1.0
"""Seconds that they take, about: if a sample takes long, they are narrower."""

PASS = 64
PASSES = 8
"""Samples per pixel of a pass, and passes."""

SINGLE = (4, 16)
PICTURES = 2
"""Counts of samples below a pass, and pictures of each."""

EXACT = 1e-4
"""Noise, over the mean of a picture, that is rounding."""

SURE = 2.0
"""Standard errors to each side of a share of pixels."""


def with_price(comparison: Comparison, ready: Prepared, progress: Progress | None) -> Comparison:
    """Return a comparison whose price names the samples that pass and the effects needed."""
    begin = perf_counter()
    record = comparison.record
    price = record.price
    assert price is not None
    leading: Any = ready.metrics()[LEADING.name]
    causes = comparison.causes
    price = structs.replace(
        price,
        samples=samples_that_pass(ready, price, leading),
        needed=None if causes is None else effects_that_pass(causes.visible),
        left_out=tuple(left_out(ready.plan)),
        saved=saving(ready, price),
    )
    comparison = replace(comparison, record=structs.replace(record, price=price))
    return comparison.timed("price", perf_counter() - begin)


# --- Samples ---------------------------------------------------------------------------------


def samples_that_pass(
    ready: Prepared, price: Price, metric: Pixelwise
) -> tuple[SamplesThatPass, ...]:
    """Return the samples with which the physical half passes, for each threshold."""
    size = size_of_width(ready.scene, _width(ready, price))
    film = image_size(ready.scene)
    viewing = ready.options.viewing
    try:
        counted = gbuffer(ready.scene, size).hit
        if not counted.any():
            return ()
        # (K, N, 3) passes of the reference, and of its difference from the textbook half.
        pictures, long = _deviating(ready, size, PASS, PASSES, counted)
        short = {spp: _deviating(ready, size, spp, PICTURES, counted)[1] for spp in SINGLE}
    finally:
        for half in _halves(ready):
            resize(half.scene, film)
    clean = pictures.mean(axis=0)
    middle = long.mean(axis=0)

    def visible(deviations: Floats) -> Doubles:
        """Return the share of pixels above each threshold (T,), over deviations (J, N, 3)."""
        distances = _distances(metric, clean, deviations, viewing)
        shares = np.array([shares_above(found, THRESHOLDS) for found in distances])
        mean: Doubles = shares.mean(axis=0)
        return mean

    by_count = {spp: visible(images - middle) for spp, images in short.items()}
    sizes = {PASS: 1, 2 * PASS: 2, 4 * PASS: 4}
    apart = {spp: _means_apart(long, size) for spp, size in sizes.items()}
    by_count |= {spp: visible(deviations) for spp, deviations in apart.items()}
    growth = _growth(metric, clean, apart, viewing)
    largest = max(sizes)
    slower = dict(by_count)
    spp = 4 * largest
    while spp <= MOST_SPP:
        doublings = np.log2(spp / largest)
        by_count[spp] = visible(apart[largest] * USUAL**-doublings)
        slower[spp] = visible(apart[largest] * growth**-doublings)
        spp *= 4
    pixels = int(counted.sum())
    return tuple(
        _passing(
            threshold,
            {spp: float(shares[place]) for spp, shares in by_count.items()},
            {spp: float(shares[place]) for spp, shares in slower.items()},
            pixels=pixels,
        )
        for place, threshold in enumerate(THRESHOLDS)
    )


def _halves(ready: Prepared) -> list[Renderer]:
    """Return the renderers of both halves; a picture in place of one has none."""
    return [ready.reference] if ready.options.image else [ready.heuristic, ready.reference]


def _width(ready: Prepared, price: Price) -> int:
    """Return the width of the pictures, for which the budget suffices."""
    columns, rows = image_size(ready.scene)
    samples = PASS * PASSES + PICTURES * sum(SINGLE)
    per_pixel = samples * sum(filter(None, (price.heuristic_s, price.reference_s)))
    affordable = np.sqrt(BUDGET_S / max(per_pixel, 1e-9) * columns / rows)
    return int(np.clip(affordable, min(NARROWEST, columns), min(WIDTH, columns)))


def _deviating(
    ready: Prepared, size: tuple[int, int], spp: int, count: int, counted: Floats
) -> tuple[Floats, Floats]:
    """Render pictures of some samples, and return those of the reference and of the difference.

    Both (K, N, 3), of the counted pixels. A picture in place of the textbook half has no rays.
    """
    renderers = [half.sampled(spp, size) for half in _halves(ready)]
    # Each count has its own passes.
    seed = pass_seed(ready.options.seed, spp, Stream.PRICE)
    loop = passes(renderers, seed, count, stream=Stream.PRICE)
    pictures = np.array(
        [[np.array(image, float)[counted] for image in rendered.images] for rendered in loop]
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


def _distances(
    metric: Pixelwise, clean: Floats, deviations: Floats, viewing: Viewing
) -> Iterator[Doubles]:
    """Yield how far each deviating picture is from the clean one, (N,)."""
    fixed = metric.coordinates(clean, viewing)
    for deviation in deviations:
        yield metric.difference(fixed, metric.coordinates(clean + deviation, viewing))


def _growth(
    metric: Pixelwise, clean: Floats, apart: Mapping[int, Floats], viewing: Viewing
) -> float:
    """Return how much farther a picture of half as many samples is, by passes and halves of them.

    At most √2, which is usual, and at least 1.
    """
    fewest, *_, most = sorted(apart)
    single = np.mean([found.mean() for found in _distances(metric, clean, apart[fewest], viewing)])
    halves = np.mean([found.mean() for found in _distances(metric, clean, apart[most], viewing)])
    if halves <= 0.0:
        return USUAL
    return float(np.clip((single / halves) ** (1.0 / np.log2(most / fewest)), 1.0, USUAL))


def _passing(
    threshold: float, shares: Mapping[int, float], slower: Mapping[int, float], pixels: int
) -> SamplesThatPass:
    """Return the fewest samples whose share of visible pixels is allowed, with an interval.

    ``slower`` are the shares if noise falls as slowly as the passes show.
    """

    def first(is_allowed: Callable[[int], bool]) -> int | None:
        return next((spp for spp in sorted(shares) if is_allowed(spp)), None)

    error = {spp: SURE * np.sqrt(share * (1 - share) / pixels) for spp, share in slower.items()}
    return SamplesThatPass(
        threshold=threshold,
        value=first(lambda spp: shares[spp] <= LIMIT),
        low=first(lambda spp: shares[spp] - error[spp] <= LIMIT),
        high=first(lambda spp: slower[spp] + error[spp] <= LIMIT),
    )


# --- Effects ---------------------------------------------------------------------------------

Visible = Mapping[tuple[str, ...], Sequence[VisibleShare]]
"""The visible shares of the images of sets of effects, by their labels."""


def effects_that_pass(visible: Visible) -> tuple[EffectsThatPass, ...]:
    """Return the fewest effects with which an image passes, for each threshold."""
    return tuple(_fewest(visible, place, threshold) for place, threshold in enumerate(THRESHOLDS))


def _fewest(visible: Visible, place: int, threshold: float) -> EffectsThatPass:
    """Return the smallest set that passes at a threshold; of several, the one furthest below."""
    passing = [effects for effects, shares in visible.items() if shares[place].high <= LIMIT]
    if not passing:
        return EffectsThatPass(threshold=threshold, effects=None, visible=None)
    effects = min(passing, key=lambda labels: (len(labels), visible[labels][place].high))
    share = visible[effects][place]
    interval = Interval(value=share.value, low=share.low, high=share.high)
    return EffectsThatPass(threshold=threshold, effects=effects, visible=interval)


# --- Pruning ---------------------------------------------------------------------------------


def left_out(plan: Plan) -> Iterator[str]:
    """Yield what a plan leaves out by proof, as nouns."""
    applied = {result.name for result in plan.rules if result.applies}
    return (rule.omits for rule in RULES if rule.name in applied)


def saving(ready: Prepared, price: Price) -> Saving | None:
    """Return what a plan saves, by times that are measured, and by the noise of two pictures.

    None if it saves nothing, and of pictures.
    """
    whole = ready.unpruned()
    if whole is None or not price.everything_s or not price.reference_s:
        return None
    size = size_of_width(ready.scene, _width(ready, price))
    film = image_size(ready.scene)
    renderers = [half.sampled(max(SINGLE), size) for half in (*_halves(ready), whole)]
    try:
        loop = passes(renderers, ready.options.seed, 2, stream=Stream.PRICE)
        first, second = [np.array(rendered.images, float) for rendered in loop]
    finally:
        for half in _halves(ready):
            resize(half.scene, film)
    # The difference from the textbook half, whose rays are the same, has no noise of edges.
    heuristic, plan, everything = first - second
    noise = float(np.sqrt(np.mean((plan - heuristic) ** 2)))
    noise_of_everything = float(np.sqrt(np.mean((everything - heuristic) ** 2)))
    is_exact = noise <= EXACT * np.abs(first[1]).mean()
    return Saving(
        time=price.everything_s / price.reference_s,
        noise=None if is_exact else noise_of_everything / noise,
    )
