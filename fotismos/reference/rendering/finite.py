"""Values that an image may hold: finite, and small enough for squares of differences."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from fotismos.heuristic.errors import NonFiniteError

LARGEST_VALUE = 1e18
"""In units of display white: squares of differences must not overflow in single precision."""


def require_finite(image: np.ndarray, layer: str, warnings: Sequence[str] = ()) -> None:
    """Raise `NonFiniteError` if an image (H, W) or (H, W, C) holds a NaN or an infinity.

    ``warnings`` of the scene come first as causes.
    """
    if not np.isfinite(image).all():
        wrong = wrong_pixels(image, np.isfinite(image), "NaN or infinite")
        usual = (
            "Look at the surface and the lights seen there: an infinite light or a degenerate mesh"
            " is the usual cause."
        )
        raise NonFiniteError(f"{layer}: {wrong}. {' '.join(warnings) or usual}")


def wrong_pixels(image: Any, right: Any, what: str) -> str:
    """Return how many pixels are wrong, and the first as (x, y), in reading order from top left."""
    wrong = ~right if right.ndim == 2 else ~right.all(axis=-1)
    pixel = np.unravel_index(np.argmax(wrong), wrong.shape)
    return (
        f"{np.count_nonzero(wrong)} of {wrong.size} pixels are {what}, the first at (x, y) ="
        f" ({', '.join(str(index) for index in reversed(pixel))}): {np.asarray(image)[pixel]}"
    )
