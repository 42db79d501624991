"""The lobes of three.js: the real library, asked for pairs of directions.

Each pair is a triangle that covers the centre of one pixel. The light shines along z, and the
camera is at the origin. Its projection drops z, which three.js' shaders do not know: they take
the direction to the viewer from the position. So a triangle at ``(x, y, -r cot(gamma))``, with
``r^2 = x^2 + y^2``, sees light and viewer at the angle ``gamma``, wherever its pixel is; its normal
then has the angles to both that the pair asks for.
"""

from collections.abc import Sequence
from math import ceil, pi, sqrt
from typing import Any, NamedTuple

import numpy as np

from heuristic.three_js import browser, three_scene

PIXELS = 1 << 18
"""Pairs in one picture, at most."""

STEEPEST = 1e4
"""Cotangent of the smallest angle between light and viewer that is told from 0."""

AWAY = 100.0
"""Distance of the picture from the axes: corners are snapped to parts of a pixel, which would turn
the direction to a viewer nearby."""

CORNERS = np.array([(-0.3, -0.3), (0.3, -0.3), (0.0, 0.4)])
"""Of a triangle about the centre of a pixel, in pixels, counter-clockwise."""

BLACK = np.zeros(3)


class Asked(NamedTuple):
    """Pairs of directions (3, N) on one material, with unit normals (3, N).

    ``material`` has the keys of :func:`heuristic.scene_data.material_of`.
    """

    material: dict[str, Any]
    light: np.ndarray
    view: np.ndarray
    normal: np.ndarray


def values(kind: str, asked: Sequence[Asked]) -> list[np.ndarray]:
    """Return the values (3, N) of each set of pairs, under a light of intensity 1.

    Raises
    ------
    InstallationError
        If three.js or a browser is missing.
    """
    found: list[np.ndarray] = []
    batch: list[Asked] = []
    for each in asked:
        if batch and sum(one.light.shape[1] for one in (*batch, each)) > PIXELS:
            found += _drawn(kind, batch)
            batch = []
        batch.append(each)
    return found + (_drawn(kind, batch) if batch else [])


def _drawn(kind: str, batch: list[Asked]) -> list[np.ndarray]:
    ends = np.cumsum([each.light.shape[1] for each in batch])
    side = ceil(sqrt(ends[-1]))
    rows, columns = np.divmod(np.arange(ends[-1]), side)
    centres = AWAY + np.stack([2 * (columns + 0.5) / side - 1, 1 - 2 * (rows + 0.5) / side])
    parts = np.split(centres, ends[:-1], axis=1)
    sun = {"type": "DirectionalLight", "color": [1, 1, 1], "intensity": pi, "target": [0, 0, 0]}
    picture = browser.draw(
        {
            "view": np.eye(4).tolist(),
            "projection": _projection().tolist(),
            "width": side,
            "height": side,
            "meshes": [_mesh(kind, *each, side) for each in zip(batch, parts, strict=True)],
            "lights": [sun | {"position": [0, 0, 1]}],
        }
    )
    pixels = picture.reshape(-1, 4)[: ends[-1], :3].T.astype(float)
    return np.split(pixels, ends[:-1], axis=1)


def _projection() -> np.ndarray:
    """Return the matrix that moves the picture to the middle, and flattens it."""
    flat = np.diag([1, 1, -0.5 / (2 * AWAY * STEEPEST), 1])
    flat[:2, 3] = -AWAY
    return flat


def _mesh(kind: str, asked: Asked, centres: np.ndarray, side: int) -> dict[str, Any]:
    """Return the triangles of a set of pairs, at centres (2, N) of a square of pixels."""
    radius = np.hypot(*centres)
    cosine = (asked.light * asked.view).sum(axis=0)
    across = asked.view - cosine * asked.light
    sine = np.linalg.norm(across, axis=0)
    steep = np.clip(cosine / np.maximum(sine, 1e-9), -STEEPEST, STEEPEST)
    count = len(radius)
    corners = (centres.T[:, None] + CORNERS * 2 / side).reshape(-1, 2)
    heights = np.repeat(-radius * steep, 3)
    outward = np.stack([*(-centres / radius), np.zeros(count)])
    own = _frame(asked.light, across)
    there = _frame(np.tile([[0.0], [0.0], [1.0]], count), outward)
    normals = np.einsum("aiN,ajN,jN->iN", there, own, asked.normal)
    return {
        "positions": three_scene.packed(np.column_stack([corners, heights]), np.float32),
        "normals": three_scene.packed(np.repeat(normals.T, 3, axis=0), np.float32),
        "faces": three_scene.packed(np.arange(3 * count), np.uint32),
        "material": three_scene.material_of(asked.material, BLACK, kind) | {"flat": False},
    }


def _frame(first: np.ndarray, across: np.ndarray) -> np.ndarray:
    """Return unit vectors (3, 3, N): the first, one along ``across``, and their cross product."""
    some = np.where(np.abs(first[2]) < 0.9, [[0.0], [0.0], [1.0]], [[1.0], [0.0], [0.0]])
    is_none = np.linalg.norm(across, axis=0) < 1e-9
    second = np.where(is_none, some - (some * first).sum(axis=0) * first, across)
    second = second / np.linalg.norm(second, axis=0)
    return np.stack([first, second, np.cross(first, second, axis=0)])
