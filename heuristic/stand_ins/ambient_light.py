"""What stand-ins for indirect light share: the chapters' model with other light for ``I_a``.

``I_a`` stands for the environment where the scene has one, and is then replaced. Where the scene
has an ``I_a`` of its own it stays, and what surfaces reflect joins it.
"""

from typing import Any

from heuristic import colours
from heuristic.points import Array, Point


def has_environment(scene: Any) -> bool:
    """Tell whether a scene has an environment, whose light ``I_a`` stands for."""
    return scene.environment() is not None


def lit(point: Point, arriving: Array, replaces_ambient: bool, share: Array = 1) -> Array:
    """Return the chapters' model, and ``k_d`` times the light that arrives from all around.

    ``arriving`` is ``E / pi``, display-linear; ``share`` is how much of an ``I_a`` that stays is
    not hidden.
    """
    ambient = point.given.ambient
    is_there = not (replaces_ambient or colours.is_zero(colours.checked("ambient", ambient)))
    found = point.textbook(ambient=ambient * share if is_there else 0)
    return found + point.material.k_d * arriving
