"""Attribution: the error that each effect removes, and which effect dominates where.

What an effect removes depends on what is simulated already: shadows without the light between
surfaces can look worse than neither. So each is a Shapley value over the effects in which the
halves differ: for players ``N`` and a value ``v(S)`` of each subset, the share of player ``i`` is
::

    phi_i = sum over S in N without i of  |S|! (n - |S| - 1)! / n!  [v(S + i) - v(S)]

its mean gain over all orders in which the players may come. The shares add up to
``v(N) - v(empty)``, the departure less the closure, in the mean and in every pixel. The closure is
the error that remains when all effects are simulated; only a fault can cause it.
Source: L. S. Shapley, *A value for n-person games*, 1953.
"""

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import permutations
from time import perf_counter
from typing import Any, TypeVar

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from fotismos.comparisons.departure.blocks import ratio
from fotismos.comparisons.departure.estimate import (
    Estimate,
    Replicates,
    contrasts,
    estimate,
)
from fotismos.comparisons.departure.metrics import LEADING, Pixelwise
from fotismos.comparisons.departure.regions import find_objects
from fotismos.comparisons.hybrids import HybridImages, HybridScenes, Pairs, labels
from fotismos.comparisons.prepared import Prepared
from fotismos.comparisons.records.comparison import (
    CAUSES,
    TIED,
    Attribution,
    ComparisonRecord,
    Contribution,
    Hybrid,
    ObjectContribution,
    tied,
)
from fotismos.comparisons.records.departure import Region, Viewing, VisibleShare
from fotismos.comparisons.records.images import Causes, Comparison
from fotismos.heuristic.convention import Doubles, Floats
from fotismos.heuristic.errors import FotismosError, InputError
from fotismos.reference.planning.effects import Effect
from fotismos.reference.records import Interval
from fotismos.reference.rendering.gbuffer import (
    ObjectIds,
    gbuffer,
    require_surface,
    size_of_width,
)
from fotismos.reference.rendering.passes import Progress
from fotismos.reference.rendering.sums import block_numbers, jackknifed

WIDTH = 48
NARROW = 32
MANY = 64
"""Largest width of the images in which causes are found. With more than MANY lights or shapes it is
NARROW, since each sample takes longer."""

REPLICATES = 4
SPP = 64
FEW_SPP = 32
EXACT_SPP = 16
"""Replicates of each image, and samples per pixel of each: FEW_SPP with MANY lights or shapes, and
EXACT_SPP where only the pixel filter needs samples. With 16 in place of 64, skewed noise left 2 %
of the Cornell box's error in the closure."""

EXACT_EFFECTS = 4
ORDERS = 8
"""Up to EXACT_EFFECTS effects every subset is rendered; for more, ORDERS orders are drawn."""

BIAS = 0.005
"""Least half width of the interval of what an effect removes, as a share of the departure: some
noise is not taken away (:meth:`ErrorMeter.without_noise`)."""

MOST = 0.5
"""An image with a larger share of pixels above the largest threshold cannot pass: no more is said
of its shares."""

MORE = 4
PATIENCE = 2
AFFORDABLE = 2**24
"""If causes do not add up, they take MORE times the samples, up to PATIENCE times the comparison's
own samples, or AFFORDABLE ones, over all images. The limit is not in seconds: a result must not
depend on how busy the machine was."""

CLOSED = 0.025
"""Largest closure, as a share of the departure, that needs no more samples; its interval may have
eight times the width. A departure below LEAST counts as that."""

LEAST = 1.0
"""ΔE2000: an effect that removes less cannot be seen, and does not dominate."""

ALSO = 0.5
"""Share of what the first effect removes: a second one that removes as much is named too."""

NONE = -1
UNCOUNTED = -2

Player = TypeVar("Player", bound=Hashable)
"""An effect; in tests of the sums, any name."""


def with_causes(comparison: Comparison, ready: Prepared, progress: Progress | None) -> Comparison:
    """Return a comparison with its causes, found with its own scenes and plan at a small size.

    If they cannot be found, a warning says why.
    """
    begin = perf_counter()
    try:
        clean = comparison.images.reference, comparison.images.reference_stderr
        plan = comparison.record.plan
        assert plan is not None, "the reference was rendered"
        both_halves = 2 * plan.spp * comparison.images.counted.size
        most_samples = max(PATIENCE * both_halves, AFFORDABLE)
        causes = find(ready, progress, clean, limit=most_samples)
    except FotismosError as error:
        return comparison.warned([f"The causes are unknown: {error}"])
    record = structs.replace(with_effects_named(comparison, causes), why=causes.record)
    comparison = replace(comparison, record=record, causes=causes)
    return comparison.timed(CAUSES, perf_counter() - begin)


