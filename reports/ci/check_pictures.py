"""Pictures of a failed check: both halves, and maps of what moved, block by block."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib import colormaps
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from comparisons.check.check import Check
from comparisons.check.measurement import HALVES, Pictures, block_edges
from comparisons.departure.metrics import LEADING
from comparisons.departure.spaces import luminance
from reports.ci import baselines
from reports.ci.baselines import LONGEST_KEPT
from reports.files import images

Picture = Image.Image
Place = tuple[int, int]

LONGEST = 640
"""Pixels of the longer side; small pictures are enlarged, pixel by pixel."""

NAMES = tuple(half + kind for half in HALVES for kind in ("", "-before", "-change", "-p", "-error"))
"""Names of all pictures that a failure can have."""

LARGEST_ERROR = 2.0
"""ΔE2000 at which the error maps' colours end: changes are often hardly noticeable."""

LEAST_P = 1e-6
"""The p-value at which the map's colours end."""


def pictures(check: Check, before: baselines.Pictures | None = None) -> dict[str, bytes]:
    """Return a check's pictures, ``{name: PNG file}``.

    ``heuristic`` and ``reference`` are the halves now. ``*-change`` is the change of each block's
    luminance, ``*-p`` its probability by chance, corrected for all that was tested. With the
    baseline's pictures ``before``, ``*-before`` shows them, and ``*-error`` is ΔE2000 from them.
    """
    made: dict[str, Picture] = {}
    for half in HALVES:
        now = getattr(check.pictures, half)
        made[half] = _enlarged(images.tonemap(now))
        made[f"{half}-change"] = _change(check, half, now)
        made[f"{half}-p"] = _p_values(check, half, now)
        if before is not None:
            size = before[half].shape[:2]
            distance = LEADING(_reduced_to(now, size), before[half])
            made[f"{half}-before"] = _enlarged(images.tonemap(before[half]))
            made[f"{half}-error"] = _enlarged(images.error_map(distance, LARGEST_ERROR))
    return {name: images.png(picture) for name, picture in made.items()}


def reduced(pictures: Pictures) -> baselines.Pictures:
    """Return both halves, averaged down to :data:`LONGEST_KEPT` pixels."""
    height, width = pictures.heuristic.shape[:2]
    scale = min(1.0, LONGEST_KEPT / max(height, width))
    size = max(1, round(height * scale)), max(1, round(width * scale))
    return {half: _reduced_to(getattr(pictures, half), size) for half in HALVES}


def _reduced_to(image: NDArray, size: Sequence[int]) -> NDArray[np.floating]:
    """Average an image (H, W, 3) down to ``(height, width)``."""
    if image.shape[:2] == tuple(size):
        return image
    planes = (
        Image.fromarray(image[..., c].astype(np.float32)).resize(
            (size[1], size[0]), Image.Resampling.BOX
        )
        for c in range(3)
    )
    return np.stack([np.asarray(plane, float) for plane in planes], axis=-1)


def _change(check: Check, half: str, now: NDArray) -> Picture:
    old, new = (luminance(m.colours[half].blocks) for m in (check.before, check.after))
    change = (new - old) / np.maximum(np.abs(old), 1e-4)
    limit = max(float(np.abs(change).max()), 1e-6)
    labels = [[_percent(value) for value in row] for row in change]
    return _over(now, 0.5 + 0.5 * change / limit, images.SIGNED_COLOURS, labels)


def _percent(change: float) -> str:
    return f"{100 * change:+.2g} %" if abs(change) >= 1e-6 else "0"


def _p_values(check: Check, half: str, now: NDArray) -> Picture:
    p = check.p_values(half)
    labels = [[f"p {value:.1g}" if value < 0.995 else "" for value in row] for row in p]
    share = np.log(np.maximum(p, LEAST_P)) / np.log(LEAST_P)
    return _over(now, share, images.ERROR_COLOURS, labels)


def _over(now: NDArray, share: NDArray, colours: str, labels: Sequence[Sequence[str]]) -> Picture:
    """Draw blocks, coloured by a share from 0 to 1 and labelled, over the picture in grey."""
    picture = _enlarged(images.tonemap(now)).convert("L").convert("RGB")
    shade = colormaps[colours](np.clip(share, 0.0, 1.0))[..., :3]
    veil = Image.new("RGB", picture.size)
    draw = ImageDraw.Draw(veil)
    boxes = list(_boxes(now.shape[:2], picture.size))
    for (row, column), box in boxes:
        draw.rectangle(box, fill=tuple(int(255 * c) for c in shade[row, column]))
    picture = Image.blend(picture, veil, 0.55)
    draw = ImageDraw.Draw(picture)
    for (row, column), box in boxes:
        draw.rectangle(box, outline=(255, 255, 255))
        middle = ((box[0] + box[2]) / 2, (box[1] + box[3]) / 2)
        size = max(9, min(20, (box[2] - box[0]) // 6))
        draw.text(
            middle,
            labels[row][column],
            fill="white",
            stroke_fill="black",
            stroke_width=2,
            anchor="mm",
            font=ImageFont.load_default(size),
        )
    return picture


def _boxes(shape: Sequence[int], size: Place) -> Iterator[tuple[Place, tuple[int, int, int, int]]]:
    """Yield each block's ``(row, column)`` and its corners in an enlarged picture."""
    rows, columns = (block_edges(side) for side in shape)
    x, y = columns * size[0] // shape[1], rows * size[1] // shape[0]
    for row in range(len(rows) - 1):
        for column in range(len(columns) - 1):
            yield (row, column), (x[column], y[row], x[column + 1] - 1, y[row + 1] - 1)


def _enlarged(picture: Picture) -> Picture:
    factor = max(1, LONGEST // max(picture.size))
    size = picture.width * factor, picture.height * factor
    return picture.resize(size, Image.Resampling.NEAREST)
