"""Contact sheets: small pictures of both halves at some points of a part, over two parameters."""

from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fotismos.comparisons import atomic
from fotismos.comparisons.departure.blocks import averaged, shrunk
from fotismos.comparisons.departure.colour import to_srgb
from fotismos.comparisons.study.design import StudyPart
from fotismos.comparisons.study.scenes import RENDERED, SCENES
from fotismos.heuristic.convention import Floats

MOST = 6
"""Most levels of a parameter that a sheet shows."""

LONGEST = 64
"""Pixels of a picture's longer side."""

Pictures = NDArray[np.uint8]
"""Both halves at a point as sRGB, the textbook's first: (2, H, W, 3)."""


@dataclass(frozen=True)
class Sheet:
    """Numbers of a part's points (rows, columns), over the parameters ``down`` and ``across``.

    ``down`` is empty if a single parameter varies.
    """

    across: str
    down: str
    points: NDArray[np.intp]


def sheet_of(part: StudyPart) -> Sheet | None:
    """Return the sheet of a part; None if its points are no grid, or not rendered.

    Other parameters than the two have their middle level.
    """
    varying = part.varying
    is_rendered = part.scene in RENDERED or part.scene not in SCENES
    if part.design != "grid" or not varying or not is_rendered:
        return None
    across = varying[-1]
    down = varying[0] if len(varying) > 1 else ""
    sizes = tuple(len(level.values) for level in part.levels.values())
    shown = []
    for name, size in zip(part.levels, sizes, strict=True):
        spread = np.linspace(0, size - 1, min(size, MOST)).round().astype(int)
        shown.append(spread if name in (across, down) else np.array([size // 2]))
    numbers = np.ravel_multi_index(np.ix_(*shown), sizes)
    return Sheet(across, down, numbers.reshape(-1, len(shown[[*part.levels].index(across)])))


def small(textbook: Floats, physical: Floats) -> Pictures:
    """Return small pictures of linear images (H, W, 3), at an exposure of 1."""
    shape = shrunk(textbook.shape[:2], LONGEST)
    halves = np.stack([averaged(image, shape) for image in (textbook, physical)])
    found: Pictures = np.round(255 * to_srgb(np.clip(halves, 0, 1))).astype(np.uint8)
    return found


def save(path: Path, pictures: Pictures) -> None:
    """Keep the pictures of a point in a file."""
    stream = BytesIO()
    np.save(stream, pictures)
    atomic.write(path, stream.getvalue())


def load(path: Path) -> Pictures | None:
    """Return kept pictures; None without them."""
    try:
        found: Pictures = np.load(path)
    except (OSError, ValueError, EOFError):
        return None
    return found
