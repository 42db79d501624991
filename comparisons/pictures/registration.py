"""How far a picture is shifted against our camera, by edges: a shift looks like wrong shading.

Edges of the geometry, where the normal or the hit changes, are in any picture of the same scene,
whatever shades it; so are, mostly, those of the heuristic half, which shows where light ends. The
edges of the picture are correlated with both at all shifts up to :data:`REACH`, and the better
agreement counts; a parabola through the highest values tells the part of a pixel. A picture that is
turned over correlates better once it is turned back.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import mitsuba as mi
import numpy as np

from heuristic.errors import InputError
from reference.rendering.gbuffer import gbuffer

REACH = 8
"""Pixels of the largest shift that is looked for, or a quarter of the picture's smaller side."""

FINER = 4
"""Rays along each side of a pixel."""

LEAST = 0.08
"""Correlation below which edges tell nothing."""

CLEARLY = 1.5
"""Times as high a correlation as upright tells that a picture is turned over."""

TURNED = {
    "upside down": lambda image: image[::-1],
    "mirrored left to right": lambda image: image[:, ::-1],
    "turned by 180 degrees": lambda image: image[::-1, ::-1],
}


@dataclass(frozen=True)
class Registration:
    """Where a picture lies.

    Attributes
    ----------
    x, y
        Pixels that its content lies to the right and below of where it should; None where its edges
        do not tell.
    correlation
        Of the edges, at the best shift, up to 1.
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
    """Return where an image (H, W, 3) lies against expected edges.

    Parameters
    ----------
    image
        Linear, or encoded in any way.
    expected
        Maps (H, W) of edges that may be in it; the one that agrees best counts.

    Raises
    ------
    InputError
        When it is turned over.
    """
    seen = picture_edges(image)
    found = _best(seen, expected)
    for how, turn in TURNED.items():
        other = _best(turn(seen), expected)
        if other.correlation > max(CLEARLY * found.correlation, 2 * LEAST):
            raise InputError(
                f"the picture is {how}: its edges then agree with the scene's by"
                f" {other.correlation:.2f} instead of {found.correlation:.2f}. Turn it over, and"
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
    y, x = np.unravel_index(np.argmax(table), table.shape)
    highest = float(table[y, x])
    if highest < LEAST:
        return Registration(None, None, highest)
    column, row = table[:, x], table[y]
    return Registration(
        float(x - reach + _vertex(row, x)), float(y - reach + _vertex(column, y)), highest
    )


def _correlations(seen: np.ndarray, edges: np.ndarray, reach: int) -> np.ndarray:
    """Return the correlation of two maps where they overlap, at each shift of one of them.

    (2 reach + 1, 2 reach + 1), of shifts up to ``reach`` pixels.
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
    """Return the part of a map that begins so many pixels later, or ends so many earlier."""
    part = slice(by, None) if by >= 0 else slice(None, by)
    return values[part] if axis == 0 else values[:, part]


def _correlation(a: np.ndarray, b: np.ndarray) -> float:
    a, b = a - a.mean(), b - b.mean()
    size = np.sqrt((a * a).sum() * (b * b).sum())
    return float((a * b).sum() / size) if size > 0 else 0.0


def _vertex(values: np.ndarray, place: int) -> float:
    """Return how far the top of a parabola through a maximum and its neighbours is from it."""
    if not 0 < place < len(values) - 1:
        return 0.0
    before, top, after = values[place - 1 : place + 2]
    bend = before - 2 * top + after
    return 0.0 if bend >= 0 else float(0.5 * (before - after) / bend)
