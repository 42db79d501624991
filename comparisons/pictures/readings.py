"""Ways in which colours can be misread: each is one declaration, with its inverse."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import permutations
from math import pi

import numpy as np

from comparisons.pictures import picture_files

NEAR_PI = 0.05
"""Relative distance within which a level counts as a factor of pi."""


@dataclass(frozen=True)
class Reading:
    """A mistake in encoding colours.

    Attributes
    ----------
    told
        The symptom, in words.
    undo
        Returns the right colours (..., 3).
    cure
        What to do about such a picture.
    """

    told: str
    undo: Callable[[np.ndarray], np.ndarray]
    cure: str = ""


def _turned(order: tuple[int, ...]) -> Reading:
    shown = ", ".join(("red", "green", "blue")[place] for place in order)
    return Reading(f"channels look like {shown}", partial(_ordered, order))


def _ordered(order: tuple[int, ...], image: np.ndarray) -> np.ndarray:
    return image[..., list(order)]


READINGS = (
    Reading(
        "values look sRGB-encoded",
        picture_files.decoded,
        "give --transfer srgb, or write linear values",
    ),
    Reading("values look decoded twice", picture_files.encoded, "give --transfer linear"),
    *(_turned(order) for order in permutations(range(3)) if order != (0, 1, 2)),
)


def factor_of_pi(level: float) -> str:
    """Name the factor of pi that a level is close to; empty if none."""
    for factor, mistake in (
        (pi, "a missing division by pi"),
        (1 / pi, "a division by pi too many"),
    ):
        if abs(level / factor - 1) < NEAR_PI:
            return mistake
    return ""
