"""How far a picture is shifted from our camera, by its edges: a shift looks like wrong shading.

Geometric edges, where the normal or the hit changes, are in any picture of the same scene, however
it is shaded. The heuristic half mostly shares its edges too: it shows where light ends. The
picture's edges are correlated with both at all shifts up to :data:`REACH`, and the better agreement
counts; a parabola through the highest values gives the fraction of a pixel. A flipped picture
correlates better once it is flipped back.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import mitsuba as mi
import numpy as np

from heuristic.errors import InputError
from reference.rendering.gbuffer import gbuffer

REACH = 8
"""Largest shift considered in pixels, at most a quarter of the picture's smaller side."""

FINER = 4
"""Rays along each side of a pixel."""

LEAST = 0.08
"""Correlation below which edges are uninformative."""

CLEARLY = 1.5
"""A picture counts as flipped if flipping it raises the correlation by this factor."""

TURNED = {
    "upside down": lambda image: image[::-1],
    "mirrored left to right": lambda image: image[:, ::-1],
    "turned by 180 degrees": lambda image: image[::-1, ::-1],
}


@dataclass(frozen=True)
class Registration:
    """The position of a picture.

    Attributes
    ----------
    x, y
        Pixels by which its content is too far right and too low; None if its edges are
        uninformative.
    correlation
        Correlation of the edges at the best shift, up to 1.
    """

    x: float | None
    y: float | None
    correlation: float


def geometry_edges(scene: mi.Scene, width: int, height: int) -> np.ndarray:
    """Return how much the geometry changes at each pixel, (H, W)."""
    found = gbuffer(scene, FINER * width, FINER * height)
    layers = np.concatenate([found.normal, found.hit[..., None]], axis=-1)
    blocks = layers.reshape(height, FINER, width, FINER, 4)
    return _edges(blocks.mean(axis=(1, 3)), 0.25)


def measure(image: np.ndarray, expected: Sequence[np.ndarray]) -> Registration:
    """Return the position of an image (H, W, 3) relative to expected edges.

    Parameters
    ----------
    image
        Linear, or encoded in any way.
    expected
        Maps (H, W) of edges that it may contain; the best agreement counts.

    Raises
    ------
    InputError
        When it is flipped or rotated.
    """
    seen = picture_edges(image)
    found = _best(seen, expected)
    for how, turn in TURNED.items():
        other = _best(turn(seen), expected)
        if other.correlation > max(CLEARLY * found.correlation, 2 * LEAST):
            raise InputError(
                f"the picture is {how}: corrected, its edges would correlate with the scene's by"
                f" {other.correlation:.2f} instead of {found.correlation:.2f}. Correct it, and"
                " compare again."
            )
    return found


def picture_edges(image: np.ndarray) -> np.ndarray:
    """Return how much an image changes at each pixel, in stops, up to 1."""
    luminance = np.maximum(np.asarray(image, float) @ (0.2126, 0.7152, 0.0722), 0)
    least = 0.02 * np.percentile(luminance, 95) + 1e-6
    return _edges(np.log2(luminance + least)[..., None], 0.25)


def _edges(layers: np.ndarray, half: float) -> np.ndarray:
    """Return the size of the gradient, on a scale that is 1/2 at ``half`` and ends at 1."""
    slopes = np.stack([np.gradient(layers, axis=axis) for axis in (0, 1)])
    size = np.sqrt((slopes**2).sum(axis=(0, -1)))
    return size / (size + half)


def _best(seen: np.ndarray, expected: Sequence[np.ndarray]) -> Registration:
    return max((_of(seen, edges) for edges in expected), key=lambda found: found.correlation)


def _of(seen: np.ndarray, edges: np.ndarray) -> Registration:
    height, width = edges.shape
    reach = max(1, min(REACH, min(height, width) // 4))
    table = _correlations(seen, edges, reach)
    y, x = map(int, np.unravel_index(np.argmax(table), table.shape))
    highest = float(table[y, x])
    if highest < LEAST:
        return Registration(None, None, highest)
    column, row = table[:, x], table[y]
    return Registration(
        float(x - reach + _vertex(row, x)), float(y - reach + _vertex(column, y)), highest
    )


def _correlations(seen: np.ndarray, edges: np.ndarray, reach: int) -> np.ndarray:
    """Return the correlation of two maps where they overlap, for each shift of one of them.

    The shape is (2 reach + 1, 2 reach + 1): shifts of up to ``reach`` pixels.
    """
    shifts = range(-reach, reach + 1)
    return np.array(
        [
            [
                _correlation(
                    _moved(_moved(seen, down, 0), right, 1),
                    _moved(_moved(edges, -down, 0), -right, 1),
                )
                for right in shifts
            ]
            for down in shifts
        ]
    )


def _moved(values: np.ndarray, by: int, axis: int) -> np.ndarray:
    """Return a map without its first ``by`` pixels, or without its last ones if ``by`` < 0."""
    part = slice(by, None) if by >= 0 else slice(None, by)
    return values[part] if axis == 0 else values[:, part]


def _correlation(a: np.ndarray, b: np.ndarray) -> float:
    a, b = a - a.mean(), b - b.mean()
    size = np.sqrt((a * a).sum() * (b * b).sum())
    return float((a * b).sum() / size) if size > 0 else 0.0


def _vertex(values: np.ndarray, place: int) -> float:
    """Return the offset of the vertex of a parabola through a maximum and its neighbours."""
    if not 0 < place < len(values) - 1:
        return 0.0
    before, top, after = values[place - 1 : place + 2]
    bend = before - 2 * top + after
    return 0.0 if bend >= 0 else float(0.5 * (before - after) / bend)
