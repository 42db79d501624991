"""A comparison's images inside the page, as numbers: exact to the digits that the page prints.

Every value is rounded to three significant decimal digits, metrics other than the leading one to
two and the standard error to one, and stored as a 16-bit code. So the page prints the EXR's own
value, rounded once; half floats would take more bits and sometimes print another last digit. With
three digits, steps between codes are at most 1 %, near white one 8-bit level.

A plane's codes are replaced by their differences to a base plane (green, for red and blue), then
to the left neighbour, and split into low and high bytes; all planes are deflated together.
``templates/viewer/decoding.js`` reverses this.
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
from comparisons.records import Record, plain

#: Significant digits of values and of the leading metric, of the other metrics, and of the standard
#: error, which is averaged over squares of `POOLED` by `POOLED` pixels.
DIGITS, OTHER_DIGITS, ERROR_DIGITS, POOLED = 3, 2, 1, 2

#: Decimal exponents of the smallest and the largest magnitudes; smaller ones are 0.
EXPONENTS = (-18, 16)

#: Added to the code of a magnitude if the value is negative.
NEGATIVE = 0x8000

#: Smaller differences are printed as "< 0.01", and stored as half of it, if maps reach 1.
LEAST = 0.01

#: Pixels; longer images are averaged over square blocks inside the page, never in the files.
LONGEST = 1024

#: Bits of the plane "flags".
SIGNIFICANT, COUNTED, UNDETERMINED = 1, 2, 4

Codes = NDArray[np.uint16]

#: Looked up, since powers would dominate the time of encoding.
_TENS = 10.0 ** np.arange(EXPONENTS[1] - EXPONENTS[0] + DIGITS)


class Plane(Record):
    """One channel: its name, its digits (0: the codes are the values), and its base plane."""

    name: str
    digits: int
    base: str | None = None


class Embedded(Record):
    """The images of a comparison, for the page.

    width, height
        Of the planes. Their pixels are means over `block` × `block` pixels of the image.
    planes
        The content of `data`, in order.
    data
        The planes, deflated (RFC 1950), in base64.
    """

    width: int
    height: int
    block: int
    planes: tuple[Plane, ...]
    data: str

    def manifest(self) -> dict[str, Any]:
        """The description needed to read `data`, as plain data."""
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
        planes.append(Plane(name, digits, base))
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
    add("standard_error", _pooled(np.max(deviations, axis=0)), ERROR_DIGITS)
    marked = np.asarray(channels["significant.Y"], np.float64)
    significant = _means(marked == marks.MARKED, block) > 0.0
    undetermined = (_means(marked == marks.UNDETERMINED, block) > 0.0) & ~significant
    flags = SIGNIFICANT * significant + COUNTED * (_means(counted, block) > 0.0)
    flags = flags + UNDETERMINED * undetermined
    add("flags", flags.astype(np.uint16), 0)

    height, width = flags.shape
    return Embedded(width, height, block, tuple(planes), packed(planes, codes))


def _pooled(values: NDArray) -> NDArray:
    """Return the means over squares, at all their pixels, (H, W)."""
    height, width = values.shape
    means = _means(values, POOLED)
    return means.repeat(POOLED, axis=0).repeat(POOLED, axis=1)[:height, :width]


def embed_colours(image: NDArray, digits: int) -> Embedded:
    """Encode an image (H, W, 3) as planes R, G and B of some digits."""
    planes = [Plane(colour, digits) for colour in "RGB"]
    codes = {colour: encode(image[..., place], digits) for place, colour in enumerate("RGB")}
    height, width, _ = image.shape
    return Embedded(width, height, 1, tuple(planes), packed(planes, codes))


def packed(planes: Sequence[Plane], codes: Mapping[str, Codes]) -> str:
    """The named codes of planes as in `Embedded.data`."""
    raw = b"".join(_bytes(codes[plane.name], codes.get(plane.base or "")) for plane in planes)
    return deflated(raw)


def deflated(raw: bytes, level: int = 6) -> str:
    """Return bytes, deflated (RFC 1950), in base64."""
    return base64.b64encode(zlib.compress(raw, level)).decode("ascii")


def encode(values: ArrayLike, digits: int = DIGITS) -> Codes:
    """The codes of finite values: 0 for 0, rising with the magnitude, + `NEGATIVE` for the sign.

    A magnitude m · 10^(e − digits + 1), with m of `digits` digits, has the code
    9 · 10^(digits−1) · (e − lowest) + m − 10^(digits−1) + 1. Ties are rounded to even, as
    Python prints them. Magnitudes beyond `EXPONENTS` are clipped.
    """
    values = np.asarray(values, np.float64)
    lowest, highest = EXPONENTS
    unit = 10 ** (digits - 1)
    size = np.clip(np.abs(values), 0.0, (10.0 - 5.0 / unit) * 10.0**highest)
    exponent = np.floor(np.log10(np.maximum(size, 10.0**lowest))).astype(int)
    mantissa = np.rint(_scaled(size, digits - 1 - exponent)).astype(int)
    carried = mantissa == 10 * unit  # 9.996 is 10.0
    exponent, mantissa = exponent + carried, np.where(carried, unit, mantissa)
    code = np.where(mantissa < unit, 0, 9 * unit * (exponent - lowest) + mantissa - unit + 1)
    return np.where((values < 0) & (code > 0), code + NEGATIVE, code).astype(np.uint16)


def _scaled(size: NDArray, power: NDArray) -> NDArray:
    # Powers of ten are exact, so ties stay ties; one of the two factors is 1.
    return size * _TENS[np.maximum(power, 0)] / _TENS[np.maximum(-power, 0)]


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
