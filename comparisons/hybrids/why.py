"""The records of causes, which every comparison names; it loads nothing that finds them."""

from reference.records import Amount, Estimated, Record, Resolution, Size

Effects = tuple[str, ...]
"""Labels of effects, in their order."""


class MeanError(Record):
    """A mean ΔE2000 with its 95 % interval; without noise it may come out below 0."""

    mean: float
    low: float
    high: float


class Contribution(Record):
    """What simulating one effect removes.

    Attributes
    ----------
    effect
        Its label.
    removes
        Mean ΔE2000 that it removes; negative if it increases the departure.
    alone, last
        The same if it is the first effect added, and the last.
    sampling_error
        Standard error of ``removes`` from drawing orders; 0 if all subsets were rendered.
    """

    effect: str
    removes: Estimated
    alone: float
    last: float
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


class Hybrid(Record):
    """An image in which some effects are simulated, and its mean ΔE2000 without noise."""

    effects: Effects
    error: float


class Attribution(Record):
    """What the effects remove from the departure of the heuristic half.

    Attributes
    ----------
    effects
        One contribution each. They and the closure add up to the departure.
    departure
        Mean ΔE2000 of the heuristic half, without noise.
    closure
        What remains with all effects simulated: only a fault can leave any.
    implementation
        Mean ΔE2000 between the kernel and its plugin under Mitsuba's direct light: rounding.
    resolution, spp, replicates
        Size of the images, samples per pixel of each replicate, and their number.
    orders
        Orders of the effects that were drawn; 0 if every subset was rendered.
    hybrids
        All images that were rendered, fewest effects first.
    objects
        What the effects remove on each shape.
    """

    effects: tuple[Contribution, ...]
    departure: float
    closure: MeanError
    implementation: Amount
    resolution: Resolution
    spp: Size
    replicates: Size
    orders: int
    hybrids: tuple[Hybrid, ...] = ()
    objects: tuple[ObjectContribution, ...] = ()
