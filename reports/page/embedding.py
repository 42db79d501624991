"""A comparison's images inside the page, as half-precision numbers.

A half float has 11 bits, three decimal digits. Metrics other than the leading one keep 8 bits and
the standard error 5, which packs better. A plane's codes are replaced by their differences to a
base plane (green, for red and blue), then to the left neighbour, and split into low and high bytes;
all planes are deflated together. ``templates/viewer/decoding.js`` reverses this.
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import structs
from numpy.typing import ArrayLike, NDArray

from comparisons.departure import marks
from comparisons.departure.metrics import LEADING, drawn
from reference.records import Record, plain

BITS = {3: 11, 2: 8, 1: 5}
"""Bits of precision by the digits printed."""

DIGITS, OTHER_DIGITS, ERROR_DIGITS = 3, 2, 1
"""Of values and the leading metric, of the other metrics, and of the standard error."""

POOLED = 2
"""The standard error is averaged over squares of this many pixels a side."""

LARGEST = 65504.0
"""The largest half float; greater values are clipped in the page."""

LEAST = 0.01
"""Smaller differences are printed as "< 0.01", and stored as half of it, if maps reach 1."""

LONGEST = 1024
"""Pixels; longer images are averaged over square blocks inside the page, never in the files."""

SIGNIFICANT, COUNTED, UNDETERMINED = 1, 2, 4
"""Bits of the plane "flags"."""

Codes = NDArray[np.uint16]


class Plane(Record):
    """One channel: its name, its digits (0: the codes are the values), and its base plane."""

    name: str
    digits: int
    base: str | None = None


class Embedded(Record):
    """The images of a comparison, for the page.

    ``width`` and ``height`` are of the planes, whose pixels are means over ``block`` × ``block``
    pixels of the image. ``data`` has the planes in order, deflated (RFC 1950), in base64.
    """

    width: int
    height: int
    block: int
    planes: tuple[Plane, ...]
    data: str

    def manifest(self) -> dict[str, Any]:
        """Return the description needed to read `data`, as plain data."""
        return plain(structs.replace(self, data=""))


def embed(channels: Mapping[str, ArrayLike], counted: ArrayLike) -> Embedded:
    """Encode the images of a comparison.

    Parameters
    ----------
    channels
        From :func:`reports.files.exr.channels`, (H, W) each, so page and file agree. Of the
        standard error, the largest of the three channels is kept.
    counted
        Boolean (H, W): the pixels in the statistics.
    """
    height, width = np.shape(counted)
    block = -(-max(height, width) // LONGEST)
    planes, codes = [], {}

    def add(name: str, values: NDArray, digits: int, base: str | None = None) -> None:
        planes.append(Plane(name=name, digits=digits, base=base))
        codes[name] = encode(values, digits) if digits else values

    for layer in ("heuristic", "reference"):
        for colour in "GRB":
            name, base = f"{layer}.{colour}", None if colour == "G" else f"{layer}.G"
            add(name, _means(channels[name], block), DIGITS, base)
    for name, metric in drawn().items():
        values = _means(channels[f"{name}.Y"], block)
        if metric.map_range[1] >= 1.0:  # the rounding of exact pairs would fill most of a page
            values = np.where((values > 0.0) & (values < LEAST), LEAST / 2, values)
        add(name, values, DIGITS if name == LEADING.name else OTHER_DIGITS)
    deviations = [_means(channels[f"reference_stderr.{colour}"], block) for colour in "RGB"]
    pooled = _means(np.max(deviations, axis=0), POOLED)
    rows, columns = np.shape(deviations[0])
    pooled = pooled.repeat(POOLED, axis=0).repeat(POOLED, axis=1)[:rows, :columns]
    add("standard_error", pooled, ERROR_DIGITS)
    marked = np.asarray(channels["significant.Y"], np.float64)
    significant = _means(marked == marks.MARKED, block) > 0.0
    undetermined = (_means(marked == marks.UNDETERMINED, block) > 0.0) & ~significant
    flags = SIGNIFICANT * significant + COUNTED * (_means(counted, block) > 0.0)
    flags = flags + UNDETERMINED * undetermined
    add("flags", flags.astype(np.uint16), 0)
    return Embedded(
        width=columns, height=rows, block=block, planes=tuple(planes), data=packed(planes, codes)
    )


def packed(planes: Sequence[Plane], codes: Mapping[str, Codes]) -> str:
    """Return the named codes of planes as in `Embedded.data`."""
    raw = b"".join(_bytes(codes[plane.name], codes.get(plane.base or "")) for plane in planes)
    return base64.b64encode(zlib.compress(raw)).decode("ascii")


def encode(values: ArrayLike, digits: int = DIGITS) -> Codes:
    """Return half floats as integers, rounded to the bits that some digits need."""
    codes = np.clip(values, -LARGEST, LARGEST).astype(np.float16).view(np.uint16)
    step = 1 << (BITS[3] - BITS[digits])
    rounded = np.minimum((codes & 0x7FFF) + step // 2, 0x7BFF) & ~np.uint16(step - 1)
    return np.where(rounded > 0, rounded | (codes & 0x8000), 0).astype(np.uint16)


def _means(image: ArrayLike, block: int) -> NDArray[np.float64]:
    """Means over square blocks, which may be smaller at the right and bottom edges."""
    image = np.asarray(image, np.float64)
    if block == 1:
        return image
    sums, areas = image, np.ones(image.shape)
    for axis in (0, 1):
        places = np.arange(0, image.shape[axis], block)
        sums, areas = (np.add.reduceat(part, places, axis=axis) for part in (sums, areas))
    return sums / areas


def _bytes(codes: Codes, base: Codes | None) -> bytes:
    """Differences, zigzagged so that small ones have a high byte of 0; low bytes, then high."""
    differences = codes.copy() if base is None else codes - base
    differences[:, 1:] -= differences[:, :-1].copy()
    signed = differences.view(np.int16)
    zigzag = ((signed << 1) ^ (signed >> 15)).view(np.uint16)
    return (zigzag & 0xFF).astype(np.uint8).tobytes() + (zigzag >> 8).astype(np.uint8).tobytes()