def find(
    ready: Prepared,
    progress: Progress | None = None,
    clean: tuple[Floats, Floats] | None = None,
    most: int | None = None,
    limit: int = 0,
) -> "Causes":
    """Attribute the departure of a prepared scene, on a film of at most ``most`` pixels' width.

    If ``most`` is omitted, it is :data:`WIDTH` or :data:`NARROW`. ``clean`` are the reference (H,
    W, 3) on the scene's own film and its standard error, if known: they make previews less noisy.
    While the effects do not add up to the departure, the samples are multiplied by :data:`MORE`, as
    long as all images have at most ``limit`` samples.
    """
    if media := sorted(name for name, _ in ready.pair.media):
        raise InputError(
            f"{ready.name} has participating media ({', '.join(media)}), which no image of some"
            " effects can hold. The other numbers do not need them."
        )
    width, height = ready.size
    is_large = max(len(ready.scene.emitters()), len(ready.scene.shapes())) > MANY
    most = most or (NARROW if is_large else WIDTH)
    size = size_of_width(ready.scene, ready.size, min(most, width))
    spp = EXACT_SPP if ready.plan.exact else FEW_SPP if is_large else SPP
    surface = gbuffer(ready.scene, size, film=ready.size)
    require_surface(surface.hit, ready.name)
    leading: Any = ready.metrics[LEADING.name]
    pairs = Pairs(ready, ready.options)
    scenes = HybridScenes(pairs.plain(), ready.plan, ready.scene)
    while True:
        images = HybridImages(
            pairs,
            scenes,
            replicates=REPLICATES,
            replicate_spp=spp,
            seed=ready.options.seed,
            size=size,
            progress=progress,
        )
        meter = ErrorMeter(images.reference(), surface.hit, ready.options.viewing, leading)
        found = attribute(
            images,
            meter,
            shapes=surface.shape,
            seed=ready.options.seed,
            clean=clean,
            whole=width * height,
        )
        count = len(found.record.hybrids) * REPLICATES
        is_enough = count * MORE * spp * size[0] * size[1] > limit
        if not images.effects or is_closed(found.record) or is_enough:
            return found
        spp *= MORE


def is_closed(record: Attribution) -> bool:
    """Return whether the effects add up to the departure, as nearly as :data:`CLOSED` asks."""
    allowed = CLOSED * max(record.departure, LEAST)
    width = record.closure.high - record.closure.low
    return abs(record.closure.value) <= allowed and width <= 8 * allowed


