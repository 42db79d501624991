"""Attribution: the error that each effect removes, and the time that it adds.

Both depend on what is simulated already: shadows without the light between surfaces can look worse
than neither. So each is a Shapley value over the effects in which the halves differ: for players
``N`` and a value ``v(S)`` of each subset, the share of player ``i`` is ::

    phi_i = sum over S in N without i of  |S|! (n - |S| - 1)! / n!  [v(S + i) - v(S)]

its mean gain over all orders in which the players may come. The shares add up to
``v(N) - v(empty)``: the errors removed to the departure less the closure, in the mean and in every
pixel, and the times to the difference between reference and kernel. The closure is the error that
remains when all effects are simulated; only a fault can cause it.
Source: L. S. Shapley, *A value for n-person games*, 1953.

The departure is also split into parts, by a chain of images from the kernel to the reference:

==================  ==========================================================================
Part                Between
==================  ==========================================================================
interpolation       the kernel as requested, and with an exact normal at each point
implementation      the kernel, and the ``phong`` plugin under Mitsuba's direct light: nothing
spectral            the heuristic half's variant, and the reference's
visibility          no shadows, and shadows
light form          the heuristic half's lights, and the physical ones
BSDF form           phong, and the physical BSDFs, both with direct light
transport           direct light, and all light
==================  ==========================================================================

Every part is a signed linear image, later minus earlier: the parts add up to reference minus kernel
in every pixel. A part that the scene does not have is left out; implementation, BSDF form and
transport are always there.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import comb
from typing import Annotated, Any, cast

import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from comparisons import intervals
from comparisons.departure.blocks import ratio
from comparisons.departure.colour import Viewing
from comparisons.departure.metrics import LEADING, Metric, Pixelwise, delta_e_2000
from comparisons.departure.noise import contrasts, without_noise
from comparisons.departure.regions import find_objects, means
from comparisons.hybrids.hybrids import (
    KERNEL,
    PLAIN_KERNEL,
    REFERENCE,
    HybridImages,
    Key,
    Player,
    Replicates,
    labels,
    subsets,
)
from reference.planning.effects import PARTS, POLYGONS, Effect
from reference.records import Amount, Estimated, Positive, Record, Size
from reference.rendering.gbuffer import ObjectIds
from reference.rendering.sums import Estimate, block_numbers

ALWAYS = ("implementation", "BSDF form", "transport")


class Contribution(Record):
    """What simulating one effect removes and adds.

    Attributes
    ----------
    effect
        Its label.
    removes
        Mean ΔE2000 that it removes; negative if it increases the departure.
    alone, last
        The same if it is the first effect added, and the last.
    adds_s
        Seconds that it adds to one rendering with Attribution.spp samples per pixel.
    sampling_error
        Standard error of ``removes`` from drawing orders; 0 if all subsets were rendered.
    """

    effect: str
    removes: Estimated
    alone: float
    last: float
    adds_s: Estimated
    sampling_error: Amount


class ObjectContribution(Record):
    """What each effect removes from the departure on one shape.

    Weighted by their pixels, the values of all shapes average to those of the whole image.

    Attributes
    ----------
    name
        Id of the shape.
    pixels
        Number of counted pixels that see it.
    share
        Its part of the departure.
    departure
        Mean ΔE2000 of the heuristic half on it, without noise.
    removes
        Mean ΔE2000 that each effect removes there, in the order of the attribution's effects.
    left
        Mean ΔE2000 that remains there when all effects are simulated.
    """

    name: str
    pixels: Size
    share: float
    departure: float
    removes: tuple[Estimated, ...]
    left: float


class MeanError(Record):
    """A mean ΔE2000 with its 95 % interval; without noise it may come out below 0."""

    mean: float
    low: float
    high: float


class Hybrid(Record):
    """An image in which some effects are simulated.

    Attributes
    ----------
    effects
        Labels of the simulated effects.
    error
        Mean ΔE2000 against the reference, with noise removed; it may come out below 0.
    seconds
        Median time of one rendering.
    """

    effects: tuple[str, ...]
    error: float
    seconds: float


class Attribution(Record):
    """What all effects remove and add.

    Attributes
    ----------
    effects
        One contribution each.
    departure
        Mean ΔE2000 of the heuristic half without noise: the sum of what is removed and the closure.
    floor
        Mean ΔE2000 of noise alone: of the reference rendered with as many samples.
    kernel_s, reference_s
        Seconds without any effect, and with all of them.
    spp, replicates, orders
        Samples per pixel of each replicate, number of replicates, and orders drawn (0: every
        subset).
    hybrids
        All images that were rendered, fewest effects first.
    """

    effects: tuple[Contribution, ...]
    departure: float
    floor: Amount
    kernel_s: Positive
    reference_s: Positive
    spp: int
    replicates: int
    orders: int
    hybrids: tuple[Hybrid, ...] = ()


class Part(Record):
    """One cause of the departure.

    Attributes
    ----------
    name
        Its name in tables.
    mean, mean_stderr
        Signed mean over the counted pixels and channels, linear, and its standard error.
    rms
        Root mean square.
    dE2000
        Mean ΔE2000 between the two images; the values of parts do not add up.
    """

    name: str
    mean: float
    mean_stderr: Amount
    rms: Amount
    dE2000: Amount


class Split(Record):
    """The departure by causes, which add up at every pixel."""

    parts: Annotated[tuple[Part, ...], Meta(description="From the kernel to the reference.")]
    departure: Part


class ErrorMeter:
    """Errors against a converged reference whose own noise is known.

    ``counted`` (H, W) are the pixels that count, and the error is the mean of ``metric``.
    ``groups`` (R, H, W, 3) are means of groups of the reference's passes, one per replicate of an
    image; only :meth:`without_noise` needs them.
    """

    def __init__(
        self,
        reference: Estimate,
        counted: NDArray[np.bool_],
        viewing: Viewing,
        metric: Metric = LEADING,
        groups: NDArray | None = None,
    ) -> None:
        self.metric, self.viewing, self.counted = metric, viewing, counted
        self._reference = reference.mean[counted]
        self._distances = metric.against(reference.mean, counted, viewing)
        self.variance = float(np.mean(reference.standard_error[counted] ** 2))
        """Mean variance of the reference, which adds to each mean squared error."""
        self.floor = metric.mean(self._distances(reference.mean + reference.noise))
        """Error from the reference's noise alone."""
        if groups is not None:
            self._groups = np.asarray(groups)[:, counted].astype(float)
            _, self._blocks = np.unique(block_numbers(counted), return_inverse=True)

    def errors(self, image: NDArray) -> tuple[float, float]:
        """Return the metric's mean, and the linear MSE less the reference's variance (may be < 0).

        ``image`` is (H, W, 3).
        """
        image = np.asarray(image, float)
        mse = float(np.mean((image[self.counted] - self._reference) ** 2)) - self.variance
        return self.metric.mean(self._distances(image)), mse

    def without_noise(self, images: NDArray) -> NDArray[np.float64]:
        """Return the error (R + 1, N) of each counted pixel, without the noise of both images.

        First for the mean of all replicates (R, H, W, 3), then leaving out each in turn.

        A distance is never negative, so noise raises it, and most where it is small. So the noise
        of both images is added once more, and the increase of each block of pixels is taken away:
        ``f² = 2 f0² − f1²`` (:mod:`comparisons.departure.noise`). Within a block each pixel
        keeps its share. The rule is exact where doubled variance raises a mean distance by √2. The
        noise of few path-traced samples is skewed, and colour spaces compress it, so it raises
        distances by less (1.37 in the Cornell box at 64 samples): up to a fifth of the noise's part
        remains there, and two fifths where a departure is near the size of the noise.
        """
        images = np.asarray(images)[:, self.counted].astype(float)
        metric = cast(Pixelwise, self.metric)  # the leading one is
        found = []
        for chosen, references in self._references:
            plain, *noisy = (
                metric.difference(reference, shown)
                for reference, shown in zip(references, self._noisier(images[chosen]), strict=True)
            )
            before, after = (
                np.bincount(self._blocks, each).astype(float)
                for each in (plain, np.mean(noisy, axis=0))
            )
            found.append(plain * ratio(without_noise(before, after), before)[self._blocks])
        return np.stack(found)

    @cached_property
    def _references(self) -> list[tuple[NDArray, list[NDArray]]]:
        """For each jackknifed set: which replicates it holds, and the reference's coordinates.

        The coordinates are without added noise first, then with noise added in each way.
        """
        count = len(self._groups)
        sets = [np.arange(count), *(np.delete(np.arange(count), out) for out in range(count))]
        # The opposite sign of an image's: the noise of both is independent.
        return [(chosen, self._noisier(self._groups[chosen], -1)) for chosen in sets]

    def _noisier(self, images: NDArray, sign: int = 1) -> list[NDArray]:
        """Return the coordinates of the mean of images (n, N, 3), and of it with added noise."""
        mean, noise = images.mean(axis=0), np.tensordot(contrasts(np.ones(len(images))), images, 1)
        shown = (mean, *(mean + sign * each for each in noise))
        metric = cast(Pixelwise, self.metric)
        return [metric.coordinates(pixels, self.viewing) for pixels in shown]


