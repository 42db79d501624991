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
from fotismos.comparisons.departure.estimate import contrasts
from fotismos.comparisons.departure.metrics import LEADING, Pixelwise
from fotismos.comparisons.departure.noise import (
    USUAL,
    Halves,
    distances_between,
    visible_shares,
    without_noise,
)
from fotismos.comparisons.departure.regions import find_objects
from fotismos.comparisons.hybrids import HybridImages, HybridScenes, Pairs, labels
from fotismos.comparisons.prepared import Prepared
from fotismos.comparisons.records.comparison import (
    CAUSES,
    Attribution,
    ComparisonRecord,
    Contribution,
    Hybrid,
    ObjectContribution,
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
from fotismos.reference.rendering.passes import Progress, Stream, passes
from fotismos.reference.rendering.sums import Grouped, block_numbers, jackknifed

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

SLOWEST = float(np.sqrt(4 / 3))
"""Least growth of the noise with half of the samples that noise is extrapolated by."""

MORE = 4
PATIENCE = 2
AFFORDABLE = 2**24
"""If causes do not add up, they take MORE times the samples, up to PATIENCE times the comparison's
own samples, or AFFORDABLE ones, over all images. The limit is not in seconds: a result must not
depend on how busy the machine was."""

CLOSED = 0.025
"""Largest closure, as a share of the departure, that needs no more samples; its interval may have
eight times the width."""

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
    record = structs.replace(with_effects_named(comparison, causes.maps), why=causes.record)
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
    reference = ready.reference.sampled(spp)
    while True:
        # Seeds that no hybrid has, and as many passes as a hybrid has replicates.
        loop = passes(
            [reference], ready.options.seed, REPLICATES, size=size, stream=Stream.OTHER_SIDE,
            progress=progress, stage="reference",
        )  # fmt: skip
        groups = np.stack([np.array(rendered[0]) for rendered in loop])
        meter = ErrorMeter(groups, surface.hit, ready.options.viewing, leading)
        images = HybridImages(
            pairs,
            scenes,
            replicates=REPLICATES,
            replicate_spp=reference.pass_spp,
            seed=ready.options.seed,
            size=size,
            progress=progress,
        )
        found = attribute(
            images,
            meter,
            shapes=surface.shape,
            seed=ready.options.seed,
            clean=clean,
            whole=width * height,
        )
        more = MORE * reference.pass_spp
        count = len(found.record.hybrids) * REPLICATES
        is_enough = count * more * size[0] * size[1] > limit
        if is_closed(found.record) or is_enough:
            return found
        reference = reference.sampled(more)


def is_closed(record: Attribution) -> bool:
    """Return whether the effects add up to the departure, as nearly as :data:`CLOSED` asks."""
    width = record.closure.high - record.closure.low
    is_near = abs(record.closure.value) <= CLOSED * record.departure
    return is_near and width <= 8 * CLOSED * record.departure


class ErrorMeter:
    """Errors in ΔE2000 against a reference, without the noise of both.

    ``groups`` (R, H, W, 3) are passes of the reference, one per replicate of an image. ``counted``
    (H, W) are the pixels that count. ``metric`` is ΔE2000.
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
        self._groups = np.asarray(groups)[:, counted].astype(float)
        _, self._blocks = np.unique(block_numbers(counted), return_inverse=True)

    def without_noise(self, images: Floats, growth: float = USUAL) -> NDArray[np.float64]:
        """Return the error (2, R + 1, N) of each counted pixel, without the noise of both images.

        By two rules, each first for the mean of all replicates (R, H, W, 3), then leaving out each
        in turn.

        A distance is never negative, so noise raises it, and most where it is small. So the noise
        of both images is added once more, and the increase of each block of pixels is taken away
        (:func:`fotismos.comparisons.departure.noise.without_noise`). Within a block each pixel
        keeps its share. The first rule supposes that noise alone would grow by √2. The noise of few
        path-traced samples is skewed, and colour spaces compress it, so it grows by less (1.37 in
        the Cornell box at 64 samples, 1.25 in a room with a mirror), and the rule leaves a part of
        it. The second one supposes the ``growth`` that halves of the replicates show. It takes away
        too much where the departure is far larger than the noise.
        """
        images = np.asarray(images)[:, self.counted].astype(float)
        rules: tuple[list[Doubles], list[Doubles]] = ([], [])
        for chosen, references in self._references:
            noisier = self._noisier(images[chosen])
            differences = map(self.metric.difference, references, noisier)
            plain = next(differences)
            noisy = list(differences)
            before = np.bincount(self._blocks, plain).astype(float)
            after = np.bincount(self._blocks, np.mean(noisy, axis=0)).astype(float)
            for errors, assumed in zip(rules, (USUAL, growth), strict=True):
                kept = ratio(without_noise(before, after, assumed), before)
                errors.append(plain * kept[self._blocks])
        return np.array(rules)

    def halves(self, images: Floats) -> Halves:
        """Return how far halves of the replicates (R, H, W, 3) of an image are from each other.

        That is of its difference from the reference, whose light is not compared.
        """
        differences = np.asarray(images)[:, self.counted].astype(float) - self._groups
        shown = differences.mean(axis=0) + self._groups.mean(axis=0)
        between = distances_between(self.metric, shown, self.viewing)
        return Halves.of(between, differences, np.ones(len(differences)))

    def visible(self, images: Floats, everything: Floats, pixels: int) -> tuple[VisibleShare, ...]:
        """Return the shares of pixels that differ visibly, without noise.

        Images (R, H, W, 3) are compared with those in which ``everything`` is simulated: they share
        paths, and with them most of the noise. The intervals also hold the shares of a picture of
        more ``pixels``, of which these are drawn.
        """
        images = np.asarray(images)[:, self.counted].astype(float)
        everything = np.asarray(everything)[:, self.counted].astype(float)
        blocks = int(self._blocks.max()) + 1
        grouped = Grouped(
            means=images - everything,
            sizes=np.ones(len(images), int),
            places=np.arange(images.shape[1]),
            blocks=self._blocks,
            sampled=blocks,
            total=blocks,
        )
        shares = visible_shares(self.metric, images.mean(axis=0), grouped, self.viewing)
        return tuple(_drawn(share, images.shape[1], pixels) for share in shares)

    @cached_property
    def _references(self) -> list[tuple[NDArray[np.int64], list[Doubles]]]:
        """For each jackknifed set: which replicates it holds, and the reference's coordinates.

        The coordinates are without added noise first, then with noise added in each way.
        """
        count = len(self._groups)
        sets = [np.arange(count), *(np.delete(np.arange(count), out) for out in range(count))]
        # The opposite sign of an image's: the noise of both is independent.
        return [(chosen, self._noisier(self._groups[chosen], -1)) for chosen in sets]

    def _noisier(self, images: Floats, sign: int = 1) -> list[Doubles]:
        """Return the coordinates of the mean of images (n, N, 3), and of it with added noise."""
        mean = images.mean(axis=0)
        noise = np.tensordot(contrasts(np.ones(len(images))), images, 1)
        shown = (mean, *(mean + sign * deviation for deviation in noise))
        return [self.metric.coordinates(pixels, self.viewing) for pixels in shown]


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
    noise = meter.halves(with_all)
    growth = float(np.clip(noise.growth, SLOWEST, USUAL))
    rules: dict[frozenset[Effect], Floats] = {}

    def both(simulated: frozenset[Effect]) -> Floats:
        """Errors (2, R + 1, N) in ΔE2000: by both rules of the meter, which see."""
        if simulated not in rules:
            found = images.pixels(images.simulating(simulated))
            rules[simulated] = meter.without_noise(found, growth)
        return rules[simulated]

    def error(simulated: frozenset[Effect]) -> Floats:
        """Errors (R + 1, N): the middle of both rules."""
        errors: Floats = both(simulated).mean(axis=0)
        return errors

    gains, sampling_errors, drawn = shares(
        effects, both, seed=seed, exact_players=EXACT_EFFECTS, orders=ORDERS
    )
    # A gain is a change of the error: an effect that removes some has a negative one.
    removed = {e.label: -gain for e, gain in zip(effects, gains, strict=True)}
    departure = error(nothing)
    left = error(everything)
    bias = BIAS * float(departure[0].mean())
    if noise.are_heavy:  # the closure shows how much of the noise was not taken away
        bias = max(bias, min(abs(float(left[0].mean())), noise.below))
    contributions = tuple(
        Contribution(
            effect=effect.label,
            removes=by_both_rules(removed[effect.label].mean(axis=-1), bias),
            alone=float((error(nothing) - error(frozenset({effect})))[0].mean()),
            last=float((error(everything - {effect}) - error(everything))[0].mean()),
            sampling_error=sampling_error,
        )
        for effect, sampling_error in zip(effects, sampling_errors, strict=True)
    )
    # What noise leaves in the closure is no fault: it may explain as much as halves differ in.
    remaining = both(everything).mean(axis=-1)
    if noise.are_heavy:
        bias = max(bias, noise.below)
    if noise.are_heavy and noise.measured.mean() <= noise.halves.mean():
        bias = max(bias, float(np.abs(remaining).max()))
    closure = by_both_rules(remaining, bias)
    hybrids = [
        Hybrid(effects=labels(effects, simulated), error=float(error(simulated)[0].mean()))
        for simulated in rules
    ]

    def filled(values: Floats) -> NDArray[np.float64]:
        whole = np.zeros(meter.counted.shape)
        whole[meter.counted] = values
        return whole

    previews = images.previews(rules, clean)
    kernel = images.pixels(images.plain_kernel).mean(axis=0)
    # The kernel and its plugin compute the same: what differs is rounding.
    plugin = images.pixels(images.plugin(nothing)).mean(axis=0)
    rounding = meter.metric(plugin, kernel, meter.viewing)[meter.counted]
    return Causes(
        record=Attribution(
            effects=contributions,
            departure=float(departure[0].mean()),
            closure=Interval(value=closure.value, low=closure.low, high=closure.high),
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
        maps={name: filled(change[:, 0].mean(axis=0)) for name, change in removed.items()},
        departure=filled(departure[0]),
        left=filled(left[0]),
        counted=meter.counted,
        previews={hybrid.effects: image for hybrid, image in zip(hybrids, previews, strict=True)},
        visible={
            labels(effects, simulated): meter.visible(
                images.pixels(images.simulating(simulated)),
                with_all,
                whole,
            )
            for simulated in rules
        },
    )


def by_both_rules(values: Floats, bias: float) -> Interval:
    """Return the middle of what both rules find (2, R + 1), and an interval that holds both.

    ``bias`` is half its width, at least.
    """
    gap = abs(float(values[0, 0] - values[1, 0]))
    return jackknifed(values.mean(axis=0), max(bias, gap))


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
                by_both_rules(change[..., row], BIAS * share.mean_dE2000) for change in gains
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


def with_effects_named(comparison: Comparison, effects: Mapping[str, Floats]) -> ComparisonRecord:
    """Return a comparison's record in which regions, shapes and materials name their effect.

    ``effects`` are ``{name: (h, w)}``, the ΔE2000 that each removes; the maps may be smaller.
    """
    record = comparison.record
    images = comparison.images
    maps = {name: _enlarged(values, images.counted.shape) for name, values in effects.items()}

    def in_region(region: Region) -> dict[str, float]:
        rows = slice(region.y, region.y + region.height)
        columns = slice(region.x, region.x + region.width)
        return {name: float(values[rows, columns].mean()) for name, values in maps.items()}

    def each(objects: Any, places: Any) -> Any:
        """Name the effects by the maps' cell in which each pixel of an object lies."""
        seen = places >= 0
        found = {
            name: means(values[seen], places[seen], len(objects)) for name, values in maps.items()
        }
        return tuple(
            structs.replace(item, effect=in_words({name: of[row] for name, of in found.items()}))
            for row, item in enumerate(objects)
        )

    return structs.replace(
        record,
        regions=tuple(
            structs.replace(region, effect=in_words(in_region(region))) for region in record.regions
        ),
        objects=each(record.objects, images.objects),
        materials=each(record.materials, images.materials),
    )


def in_words(found: Mapping[str, float]) -> str | None:
    """Return the effect of the largest mean ``{name: ΔE2000}``, and a second one that has half.

    None if no mean reaches :data:`LEAST`.
    """
    ordered = sorted(found, key=lambda name: found[name], reverse=True)
    if not ordered or found[ordered[0]] < LEAST:
        return None
    first, *others = ordered
    if others and found[others[0]] >= max(ALSO * found[first], LEAST):
        return f"{first}, then {others[0]}"
    return first


def _enlarged(values: Floats, shape: tuple[int, ...]) -> Floats:
    height, width = shape
    rows = np.arange(height) * values.shape[0] // height
    columns = np.arange(width) * values.shape[1] // width
    return values[np.ix_(rows, columns)]
