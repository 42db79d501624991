"""Constant ambient light, set to the mean of the indirect light.

``I = ... + k_d A``, where ``A`` is the mean indirect light at the points that the camera sees
(:mod:`heuristic.stand_ins.gathering`), each weighted by its ``k_d``. Artists of the 1990s set
``I_a`` by hand to imitate it; the mean is the best single number for the image's level.
"""

from dataclasses import dataclass
from typing import Any

from heuristic.heuristics import HEURISTICS, Heuristic
from heuristic.points import INPUTS, Array, Point
from heuristic.stand_ins.ambient_light import has_environment, lit
from heuristic.stand_ins.gathering import gather
from heuristic.stand_ins.tabulated import Table


@dataclass
class Constant:
    """Light that is the same everywhere, and whether it replaces ``I_a``."""

    arriving: Table
    replaces_ambient: bool


def prepare(scene: Any) -> Constant:
    """Gather the mean of the indirect light of a scene."""
    return Constant(Table(gather(scene).mean()), has_environment(scene))


def shade(point: Point) -> Array:
    """Return the chapters' model with the mean of the indirect light."""
    prepared = point.prepared
    return lit(point, prepared.arriving.at(point.wavelengths), prepared.replaces_ambient)


MEAN_AMBIENT = HEURISTICS.own(
    Heuristic(
        "mean-ambient",
        shade,
        "mean ambient light",
        needs=frozenset(INPUTS) - {"uv", "visible"},
        prepare=prepare,
    )
)
