"""How much is rendered for a study of cost."""

from dataclasses import dataclass, replace
from itertools import count as count_from
from itertools import takewhile

from comparisons.cost.rungs import DEPTHS
from comparisons.effects import shapley
from comparisons.options import Options
from heuristic.errors import InputError
from reference.scene.preparation import film_size
from reference.scene.source import Source

DETERMINISTIC_SPP = (4, 16)
"""Samples per pixel of rungs without random numbers; only the pixel filter needs them."""

WIDTH = 128
"""Default width of an image in pixels; costs are proportional to the number of pixels."""


@dataclass(frozen=True)
class Effort:
    """How much is rendered for a study.

    Parameters
    ----------
    rounds
        Timed repeats of each rung, at least 2. From 6 on the median has a 95 % interval.
    largest
        Most samples per pixel of the Monte Carlo rungs. Their counts are powers of 4, at which the
        sampler stratifies best.
    deterministic
        Samples per pixel of the other rungs.
    depths
        Depths of ``path`` that are rungs.
    stand_ins
        Whether what engines use in place of transport is measured too.
    reference_spp
        Samples per pixel of each pass of the converged reference.
    replicates, replicate_spp
        Replicates of each image for prices and parts, at least 3, and samples per pixel of each.
    exact_effects, orders
        Largest number of effects for which every subset is rendered, and orders drawn for more
        (:func:`comparisons.effects.shapley.shares`).

    Raises
    ------
    InputError
        For fewer than 2 rounds.
    """

    rounds: int = 7
    largest: int = 64
    deterministic: tuple[int, ...] = DETERMINISTIC_SPP
    depths: tuple[int, ...] = DEPTHS
    stand_ins: bool = True
    reference_spp: int = 64
    replicates: int = 8
    replicate_spp: int = 64
    exact_effects: int = shapley.EXACT_PLAYERS
    orders: int = shapley.ORDERS

    def __post_init__(self) -> None:
        if self.rounds < 2:
            raise InputError(f"rounds = {self.rounds} is not allowed: give at least 2.")

    @property
    def counts(self) -> tuple[int, ...]:
        """The sample counts of the Monte Carlo rungs."""
        powers = takewhile(lambda count: count <= self.largest, (4**i for i in count_from(1)))
        return tuple(powers) or (self.largest,)


QUICK = Effort(
    rounds=3,
    largest=16,
    deterministic=(16,),
    depths=(3,),
    replicates=4,
    replicate_spp=16,
    exact_effects=4,
    orders=8,
)
"""For many scenes in one report, at :data:`QUICK_WIDTH`. There, tracing takes most of the time, so
renderings are few, with many samples each."""

COARSE = replace(QUICK, depths=(), orders=4, stand_ins=False)
"""For a report within a minute: fewer methods, since each is traced again."""

QUICK_WIDTH = 48


def reduced(source: Source, options: Options, width: int) -> tuple[int, int]:
    """Return the requested resolution, else that of the film, reduced to a width."""
    given = options.resolution or film_size(source.parse(), options.sensor)
    if given[0] <= width:
        return given
    return width, max(1, round(given[1] * width / given[0]))
