"""Pictures of what is audited: a sphere of each material under one parallel light."""

from collections.abc import Iterable

import numpy as np

from fotismos.comparisons.audit.subjects import Subject
from fotismos.heuristic.convention import Floats

SIDE = 96
FINER = 3
"""Pixels of a side, and points of each pixel's side."""

LIGHT = np.array([-0.5, 0.6, 0.7]) / np.linalg.norm([-0.5, 0.6, 0.7])
"""The direction to the light: from the left, above and before the sphere."""

BACKGROUND = 0.03
"""Shows where the sphere ends on its dark side."""


def pictures(subject: Subject, materials: Iterable[str]) -> dict[str, Floats]:
    """Return a linear picture (H, W, 3) of each material: white diffuse is 1 facing the light.

    The viewer is far away, in the direction z.
    """
    count = SIDE * FINER
    x, y = np.meshgrid(*2 * [(2 * np.arange(count) + 1) / count - 1])
    is_hit = x**2 + y**2 < 1
    x, y = x[is_hit], -y[is_hit]
    normal = np.stack([x, y, np.sqrt(1 - x**2 - y**2)])
    # Frames whose third axis is the normal; the first is level.
    tangent = np.stack([normal[2], 0 * x, -normal[0]]) / np.hypot(normal[0], normal[2])
    frame = np.stack([tangent, np.cross(normal, tangent, axis=0), normal])
    light = np.einsum("acn,c->an", frame, LIGHT)
    view = frame[:, 2]
    made = {}
    for material in materials:
        whole = np.full((count, count, 3), BACKGROUND)
        whole[is_hit] = subject.response(material, light, view).T
        made[material] = whole.reshape(SIDE, FINER, SIDE, FINER, 3).mean(axis=(1, 3))
    return made
