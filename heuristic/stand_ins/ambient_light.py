"""What stand-ins for indirect light share: the chapters' model with other light in place of ``I_a``.

``I_a`` stands for the environment where the scene has one, and is then replaced. Where the scene has
an ``I_a`` of its own it stays, and what surfaces reflect joins it.
"""

from typing import Any

from heuristic.points import Array, Point


def has_environment(scene: Any) -> bool:
    """Tell whether a scene has an environment, whose light ``I_a`` stands for."""
    return scene.environment() is not None


def lit(point: Point, arriving: Array, replaces_ambient: bool) -> Array:
    """Return the chapters' model, and ``k_d`` times the light that arrives from all around.

    ``arriving`` is ``E / pi``, display-linear.
    """
    instead = {"ambient": 0} if replaces_ambient else {}
    return point.textbook(**instead) + point.material.k_d * arriving