@dataclass(frozen=True)
class Causes:
    """The attribution, its closure, and where in the image the effects remove what.

    ``maps`` are ``{effect: (H, W)}``, the ΔE2000 that each removes; with ``left``, what remains
    when all are simulated, they add up to ``departure``. ``previews`` are ``{labels of the
    simulated effects: (f H, f W, 3)}``, linear. ``removed`` are ``{effect: (R + 1, N)}`` over the
    counted pixels, by all replicates, then leaving out each in turn.
    """

    attribution: Attribution
    closure: MeanError
    maps: dict[str, NDArray]
    departure: np.ndarray
    left: np.ndarray
    previews: dict[tuple[str, ...], NDArray]
    removed: dict[str, NDArray]


def attribute(
    images: HybridImages, meter: ErrorMeter, seed: int, exact_effects: int, orders: int
) -> Causes:
    """Attribute errors and times to the effects; the last three arguments as in `shares`."""
    effects, everything = images.effects, frozenset(images.effects)
    nothing: frozenset[Effect] = frozenset()
    if len(effects) <= exact_effects:
        images.render(key for each in subsets(effects) for key in images.needed(each))
    errors: dict[frozenset[Effect], NDArray] = {}

    def image(simulated: frozenset[Effect]) -> Replicates:
        # Not the reference itself, which would hide errors of the scene's edits.
        is_whole = simulated == everything
        return images.of(images.whole) if is_whole else images.simulating(simulated)

    def error(simulated: frozenset[Effect]) -> NDArray:
        """Errors (R + 1, N) in ΔE2000: of all replicates, then leaving out each in turn."""
        if simulated not in errors:
            errors[simulated] = meter.without_noise(image(simulated).images)
        return errors[simulated]

    def seconds(simulated: frozenset[Effect]) -> NDArray:
        return images.simulating(simulated).seconds

    gains, sampling_errors, drawn = shares(effects, error, seed, exact_effects, orders)
    times, _, _ = shares(effects, seconds, seed, exact_effects, orders)
    removed = {e.label: -gain for e, gain in zip(effects, gains, strict=True)}
    contributions = tuple(
        Contribution(
            effect=effect.label,
            removes=intervals.jackknifed(removed[effect.label].mean(axis=1)),
            alone=float((error(nothing) - error(frozenset({effect})))[0].mean()),
            last=float((error(everything - {effect}) - error(everything))[0].mean()),
            adds_s=intervals.of_mean(time),
            sampling_error=sampling_error,
        )
        for effect, time, sampling_error in zip(effects, times, sampling_errors, strict=True)
    )
    mean = intervals.jackknifed(error(everything).mean(axis=1))
    hybrids = [
        Hybrid(
            effects=labels(effects, each),
            error=float(found[0].mean()),
            seconds=float(np.median(seconds(each))),
        )
        for each, found in errors.items()
    ]
    own = images.of(REFERENCE)

    def filled(values: NDArray) -> NDArray[np.float64]:
        whole = np.zeros(meter.counted.shape)
        whole[meter.counted] = values
        return whole

    return Causes(
        attribution=Attribution(
            effects=contributions,
            departure=float(error(nothing)[0].mean()),
            floor=meter.errors(own.images.mean(axis=0))[0],
            kernel_s=float(images.of(KERNEL).seconds.mean()),
            reference_s=float(own.seconds.mean()),
            spp=images.spp,
            replicates=images.replicates,
            orders=drawn,
            hybrids=tuple(sorted(hybrids, key=lambda each: (len(each.effects), each.effects))),
        ),
        closure=MeanError(mean=mean.value, low=mean.low, high=mean.high),
        maps={name: filled(each[0]) for name, each in removed.items()},
        departure=filled(error(nothing)[0]),
        left=filled(error(everything)[0]),
        previews={labels(effects, each): image(each).preview for each in errors},
        removed=removed,
    )


