"""The price of an effect: the error that it removes, and the time that it adds.

Both depend on what is simulated already: shadows without the light that surfaces send each other
can look worse than neither. The price is therefore the Shapley value over the effects in which the
halves differ (:mod:`comparisons.effects.shapley`): the mean over all orders in which they can be
added. The errors removed add up to the whole departure, in the mean and in every pixel, and the
times to the difference between reference and kernel.
"""

from dataclasses import dataclass

import numpy as np

from comparisons.effects import shapley

LEVEL = 0.95


@dataclass(frozen=True)
class Amount:
    """A number with a 95 % interval of Student's t over the replicates."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Price:
    """What one effect buys and costs.

    Attributes
    ----------
    effect
        Its label.
    removes
        Mean ΔE2000 that it removes; negative where it takes the image further away.
    alone, last
        The same where it is the first effect to be added, and the last.
    adds_s
        Seconds that it adds to one rendering with :attr:`Prices.spp` samples a pixel.
    sampling_error
        Standard error of ``removes`` from drawing orders, 0 where all subsets were rendered.
    map
        (H, W): the ΔE2000 that it removes in each pixel.
    """

    effect: str
    removes: Amount
    alone: float
    last: float
    adds_s: Amount
    sampling_error: float
    map: np.ndarray


@dataclass(frozen=True)
class Prices:
    """The prices of all effects.

    Attributes
    ----------
    effects
        One :class:`Price` each.
    departure
        Mean ΔE2000 of the heuristic half, which the prices add up to.
    floor
        Mean ΔE2000 of the reference rendered with as many samples: of noise alone. The effect that
        is added last is charged with it.
    kernel_s, reference_s
        Seconds that none of the effects and all of them take.
    spp, replicates, orders
        Samples a pixel of each replicate, their number, and orders drawn (0: every subset).
    map
        (H, W): the ΔE2000 of the heuristic half in each pixel, which the effects' maps add up to.
    """

    effects: tuple[Price, ...]
    departure: float
    floor: float
    kernel_s: float
    reference_s: float
    spp: int
    replicates: int
    orders: int
    map: np.ndarray


def prices(lattice, judge, seed=0, exact_effects=shapley.EXACT_PLAYERS, orders=shapley.ORDERS):
    """Return the :class:`Prices` of the effects of a lattice.

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
    found = []
    for place, effect in enumerate(effects):
        removed = -shares.values[place]
        others = everything - {effect}
        found.append(
            Price(
                effect=effect.label,
                removes=_jackknife(removed.mean(axis=1)),
                alone=float((error(nothing) - error(frozenset({effect})))[0].mean()),
                last=float((error(others) - error(everything))[0].mean()),
                adds_s=_student(times.values[place]),
                sampling_error=shares.sampling_error[place],
                map=_filled(removed[0], judge.counted),
            )
        )
    own = lattice.of("reference")
    departure = judge.map(lattice.simulating(nothing).images.mean(axis=0))
    return Prices(
        effects=tuple(found),
        departure=float(departure[judge.counted].mean()),
        floor=judge.errors(own.images.mean(axis=0))[0],
        kernel_s=float(lattice.of("kernel").seconds.mean()),
        reference_s=float(own.seconds.mean()),
        spp=lattice.spp,
        replicates=lattice.replicates,
        orders=shares.orders,
        map=departure if effects else np.zeros_like(departure),
    )


def _leaving_one_out(images):
    total = images.sum(axis=0)
    return [(total - image) / (len(images) - 1) for image in images]


def _jackknife(values):
    """Return the first value, with an interval from the others, each leaving out one replicate.

    Errors are no linear function of an image, so that those of single replicates, noisier than
    their mean, would not average to its error.
    """
    value, others = float(values[0]), values[1:]
    spread = np.sqrt((len(others) - 1) * np.mean((others - others.mean()) ** 2))
    return _amount(value, float(spread), len(others))


def _student(values):
    """Return the mean of independent values, with its interval."""
    return _amount(
        float(values.mean()), float(values.std(ddof=1) / np.sqrt(len(values))), len(values)
    )


def _amount(value, error, count):
    from scipy.special import stdtrit

    half = float(stdtrit(count - 1, 0.5 + LEVEL / 2)) * error
    return Amount(value, value - half, value + half)


def _filled(values, counted):
    whole = np.zeros(counted.shape)
    whole[counted] = values
    return whole
