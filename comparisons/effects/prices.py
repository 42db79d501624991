"""The price of an effect: the error that it removes, and the time that it adds.

Both depend on what is simulated already: shadows without the light between surfaces can look worse
than neither. The price is therefore the Shapley value over the effects in which the halves differ
(:mod:`comparisons.effects.shapley`): the mean over all orders in which they can be added. The
errors removed add up to the departure less the closure, in the mean and in every pixel, and the
times to the difference between reference and kernel. The closure is the error that remains when all
effects are simulated; only a fault can cause it.

All errors are without noise (:mod:`comparisons.effects.noiseless`).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from comparisons import intervals
from comparisons.cost.cost_record import Closure, Price, Prices
from comparisons.effects import shapley
from comparisons.effects.corners import corners, labels
from comparisons.effects.lattice import Lattice, Replicates
from comparisons.effects.noiseless import Noiseless
from reference.effects.effect import Effect

Errors = dict[frozenset[Effect], NDArray]


@dataclass(frozen=True)
class Priced:
    """Prices, and where in the image they are paid.

    Attributes
    ----------
    prices
        The means.
    closure
        The mean error that remains when all effects are simulated.
    maps
        ``{effect: (H, W)}``: the ΔE2000 that each removes.
    departure
        (H, W): the ΔE2000 of the heuristic half, the sum of ``maps`` and ``left``.
    left
        (H, W): the ΔE2000 that remains when all effects are simulated.
    previews
        ``{labels of the effects that are simulated: (f H, f W, 3)}``, linear.
    removed
        ``{effect: (R + 1, N)}``: the ΔE2000 that each removes from the counted pixels, by all
        replicates, then leaving out each in turn.
    """

    prices: Prices
    closure: Closure
    maps: dict[str, NDArray]
    departure: np.ndarray
    left: np.ndarray
    previews: dict[tuple[str, ...], NDArray]
    removed: dict[str, NDArray]


def prices(
    lattice: Lattice,
    noiseless: Noiseless,
    seed: int = 0,
    exact_effects: int = shapley.EXACT_PLAYERS,
    orders: int = shapley.ORDERS,
) -> Priced:
    """Return the prices of a lattice's effects.

    Parameters
    ----------
    lattice
        The images.
    noiseless
        Measures their errors.
    seed
        Of the orders drawn if there are many effects.
    exact_effects, orders
        See :func:`comparisons.effects.shapley.shares`.
    """
    judge, counted = noiseless.judge, noiseless.judge.counted
    effects, everything = lattice.effects, frozenset(lattice.effects)
    if len(effects) <= exact_effects:
        lattice.render(key for each in shapley.subsets(effects) for key in lattice.needed(each))
    lattice.render([lattice.grafted])
    errors: Errors = {}

    def image(simulated: frozenset[Effect]) -> Replicates:
        # Not the reference itself, which would hide errors of the scene's edits.
        is_whole = simulated == everything
        return lattice.of(lattice.grafted) if is_whole else lattice.simulating(simulated)

    def error(simulated: frozenset[Effect]) -> NDArray:
        """Errors (R + 1, N) in ΔE2000: of all replicates, then leaving out each in turn."""
        if simulated not in errors:
            errors[simulated] = noiseless.errors(image(simulated).images)
        return errors[simulated]

    def time(simulated: frozenset[Effect]) -> NDArray:
        return lattice.simulating(simulated).seconds

    nothing: frozenset[Effect] = frozenset()
    shares = shapley.shares(effects, error, seed, exact_effects, orders)
    times = shapley.shares(effects, time, seed, exact_effects, orders)
    found, all_removed = [], {}
    for place, effect in enumerate(effects):
        removed = all_removed[effect.label] = -shares.values[place]
        others = everything - {effect}
        found.append(
            Price(
                effect=effect.label,
                removes=intervals.jackknifed(removed.mean(axis=1)),
                alone=float((error(nothing) - error(frozenset({effect})))[0].mean()),
                last=float((error(others) - error(everything))[0].mean()),
                adds_s=intervals.of_mean(times.values[place]),
                sampling_error=shares.sampling_error[place],
            )
        )
    departure, left = (_filled(error(each)[0], counted) for each in (nothing, everything))
    reached = corners(effects, errors, error, time)
    previews = {labels(effects, each): image(each).preview for each in errors}
    own = lattice.of("reference")
    priced = Prices(
        effects=tuple(found),
        departure=float(error(nothing)[0].mean()),
        floor=judge.errors(own.images.mean(axis=0))[0],
        kernel_s=float(lattice.of("kernel").seconds.mean()),
        reference_s=float(own.seconds.mean()),
        spp=lattice.spp,
        replicates=lattice.replicates,
        orders=shares.orders,
        corners=reached,
    )
    mean = intervals.jackknifed(error(everything).mean(axis=1))
    closure = Closure(mean=mean.value, low=mean.low, high=mean.high)
    maps = {name: _filled(removed[0], counted) for name, removed in all_removed.items()}
    return Priced(priced, closure, maps, departure, left, previews, all_removed)


def _filled(values: NDArray, counted: NDArray[np.bool_]) -> NDArray[np.float64]:
    whole = np.zeros(counted.shape)
    whole[counted] = values
    return whole