class ErrorMeter:
    """Errors in ΔE2000 against a reference, without the noise of both.

    ``groups`` (R, H, W, 3) are passes of the reference, one per replicate of an image: those of one
    number share random numbers. ``counted`` (H, W) are the pixels that count. ``metric`` is ΔE2000.
    """

    def __init__(
        self,
        groups: Floats,
        counted: NDArray[np.bool_],
        viewing: Viewing,
        metric: Pixelwise = LEADING,
    ) -> None:
        self.viewing = viewing
        self.metric = metric
        self.counted = counted
        self.groups = np.asarray(groups)
        self._passes = self.groups[:, counted].astype(float)
        _, self._blocks = np.unique(block_numbers(counted), return_inverse=True)
        count = len(self.groups)
        whole = np.full((1, count), 1.0 / count)
        left_out = (1.0 - np.eye(count)) / (count - 1)
        # Weights of the mean of all replicates, and of those without each: (R + 1, R).
        self._means = np.concatenate([whole, left_out])
        noise = [_contrasts_of(weights) for weights in self._means]
        # Rows of weights that make noise, and the mean that each belongs to.
        self._noise = np.concatenate(noise)
        self._noisy = np.repeat(np.arange(count + 1), [len(rows) for rows in noise])

    def without_noise(self, images: Floats) -> NDArray[np.float64]:
        """Return the error (R + 1, N) of each counted pixel, without the noise of both images.

        That is first of the mean of all replicates (R, H, W, 3), then leaving out each in turn. A
        distance is never negative, so noise raises it, and most where it is small. So the noise of
        the difference is added once more. Over a block of pixels, let ``f0`` be the mean distance
        as measured, and ``f1`` the mean with more noise. Then ::

            f² (without noise) = f0² − (f1² − f0²)

        If the distance is noise alone, ``f1 = √2 f0`` and nothing remains; if it is far larger, the
        squares grow in proportion to the variance. A block's square may be negative, and its root
        then counts as negative, which leaves little bias in the mean of many. Within a block each
        pixel keeps its share. Source: J. R. Cook and L. A. Stefanski, J. Am. Stat. Assoc. 89, 1994.
        """
        images = np.asarray(images)[:, self.counted].astype(float)
        means = np.tensordot(self._means, images, 1)
        noise = np.tensordot(self._noise, images - self._passes, 1)
        shown = self.metric.coordinates(
            np.concatenate([means, means[self._noisy] + noise]), self.viewing
        )
        references = self._references[[*range(len(means)), *self._noisy]]
        distances = self.metric.difference(references, shown)
        plain = distances[: len(means)]
        errors = np.empty_like(plain)
        for number, before in enumerate(plain):
            after = distances[len(means) :][self._noisy == number].mean(axis=0)
            kept = ratio(
                _without_noise(self._by_block(before), self._by_block(after)),
                self._by_block(before),
            )
            errors[number] = before * kept[self._blocks]
        return errors

    def estimate(self, images: Floats, references: Floats) -> Estimate:
        """Return how far images (R, H, W, 3) are from others: the mean, and visible shares."""
        replicates = Replicates.of_images(images, references, self.counted)
        return estimate(self.metric, replicates, self.viewing)

    def visible(
        self, images: Floats, everything: Floats, pixels: int
    ) -> tuple[VisibleShare, ...] | None:
        """Return the shares of pixels that differ visibly, without noise; None where most do.

        Images (R, H, W, 3) are compared with those in which ``everything`` is simulated: they share
        paths, and with them most of the noise. The intervals also hold the shares of a picture of
        more ``pixels``, of which these are drawn.
        """
        shown = np.mean(images, axis=0)[self.counted]
        distances = self.metric(shown, np.mean(everything, axis=0)[self.counted], self.viewing)
        if np.mean(distances > self.metric.visible[-1]) > MOST:
            return None
        shares = self.estimate(images, everything).visible
        return tuple(_drawn(share, distances.size, pixels) for share in shares)

    @cached_property
    def _references(self) -> Doubles:
        """The coordinates (R + 1, N, 3) of the reference: of all passes, then without each."""
        means = np.tensordot(self._means, self._passes, 1)
        return np.asarray(self.metric.coordinates(means, self.viewing))

    def _by_block(self, values: Floats) -> NDArray[np.float64]:
        """Return the sums (B,) over the blocks of pixels."""
        return np.bincount(self._blocks, values).astype(float)


def _contrasts_of(weights: Doubles) -> Doubles:
    """Return weights (m, R) that make noise from replicates, as large as that of a mean of some."""
    rows = contrasts(np.ones(np.count_nonzero(weights)))
    found = np.zeros((len(rows), len(weights)))
    found[:, weights > 0] = rows
    return found


def _without_noise(measured: Doubles, noisier: Doubles) -> Doubles:
    """Return distances without noise, from those measured and those with the noise added again."""
    squares = 2.0 * np.square(measured) - np.square(noisier)
    return np.asarray(np.sign(squares) * np.sqrt(np.abs(squares)))


def _drawn(share: VisibleShare, pixels: int, of: int) -> VisibleShare:
    """Return a share of some pixels, with an interval for all ``of`` which they are drawn."""
    variance = share.value * (1.0 - share.value) * max(1 / pixels - 1 / of, 0.0)
    half = 2.0 * float(np.sqrt(variance))
    return structs.replace(share, low=max(share.low - half, 0.0), high=min(share.high + half, 1.0))


