"""The price of an effect: the error that it removes, and the time that it adds.

Both depend on what is simulated already: shadows without the light that surfaces send each other
can look worse than neither. The price is therefore the Shapley value over the effects in which the
halves differ (:mod:`comparisons.effects.shapley`): the mean over all orders in which they can be
added. The errors removed add up to the whole departure, in the mean and in every pixel, and the
times to the difference between reference and kernel.
"""

from dataclasses import dataclass

import numpy as np

from comparisons import intervals
from comparisons.cost.cost_record import Price, Prices
from comparisons.effects import shapley


@dataclass(frozen=True)
class Priced:
    """Prices, and where in the image they are paid.

    Attributes
    ----------
    prices
        The means.
    maps
        ``{effect: (H, W)}``: the ΔE2000 that each removes.
    departure
        (H, W): the ΔE2000 of the heuristic half, which the maps add up to.
    """

    prices: Prices
    maps: dict
    departure: np.ndarray


def prices(lattice, judge, seed=0, exact_effects=shapley.EXACT_PLAYERS, orders=shapley.ORDERS):
    """Return the effects of a lattice as :class:`Priced`.

    Parameters
    ----------
    lattice : comparisons.effects.lattice.Lattice
        The images.
    judge : comparisons.cost.timing.Judge
        What tells their errors.
    seed
        Of the orders drawn where there are many effects.
    exact_effects, orders
        As of :func:`comparisons.effects.shapley.shares`.
    """
    effects, everything = lattice.effects, frozenset(lattice.effects)
    if len(effects) <= exact_effects:
        lattice.render(key for each in shapley.subsets(effects) for key in lattice.needed(each))
    errors, seconds = {}, {}

    def error(simulated):
        """Maps (R + 1, N) of ΔE2000: of all replicates, then leaving out each in turn."""
        if simulated not in errors:
            images = lattice.simulating(simulated).images
            if simulated == everything:
                errors[simulated] = np.zeros((lattice.replicates + 1, int(judge.counted.sum())))
            else:
                kept = [images.mean(axis=0), *_leaving_one_out(images)]
                errors[simulated] = np.stack([judge.map(image)[judge.counted] for image in kept])
        return errors[simulated]

    def time(simulated):
        if simulated not in seconds:
            seconds[simulated] = lattice.simulating(simulated).seconds
        return seconds[simulated]

    nothing = frozenset()
    shares = shapley.shares(effects, error, seed, exact_effects, orders)
    times = shapley.shares(effects, time, seed, exact_effects, orders)
    found, maps = [], {}
    for place, effect in enumerate(effects):
        removed = -shares.values[place]
        maps[effect.label] = _filled(removed[0], judge.counted)
        others = everything - {effect}
        found.append(
            Price(
                effect=effect.label,
                removes=_jackknife(removed.mean(axis=1)),
                alone=float((error(nothing) - error(frozenset({effect})))[0].mean()),
                last=float((error(others) - error(everything))[0].mean()),
                adds_s=intervals.of_mean(times.values[place]),
                sampling_error=shares.sampling_error[place],
            )
        )
    own = lattice.of("reference")
    departure = judge.map(lattice.simulating(nothing).images.mean(axis=0))
    priced = Prices(
        effects=tuple(found),
        departure=float(departure[judge.counted].mean()),
        floor=judge.errors(own.images.mean(axis=0))[0],
        kernel_s=float(lattice.of("kernel").seconds.mean()),
        reference_s=float(own.seconds.mean()),
        spp=lattice.spp,
        replicates=lattice.replicates,
        orders=shares.orders,
    )
    return Priced(priced, maps, departure if effects else np.zeros_like(departure))


def _leaving_one_out(images):
    total = images.sum(axis=0)
    return [(total - image) / (len(images) - 1) for image in images]


def _jackknife(values):
    """Return the first value, with an interval from the others, each leaving out one replicate."""
    value, *others = values
    return intervals.student(float(value), float(intervals.jackknife_error(others)), len(others))


def _filled(values, counted):
    whole = np.zeros(counted.shape)
    whole[counted] = values
    return whole