def by_object(
    causes: Causes, counted: NDArray[np.bool_], objects: ObjectIds
) -> tuple[ObjectContribution, ...]:
    """Return what the effects remove on each shape, the one with most of the departure first."""
    found, places = find_objects(causes.departure, counted, objects)
    rows, count = places[counted], len(found)
    removed = [means(each, rows, count) for each in causes.removed.values()]
    left = means(causes.left[counted], rows, count)
    return tuple(
        ObjectContribution(
            name=one.name,
            pixels=one.pixels,
            share=one.share,
            departure=one.mean_dE2000,
            removes=tuple(intervals.jackknifed(each[:, row]) for each in removed),
            left=float(left[row]),
        )
        for row, one in enumerate(found)
    )


def shares(
    players: Iterable[Player],
    value: Callable[[frozenset[Player]], Any],
    seed: int,
    exact_players: int,
    orders: int,
) -> tuple[tuple[Any, ...], tuple[float, ...], int]:
    """Return the shares of players in a game, their standard errors, and the orders drawn.

    ``value`` returns a number or array for a subset; it is called more than once per subset. Up to
    ``exact_players`` every subset is valued, the standard errors are 0 and no order is drawn. For
    more players ``orders`` are drawn, an even number of at least 4.
    """
    players = tuple(players)
    if len(players) <= exact_players:
        exact = tuple(_exact(player, players, value) for player in players)
        return exact, (0.0,) * len(players), 0
    gains: dict[Player, list[Any]] = {player: [] for player in players}
    rng = np.random.default_rng(seed)
    for _ in range(orders // 2):  # in pairs, each order followed by its reverse, to cancel noise
        order = rng.permutation(len(players))
        for way in (order, order[::-1]):
            subset: frozenset[Player] = frozenset()
            before = value(subset)
            for place in way:
                subset |= {players[place]}
                after = value(subset)
                gains[players[place]].append(after - before)
                before = after
    errors = []
    for gain in gains.values():
        pairs = np.array([np.mean(each) for each in gain]).reshape(-1, 2).mean(axis=1)
        errors.append(float(pairs.std(ddof=1) / np.sqrt(len(pairs))))
    return tuple(sum(gain) / orders for gain in gains.values()), tuple(errors), orders


def _exact(
    player: Player, players: tuple[Player, ...], value: Callable[[frozenset[Player]], Any]
) -> Any:
    others = [other for other in players if other != player]
    total = 0.0
    for subset in subsets(others):
        weight = 1 / (len(players) * comb(len(others), len(subset)))
        total = total + weight * (value(subset | {player}) - value(subset))
    return total


def split(
    images: HybridImages, counted: NDArray[np.bool_], viewing: Viewing
) -> tuple[Split, Mapping[str, NDArray], NDArray]:
    """Return the departure's parts, their images (H, W, 3), and the image of their sum."""
    effects, simulated = set(images.effects), frozenset[Effect]()
    chain: list[tuple[str, Key]] = [("", KERNEL)]
    if POLYGONS in effects:
        chain.append((str(POLYGONS.part), PLAIN_KERNEL))
    chain.append(("implementation", simulated))
    for name in PARTS[1:-1]:
        added = {effect for effect in effects if effect.part == name}
        if added or name in ALWAYS:
            simulated |= added
            chain.append((name, simulated))
    chain.append((PARTS[-1], REFERENCE))

    images.render(key for _, key in chain)
    rendered = [images.of(key).images.astype(float) for _, key in chain]
    parts = [
        _part(name, *step, counted, viewing)
        for (name, _), step in zip(chain[1:], pairwise(rendered), strict=True)
    ]
    whole, difference = _part("departure", rendered[0], rendered[-1], counted, viewing)
    pictures = {part.name: picture for part, picture in parts}
    return Split(parts=tuple(part for part, _ in parts), departure=whole), pictures, difference


def _part(
    name: str, before: NDArray, after: NDArray, counted: NDArray[np.bool_], viewing: Viewing
) -> tuple[Part, NDArray]:
    signed = after - before
    each = signed[:, counted].mean(axis=(1, 2))
    mean = signed.mean(axis=0)
    distance = delta_e_2000(after.mean(axis=0), before.mean(axis=0), viewing)
    part = Part(
        name=name,
        mean=float(each.mean()),
        mean_stderr=float(each.std(ddof=1) / np.sqrt(len(each))),
        rms=float(np.sqrt(np.mean(mean[counted] ** 2))),
        dE2000=float(distance[counted].mean()),
    )
    return part, mean