def attribute(
    images: HybridImages,
    meter: ErrorMeter,
    shapes: ObjectIds,
    seed: int,
    clean: tuple[Floats, Floats] | None = None,
    whole: int = 0,
) -> Causes:
    """Attribute the departure to the effects, as a whole, on each shape, and in each pixel.

    ``shapes`` are what each pixel sees; ``seed`` draws the orders; ``whole`` are the pixels of the
    scene's picture. For ``clean`` see :func:`find`.
    """
    effects = images.effects
    everything = frozenset(images.effects)
    nothing: frozenset[Effect] = frozenset()
    # One rendering makes many images, so all that the sums will ask for are rendered at once.
    sets = [nothing, *(frozenset({effect}) for effect in effects)]
    sets += [everything - left_out for left_out in sets]

    # A dry run of the sums notes the subsets that they ask for.
    def note(simulated: frozenset[Effect]) -> float:
        sets.append(simulated)
        return 0.0

    shares(effects, note, seed=seed, exact_players=EXACT_EFFECTS, orders=ORDERS)
    images.render(sets)
    with_all = images.pixels(images.simulating(everything))
    known: dict[frozenset[Effect], Floats] = {}

    def error(simulated: frozenset[Effect]) -> Floats:
        """Return errors (R + 1, N) in ΔE2000."""
        if simulated not in known:
            found = images.pixels(images.simulating(simulated))
            known[simulated] = meter.without_noise(found)
        return known[simulated]

    gains, sampling_errors, drawn = shares(
        effects, error, seed=seed, exact_players=EXACT_EFFECTS, orders=ORDERS
    )
    # A gain is a change of the error: an effect that removes some has a negative one.
    removed = {e.label: -gain for e, gain in zip(effects, gains, strict=True)}
    departure = error(nothing)
    left = error(everything)
    # What does not close may belong to any of them.
    bias = max(BIAS * float(departure[0].mean()), abs(float(left[0].mean())))
    contributions = tuple(
        Contribution(
            effect=effect.label,
            removes=jackknifed(removed[effect.label].mean(axis=-1), bias),
            alone=float((error(nothing) - error(frozenset({effect})))[0].mean()),
            last=float((error(everything - {effect}) - error(everything))[0].mean()),
            sampling_error=sampling_error,
        )
        for effect, sampling_error in zip(effects, sampling_errors, strict=True)
    )
    closure = jackknifed(left.mean(axis=-1), BIAS * float(departure[0].mean()))
    # What noise may leave is no fault: the closure may be 0 if this error may.
    least = meter.estimate(with_all, meter.groups).mean.low
    hybrids = [
        Hybrid(effects=labels(effects, simulated), error=float(error(simulated)[0].mean()))
        for simulated in known
    ]

    def filled(values: Floats) -> NDArray[np.float64]:
        whole = np.zeros(meter.counted.shape)
        whole[meter.counted] = values
        return whole

    previews = images.previews(known, clean)
    kernel = images.pixels(images.plain_kernel).mean(axis=0)
    # The kernel and its plugin compute the same: what differs is rounding.
    plugin = images.pixels(images.plugin(nothing)).mean(axis=0)
    rounding = meter.metric(plugin, kernel, meter.viewing)[meter.counted]
    visible = {}
    for simulated in known:
        found = images.pixels(images.simulating(simulated))
        if shares_of := meter.visible(found, with_all, whole):
            visible[labels(effects, simulated)] = shares_of
    return Causes(
        record=Attribution(
            effects=contributions,
            departure=float(departure[0].mean()),
            closure=structs.replace(
                closure, low=min(closure.low, least), high=max(closure.high, least)
            ),
            implementation=float(rounding.mean()),
            resolution=meter.counted.shape[::-1],
            spp=images.replicate_spp,
            replicates=images.replicates,
            orders=drawn,
            hybrids=tuple(
                sorted(hybrids, key=lambda hybrid: (len(hybrid.effects), hybrid.effects))
            ),
            objects=by_object(
                filled(departure[0]), removed, left=left[0], counted=meter.counted, shapes=shapes
            ),
        ),
        maps={name: filled(change[0]) for name, change in removed.items()},
        departure=filled(departure[0]),
        left=filled(left[0]),
        counted=meter.counted,
        previews={hybrid.effects: image for hybrid, image in zip(hybrids, previews, strict=True)},
        visible=visible,
    )


def by_object(
    departure: Floats,
    removed: Mapping[str, Floats],
    left: Floats,
    counted: NDArray[np.bool_],
    shapes: ObjectIds,
) -> tuple[ObjectContribution, ...]:
    """Return what the effects remove on each shape, the one with most of the departure first."""
    found, places = find_objects(departure, counted, shapes)
    rows = places[counted]
    count = len(found)
    gains = [means(change, rows, count) for change in removed.values()]
    remaining = means(left, rows, count)
    return tuple(
        ObjectContribution(
            name=share.name,
            pixels=share.pixels,
            share=share.share,
            departure=share.mean_dE2000,
            removes=tuple(
                jackknifed(
                    change[:, row], max(BIAS * share.mean_dE2000, abs(float(remaining[row])))
                )
                for change in gains
            ),
            left=float(remaining[row]),
        )
        for row, share in enumerate(found)
    )


def means(values: Floats, rows: NDArray[np.int64], count: int) -> NDArray[np.float64]:
    """Return the means (..., count) of values (..., N) by object; ``rows`` (N,) names it."""
    sums = [np.bincount(rows, weights, count) for weights in values.reshape(-1, len(rows))]
    return np.reshape(sums, (*values.shape[:-1], count)) / np.bincount(rows, minlength=count)


