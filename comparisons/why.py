"""The records of causes and terms, named by every comparison; nothing here finds them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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


@dataclass(frozen=True)
class Causes:
    """The attribution of a departure, and where in the image the effects remove what.

    ``maps`` are ``{effect: (H, W)}``, the ΔE2000 that each removes; with ``left``, what remains
    when all are simulated, they add up to ``departure``. ``counted`` (H, W) are the pixels that
    count. ``previews`` are ``{labels of the simulated effects: (f H, f W, 3)}``, linear.
    """

    record: Attribution
    maps: dict[str, NDArray]
    departure: NDArray
    left: NDArray
    counted: NDArray[np.bool_]
    previews: dict[tuple[str, ...], NDArray]


Colour = tuple[float, float, float]
"""Linear RGB."""


class TermMaterial(Record):
    """The kernel's material at some points; a lobe's normalisation is part of ``k_s``."""

    name: str
    k_i: Colour
    k_a: Colour
    k_d: Colour
    k_s: Colour
    n: float
    form: str
    ambient: Colour
