"""Shared by stand-ins for indirect light: the chapters' model with other light for ``I_a``.

``I_a`` stands for the environment if the scene has one, and is then replaced. If the scene has its
own ``I_a``, it stays, and the light reflected by surfaces is added.
"""

from typing import Any

from heuristic import colours
from heuristic.points import Array, Point


def has_environment(scene: Any) -> bool:
    """Return whether a scene has an environment, whose light ``I_a`` stands for."""
    return scene.environment() is not None


def lit(point: Point, arriving: Array, replaces_ambient: bool, share: Array = 1) -> Array:
    """Return the chapters' model plus ``k_d`` times the light that arrives from all around.

    ``arriving`` is ``E / pi``, display-linear; ``share`` is the unhidden share of an ``I_a`` that
    stays.
    """
    ambient = point.given.ambient
    is_there = not (replaces_ambient or colours.is_zero(colours.checked("ambient", ambient)))
    found = point.textbook(ambient=ambient * share if is_there else 0)
    return found + point.material.k_d * arriving