def shares(
    players: Iterable[Player],
    value: Callable[[frozenset[Player]], Any],
    seed: int,
    exact_players: int,
    orders: int,
) -> tuple[tuple[Any, ...], tuple[float, ...], int]:
    """Return the shares of players in a game, their standard errors, and the orders drawn.

    ``value`` returns a number or array for a subset; it is called more than once per subset. Up to
    ``exact_players`` all orders are taken, and the standard errors are 0. For more players
    ``orders`` are drawn, an even number of at least 4.
    """
    players = tuple(players)
    # All orders, or pairs of random ones.
    is_exact = len(players) <= exact_players
    rng = np.random.default_rng(seed)
    walks: list[Sequence[int]] = [*permutations(range(len(players)))] if is_exact else []
    while not is_exact and len(walks) < orders:
        order = rng.permutation(len(players)).tolist()
        walks += [order, order[::-1]]  # an order and its reverse, to cancel noise
    gains: dict[Player, list[Any]] = {player: [] for player in players}
    for walk in walks:
        subset: frozenset[Player] = frozenset()
        before = value(subset)
        for position in walk:
            subset |= {players[position]}
            after = value(subset)
            gains[players[position]].append(after - before)
            before = after
    found = tuple(sum(gain) / len(walks) for gain in gains.values())
    if is_exact:
        return found, (0.0,) * len(players), 0
    errors = []
    for gain in gains.values():
        # An order and its reverse depend on each other: together they are one draw.
        pairs = np.array([np.mean(change) for change in gain]).reshape(-1, 2).mean(axis=1)
        errors.append(float(pairs.std(ddof=1) / np.sqrt(len(pairs))))
    return found, tuple(errors), orders


def dominating(effects: Mapping[str, Floats], counted: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return (H, W): the place of the dominating effect among ``{name: ΔE2000 removed (H, W)}``.

    :data:`NONE` if no effect removes :data:`LEAST`, :data:`UNCOUNTED` if a pixel does not count.
    """
    places = np.full(counted.shape, NONE)
    if effects:
        removed = np.stack(list(effects.values()))
        places = np.where(removed.max(axis=0) >= LEAST, removed.argmax(axis=0), NONE)
    return np.where(counted, places, UNCOUNTED)


def with_effects_named(comparison: Comparison, causes: Causes) -> ComparisonRecord:
    """Return a comparison's record in which regions, shapes and materials name their effect.

    The maps of what each effect removes may be smaller. A shape whose intervals are known names the
    effects that are tied there.
    """
    record = comparison.record
    images = comparison.images
    maps = {name: _enlarged(values, images.counted.shape) for name, values in causes.maps.items()}
    intervals = {
        shape.name: dict(zip(maps, shape.removes, strict=True)) for shape in causes.record.objects
    }

    def in_region(region: Region) -> dict[str, float]:
        rows = slice(region.y, region.y + region.height)
        columns = slice(region.x, region.x + region.width)
        return {name: float(values[rows, columns].mean()) for name, values in maps.items()}

    def each(objects: Any, places: Any, known: Mapping[str, Mapping[str, Interval]]) -> Any:
        """Name the effects by the maps' cell in which each pixel of an object lies."""
        seen = places >= 0
        found = {
            name: means(values[seen], places[seen], len(objects)) for name, values in maps.items()
        }
        return tuple(
            structs.replace(
                item,
                effect=in_words(
                    {name: of[row] for name, of in found.items()}, known.get(item.name)
                ),
            )
            for row, item in enumerate(objects)
        )

    return structs.replace(
        record,
        regions=tuple(
            structs.replace(region, effect=in_words(in_region(region))) for region in record.regions
        ),
        objects=each(record.objects, images.objects, intervals),
        materials=each(record.materials, images.materials, {}),
    )


def in_words(
    found: Mapping[str, float], intervals: Mapping[str, Interval] | None = None
) -> str | None:
    """Return the effect of the largest mean ``{name: ΔE2000}``, and a second one that has half.

    With ``intervals`` their values count, and effects that are tied with the first are named with
    it. None if no mean reaches :data:`LEAST`.
    """
    if intervals:
        found = {name: interval.value for name, interval in intervals.items()}
    seen = [name for name in sorted(found, key=lambda name: -found[name]) if found[name] >= LEAST]
    if not seen:
        return None
    alike = tied({name: intervals[name] for name in seen}) if intervals else seen[:1]
    if len(alike) > 1:
        return TIED.join(alike)
    first, *others = seen
    if others and found[others[0]] >= ALSO * found[first]:
        return f"{first}, then {others[0]}"
    return first


def _enlarged(values: Floats, shape: tuple[int, ...]) -> Floats:
    height, width = shape
    rows = np.arange(height) * values.shape[0] // height
    columns = np.arange(width) * values.shape[1] // width
    return values[np.ix_(rows, columns)]
