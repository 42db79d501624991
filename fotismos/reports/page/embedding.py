"""Images inside the page, as half-precision numbers: three decimal digits.

Planes of 16-bit codes follow each other. Green and blue are differences to the plane before, then
all are differences to the code before (modulo 2^16), with the sign in the last bit. Their low bytes
come before the high ones, deflated (RFC 1950), in base64. ``templates/viewer/images.js`` reverses
this.
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fotismos.comparisons.departure import marks
from fotismos.comparisons.departure.blocks import block_sums
from fotismos.comparisons.departure.metrics import LEADING, declared
from fotismos.reference.records import Record, plain
from fotismos.reports.files.images import HALF_MAX

STEP = 4
"""Half floats are rounded to multiples of this code, by up to 0.2 %, which packs better."""

LEAST = 0.01
"""ΔE2000: smaller differences are printed as "< 0.01", and stored as half of it."""

LONGEST = 1024
"""Pixels; longer images are averaged over square blocks inside the page, never in the files."""

SIGNIFICANT = 1
COUNTED = 2
UNDETERMINED = 4
"""Bits of the plane "flags"."""

Codes = NDArray[np.uint16]


class Embedded(Record):
    """Named planes of ``width`` by ``height`` codes, means over squares of ``block``."""

    width: int
    height: int
    block: int
    names: tuple[str, ...]
    data: str

    def manifest(self) -> dict[str, Any]:
        """Return the description needed to read `data`, as plain data."""
        shown: dict[str, Any] = plain(self)
        del shown["data"]
        return shown


def embed(channels: Mapping[str, ArrayLike], counted: ArrayLike) -> Embedded:
    """Encode the channels (H, W) of ``images.channels``, so that page and file agree.

    ``counted`` are the pixels in the statistics. Of the standard error, the largest channel stays.
    """
    height, width = np.shape(counted)
    # Rounded up, so that the longer side has no more than LONGEST blocks.
    block = -(-max(height, width) // LONGEST)
    halves = [f"{half}.{c}" for half in ("heuristic", "reference") for c in "RGB"]
    planes = {name: encode(_means(channels[name], block)) for name in halves}
    error = _means(channels[f"{LEADING.name}.Y"], block)
    # The rounding of exact pairs would fill most of a page.
    planes[LEADING.name] = encode(np.where((error > 0) & (error < LEAST), LEAST / 2, error))
    for name in declared():  # of the package's own, the files have the maps
        planes[name] = encode(_means(channels[f"{name}.Y"], block))
    deviation = np.stack([channels[f"reference_stderr.{c}"] for c in "RGB"]).max(axis=0)
    planes["standard_error"] = encode(_means(deviation, block), 32 * STEP)
    marked = np.asarray(channels["significant.Y"], np.float64)
    significant = _means(marked == marks.MARKED, block) > 0.0
    undetermined = (_means(marked == marks.UNDETERMINED, block) > 0.0) & ~significant
    flags = SIGNIFICANT * significant + COUNTED * (_means(counted, block) > 0.0)
    planes["flags"] = (flags + UNDETERMINED * undetermined).astype(np.uint16)
    return packed(planes, block)


def packed(planes: Mapping[str, Codes], block: int = 1) -> Embedded:
    """Return planes of codes (H, W) as the page holds them."""
    height, width = next(iter(planes.values())).shape
    before = np.zeros((height, width), np.uint16)
    parts = []
    # Differences wrap modulo 2^16, as they do in the page's Uint16Array. Those of colours rely
    # on the order of the planes: red, green, blue.
    for name, codes in planes.items():
        parts.append((codes - before if name.endswith((".G", ".B")) else codes).ravel())
        before = codes
    steps = np.diff(np.concatenate(parts), prepend=np.uint16(0)).view(np.int16)
    # 0, -1, 1, -2 become 0, 1, 2, 3: the high bytes are mostly 0.
    signed = ((steps << 1) ^ (steps >> 15)).view(np.uint16)  # small steps of both signs are small
    halves = np.stack([signed & 0xFF, signed >> 8]).astype(np.uint8)
    # Level 4: two thirds of the time of 6 for pages 1 % larger.
    data = base64.b64encode(zlib.compress(halves.tobytes(), 4)).decode("ascii")
    return Embedded(width=width, height=height, block=block, names=tuple(planes), data=data)


def encode(values: ArrayLike, step: int = STEP) -> Codes:
    """Return half floats as integers, rounded to multiples of ``step``; no zero is negative."""
    # Without its sign, a half float grows with its code, so a rounded code is a rounded value.
    # The code after 0x7BFF is infinity, which rounding must not reach.
    codes = np.clip(values, -HALF_MAX, HALF_MAX).astype(np.float16).view(np.uint16)
    rounded = np.minimum((codes & 0x7FFF) + step // 2, 0x7BFF) & ~np.uint16(step - 1)
    return np.where(rounded > 0, rounded | (codes & 0x8000), 0).astype(np.uint16)


def _means(image: ArrayLike, block: int) -> NDArray[np.float64]:
    """Means over square blocks, which may be smaller at the right and bottom edges."""
    image = np.asarray(image, np.float64)
    if block == 1:
        return image
    heights = block_sums(np.ones((image.shape[0], 1)), block)
    widths = block_sums(np.ones((image.shape[1], 1)), block)
    return block_sums(image, block) / (heights * widths.T)
