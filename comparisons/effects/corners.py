"""The corners of a lattice of effects: some simulated, the others as in the heuristic half.

A page shows the picture of each corner that was rendered, with its error and its cost.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import Annotated

import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from comparisons.records import Record
from reference.effects.effect import Effect


class Corner(Record):
    """The image in which some effects are simulated.

    Attributes
    ----------
    effects
        Labels of the effects that are simulated.
    error
        Mean ΔE2000 against the reference, with noise removed; it may come out below 0.
    seconds
        Median time of one rendering.
    """

    effects: Annotated[tuple[str, ...], Meta(description="Simulated effects.")]
    error: float
    seconds: float


def corners(
    players: Sequence[Effect],
    rendered: Iterable[frozenset[Effect]],
    error: Callable[[frozenset[Effect]], NDArray],
    seconds: Callable[[frozenset[Effect]], NDArray],
) -> tuple[Corner, ...]:
    """Return the corners that were rendered, fewest effects first.

    Parameters
    ----------
    players
        All effects, in their order.
    rendered
        Sets of them.
    error, seconds
        Functions of a set: errors (R + 1, N), whose first row is of all replicates, and times (R,).
    """
    found = [
        Corner(labels(players, each), float(error(each)[0].mean()), float(np.median(seconds(each))))
        for each in rendered
    ]
    return tuple(sorted(found, key=lambda corner: (len(corner.effects), corner.effects)))


def labels(players: Sequence[Effect], simulated: frozenset[Effect]) -> tuple[str, ...]:
    """Return the labels of the effects that are simulated, in their order."""
    return tuple(effect.label for effect in players if effect in simulated)
