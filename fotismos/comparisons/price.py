"""The price of a scene: the samples that pass, the effects needed, and what a plan saves.

**Samples.** With few samples a picture is noisy, and fails where the noise alone is visible. The
noise at two numbers of samples is known: from the passes of the comparison, and from the pictures
that are timed (:mod:`fotismos.comparisons.turns`). It is that of the difference of both
halves, which trace the same rays: edges, which both share, cancel, and channels share their noise.
``j`` of ``K`` passes deviate from all by less than from the truth, by ``√((K − j) / K)``. A picture
is judged by how far the converged one is from itself with the deviation. With another number of
samples the deviations are scaled: between the two by what they show, beyond by ``1 / √n``.
Samples of a pass are stratified, so noise may go on falling faster, and where it falls more slowly
the pictures show it: both widen the interval. Where it falls so slowly that bright paths are rare,
what no pass has seen is unknown: more samples may be needed (`HEAVY_GROWTH`).

**Effects.** Causes render images in which some effects are simulated. The fewest with which an
image surely passes are needed; what is not among them may be left out. Images are compared with the
one in which all are simulated, with which they share paths and most of the noise.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from time import perf_counter

import numpy as np
from msgspec import structs

from fotismos.comparisons import turns
from fotismos.comparisons.departure.criterion import LIMIT
from fotismos.comparisons.departure.metrics import LEADING, THRESHOLDS
from fotismos.comparisons.prepared import Prepared
from fotismos.comparisons.records.comparison import (
    FEWEST_SPP,
    MOST_SPP,
    EffectsThatPass,
    Price,
    SamplesThatPass,
    Saving,
)
from fotismos.comparisons.records.departure import Viewing, VisibleShare
from fotismos.comparisons.records.images import Comparison, Images
from fotismos.comparisons.turns import Time
from fotismos.heuristic.convention import Floats
from fotismos.reference.records import Interval
from fotismos.reference.rendering.gbuffer import gbuffer
from fotismos.reference.rendering.passes import Progress
from fotismos.reference.rendering.renderer import Renderer

NOISE_PICTURES = 4
"""Pictures of each half whose noise counts; it must not depend on how fast they are."""

MOST_JUDGED_PIXELS = 4096
"""Pixels of all pictures at which deviations are judged, at most."""

ROUNDING_NOISE = 1e-4
"""Noise, over the mean of a picture, that is rounding."""

USUAL_GROWTH = 2.0**0.5
HEAVY_GROWTH = 1.25
"""Growth of the noise with half of the samples: if they are independent, and below which bright
paths are rare."""

SURE_ERRORS = 2.0
"""Standard errors to each side of a share of pixels."""

USUAL_RATE = 0.5
"""Power of the samples with which noise falls if they are independent."""

RATES = (0.25, 1.5)
"""Least and largest power that two numbers of samples may show."""

NOT_TIMED = "a picture's time is not known"


def with_price(comparison: Comparison, ready: Prepared, progress: Progress | None) -> Comparison:
    """Return a comparison whose price has times, the samples that pass, and the effects needed."""
    begin = perf_counter()
    causes = comparison.causes
    price = structs.replace(
        measured(ready, comparison.images, progress),
        needed=None if causes is None else effects_that_pass(causes.visible),
        left_out=ready.plan.omissions(),
    )
    comparison = replace(comparison, record=structs.replace(comparison.record, price=price))
    return comparison.timed("price", perf_counter() - begin)


def measured(ready: Prepared, images: Images, progress: Progress | None = None) -> Price:
    """Render both halves in turn, and everything simulated if the plan leaves out something.

    ``images`` are those of the comparison, whose passes show the noise of another number of
    samples.
    """
    size, spp = turns.timed_size(ready.reference)
    has_textbook = "textbook" in ready.has
    halves: dict[str, Renderer] = {"textbook": ready.heuristic} if has_textbook else {}
    halves["plan"] = ready.reference
    if has_textbook and ready.unpruned is not None:
        halves["everything"] = ready.unpruned
    halves = {name: half.sampled(spp) for name, half in halves.items()}
    counted = gbuffer(ready.scene, size, film=ready.size).hit
    # The pixels that count of each picture, {method: (K, N, 3)}.
    seed = ready.options.seed
    pictures: dict[str, list[Floats]] = {name: [] for name in halves}
    for made in turns.in_turn(halves, seed, NOISE_PICTURES - 1, size=size, progress=progress):
        for name, image in made.items():
            pictures[name].append(np.array(image, float)[counted])
    shown = {name: np.array(found) for name, found in pictures.items()}
    times = turns.timed(halves, seed, size, progress)

    def seconds(name: str) -> float | None:
        """Return the least time of a sample, which other work on the machine slows least."""
        return float(times[name].per_sample.min()) if name in times else None

    width, height = ready.size
    return Price(
        ratio=turns.ratio(times["plan"], times["textbook"]) if has_textbook else None,
        reason="" if has_textbook else NOT_TIMED,
        heuristic_s=seconds("textbook"),
        reference_s=seconds("plan"),
        everything_s=seconds("everything"),
        pixels=width * height,
        samples=samples_that_pass(_noises(ready, images, shown, spp)),
        saved=_saving(times, shown) if "everything" in times else None,
    )


# --- Samples ---------------------------------------------------------------------------------


class Noise:
    """How far pictures of ``spp`` samples per pixel are from the converged one.

    ``clean`` (N, 3) is the converged picture, and ``deviations`` (J, N, 3) are those of J pictures.
    ``growth`` is how much farther pictures of half as many samples are: at most √2, which is usual,
    and at least 1.
    """

    def __init__(
        self, clean: Floats, deviations: Floats, spp: int, growth: float, viewing: Viewing
    ) -> None:
        self.spp = spp
        self.growth = growth
        self.level = float(np.abs(deviations).mean())
        # Every n-th of the pixels, if there are many.
        every = max(1, -(-deviations.shape[0] * len(clean) // MOST_JUDGED_PIXELS))
        self._clean = clean[::every]
        self._deviations = deviations[:, ::every]
        self.judged = self._deviations.shape[0] * len(self._clean)
        self._distances = LEADING.against(self._clean, ..., viewing)
        self._known: dict[float, Floats] = {}

    def share(self, threshold: float, spp: int, rate: float) -> float:
        """Return the share above a threshold with other samples, if noise falls as ``n^-rate``."""
        factor = (self.spp / spp) ** rate
        if factor not in self._known:
            shown = [self._clean + factor * deviation for deviation in self._deviations]
            self._known[factor] = np.array([self._distances(image) for image in shown])
        return float(np.mean(self._known[factor] > threshold))


def _noises(ready: Prepared, images: Images, shown: Mapping[str, Floats], spp: int) -> list[Noise]:
    """Return the noise of the comparison's passes, and of the pictures that were timed.

    ``shown`` has the K pictures of each method, (K, N, 3). None of an empty picture.
    """
    viewing = ready.options.viewing
    pictures = shown["plan"]
    count = len(pictures)
    if not pictures.size:
        return []
    difference = pictures - shown["textbook"] if "textbook" in shown else pictures
    deviations = (difference - difference.mean(axis=0)) * np.sqrt(count / (count - 1))
    # Means of half of the pictures, from those of the other half.
    half = (difference[: count // 2].mean(axis=0) - difference[count // 2 :].mean(axis=0)) / 2**0.5
    doublings = float(np.log2(count // 2))
    left = float(np.abs(half).mean())
    growth = (np.abs(deviations).mean() / left) ** (1 / doublings) if left > 0 else USUAL_GROWTH
    growth = float(np.clip(growth, 1.0, USUAL_GROWTH))
    timed = Noise(pictures.mean(axis=0), deviations, spp, growth, viewing)
    grouped = images.grouped
    if "textbook" not in shown or grouped is None or len(grouped.sizes) < 2:
        return [timed]
    sizes = grouped.sizes[:, None, None]
    total = sizes.sum()
    mean = (grouped.means * sizes).sum(axis=0) / total
    # A mean of m of N passes deviates from that of all by its noise times `√(1/m − 1/N)`.
    passes = (grouped.means - mean) / np.sqrt(1 / sizes - 1 / total)
    clean = images.reference.reshape(-1, 3)[grouped.places].astype(float)
    own = Noise(clean, passes, ready.reference.pass_spp, growth, viewing)
    return [timed] if own.spp == spp else [own, timed]


def samples_that_pass(noises: Sequence[Noise]) -> tuple[SamplesThatPass, ...]:
    """Return the samples with which the physical half passes, for each threshold.

    ``noises`` are known at one number of samples or two; without any, nothing is returned.
    """
    if not noises:
        return ()
    few = min(noises, key=lambda noise: noise.spp)
    many = max(noises, key=lambda noise: noise.spp)
    between = USUAL_RATE
    if few.spp < many.spp and few.level > 0 and many.level > 0:
        between = float(np.log(few.level / many.level) / np.log(many.spp / few.spp))
        between = float(np.clip(between, *RATES))
    beyond = {
        "low": max(USUAL_RATE, between),
        "value": USUAL_RATE,
        "high": min(USUAL_RATE, float(np.log2(many.growth))),
    }
    counts = [FEWEST_SPP]
    while counts[-1] < MOST_SPP:
        counts.append(4 * counts[-1])

    def share(threshold: float, spp: int, end: str) -> float:
        """Return the share above a threshold with some samples; ``end`` is that of an interval."""
        known = min(noises, key=lambda noise: abs(np.log(noise.spp / spp)))
        if spp < few.spp and end == "high":
            # Fewer samples than known: strata may be all that keeps the noise small.
            return known.share(threshold, spp, RATES[1])
        if end == "value" or not few.spp < spp < many.spp:
            return known.share(threshold, spp, beyond[end] if spp > many.spp else between)
        # Between both numbers of samples noise may fall as it does beyond them.
        rates = (USUAL_RATE, between)
        found = [noise.share(threshold, spp, rate) for noise in (few, many) for rate in rates]
        return max(found) if end == "high" else min(found)

    return tuple(_passing(threshold, counts, share, many) for threshold in THRESHOLDS)


def _passing(
    threshold: float,
    counts: Sequence[int],
    share: Callable[[float, int, str], float],
    many: Noise,
) -> SamplesThatPass:
    """Return the fewest samples whose share of visible pixels is allowed, with an interval.

    ``share(threshold, spp, end)`` is that of an end of the interval, or of its value. If the noise
    of ``many`` samples is heavy, the interval has no upper end.
    """

    def first(end: str, sign: int) -> int | None:
        """Return the fewest samples with a share of at most LIMIT, less or plus its error."""
        for spp in counts:
            found = share(threshold, spp, end)
            if found + sign * SURE_ERRORS * np.sqrt(found * (1 - found) / many.judged) <= LIMIT:
                return spp
        return None

    return SamplesThatPass(
        threshold=threshold,
        value=first("value", 0),
        low=first("low", -1),
        high=None if many.growth < HEAVY_GROWTH else first("high", 1),
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


def _saving(times: Mapping[str, Time], shown: Mapping[str, Floats]) -> Saving:
    """Return what a plan saves, by the times and the noise of the same pictures."""
    # The difference from the textbook half, whose rays are the same, has no noise of edges.
    plan = shown["plan"] - shown["textbook"]
    everything = shown["everything"] - shown["textbook"]
    noise = _noise(plan)
    is_exact = not plan.size or noise <= ROUNDING_NOISE * np.abs(shown["plan"]).mean()
    return Saving(
        time=turns.ratio(times["everything"], times["plan"]).value,
        noise=None if is_exact else _noise(everything) / noise,
    )


def _noise(pictures: Floats) -> float:
    """Return the standard deviation of pictures (K, N, 3), as the root of a mean square."""
    return float(np.sqrt(pictures.var(axis=0).mean())) if pictures.size else 0.0
