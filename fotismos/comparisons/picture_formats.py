"""Formats of pictures that no library here reads whole: HDR, PFM, and PNG with 16 bits of colours.

A file that is not as its format says raises `ValueError` with the fault.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from fotismos.reference.rendering.passes import LARGEST_VALUE

PFM_HEADER = re.compile(rb"(PF|Pf)\s+(\d{1,9})\s+(\d{1,9})\s+([-+.\deE]+)\s")
"""Kind, width, height and scale."""

HDR_FORMAT = b"FORMAT=32-bit_rle_rgbe"
HDR_SIZE = re.compile(rb"-Y\s+(\d{1,9})\s+\+X\s+(\d{1,9})\s*")
HDR_ORDER = re.compile(rb"[-+][XY]\s+\d{1,9}\s+[-+][XY]\s+\d{1,9}\s*")
"""The line of the size, from top left, and in any order of rows and columns."""
HDR_VARIABLES = {"EXPOSURE": 1, "COLORCORR": 3, "PRIMARIES": 8, "GAMMA": 1}
"""What a header says about values, and how many numbers each has."""
HDR_PACKED = range(8, 2**15)
"""Widths of rows that may be packed."""

TOO_SHORT = "it ends too soon"
EMPTY = "it has no pixels"


@dataclass(frozen=True)
class RadiancePicture:
    """A Radiance picture: its values (H, W, 3), and what its header says about them.

    Light was multiplied by the product of ``exposure`` and ``correction`` (3,). ``primaries`` are
    x and y of red, green, blue and white, None if it has none.
    """

    values: NDArray[np.float32]
    exposure: float
    correction: NDArray[np.float64]
    primaries: tuple[float, ...] | None


def hdr(path: Path) -> RadiancePicture:
    """Read a Radiance picture of RGBE, (H, W, 3).

    A mantissa m stands for m + 1/2, as in Radiance's own programs, which cut when they write.
    """
    header, _, rest = path.read_bytes().partition(b"\n\n")
    line, _, data = rest.partition(b"\n")
    lines = header.splitlines()
    size = HDR_SIZE.fullmatch(line)
    if HDR_FORMAT not in lines:
        raise ValueError(f"its header lacks {HDR_FORMAT.decode()}")
    if size is None and HDR_ORDER.fullmatch(line):
        raise ValueError(f"its order is {line.decode()}, and rows are read from top left, -Y +X")
    if size is None:
        raise ValueError("its header lacks a size, such as -Y 480 +X 640")
    said = [(name, numbers) for line in lines for name, numbers in _hdr_variable(line)]
    if any(numbers != (1.0,) for name, numbers in said if name == "GAMMA"):
        raise ValueError("its header has a GAMMA other than 1, so it is not linear")
    named = {name: [numbers for other, numbers in said if other == name] for name in HDR_VARIABLES}
    # Photoshop writes eight zeros, which are no primaries.
    primaries = [numbers for numbers in named["PRIMARIES"] if any(numbers)]
    height, width = map(int, size.groups())
    if not width or not height:
        raise ValueError(EMPTY)
    rows = []
    place = 0
    for _ in range(height):
        row, place = _hdr_row(data, place, width)
        rows.append(row)
    pixels = np.array(rows, np.uint8).reshape(height, width, 4)
    if (pixels[..., :3] == 1).all(axis=-1).any():  # no colour has such mantissas
        raise ValueError("its rows have runs of the old kind, of mantissas 1, 1 and 1")
    exponents = pixels[..., 3:].astype(int)
    values = np.ldexp(pixels[..., :3].astype(np.float32) + np.float32(0.5), exponents - 136)
    return RadiancePicture(
        values=np.where(exponents > 0, values, np.float32(0)),
        exposure=float(np.prod(named["EXPOSURE"])),
        correction=np.prod(named["COLORCORR"] or [(1.0, 1.0, 1.0)], axis=0),
        primaries=primaries[-1] if primaries else None,
    )


def _hdr_variable(line: bytes) -> Iterator[tuple[str, tuple[float, ...]]]:
    """Yield the name and the numbers of a line of a header, if it is about values."""
    name, _, text = line.decode("latin-1").partition("=")
    count = HDR_VARIABLES.get(name)
    if count is None:
        return
    try:
        numbers = tuple(float(word) for word in text.split())
    except ValueError:
        numbers = ()
    is_factor = name in ("EXPOSURE", "COLORCORR")
    is_sound = all(1 / LARGEST_VALUE < number < LARGEST_VALUE for number in numbers)
    if len(numbers) != count or (is_factor and not is_sound):
        raise ValueError(f"its header has {name}={text.strip() or 'nothing'}")
    yield name, numbers


def _hdr_row(data: bytes, place: int, width: int) -> tuple[NDArray[np.uint8], int]:
    """Return the pixels (W, 4) of the row at a place, and where the next one begins."""
    mark = bytes([2, 2, width >> 8 & 255, width & 255])
    if width not in HDR_PACKED or data[place : place + 4] != mark:
        end = place + 4 * width
        if end > len(data):
            raise ValueError(TOO_SHORT)
        return np.frombuffer(data[place:end], np.uint8).reshape(width, 4), end
    place += 4
    planes = bytearray()
    for channel in range(1, 5):
        while len(planes) < channel * width:
            code = data[place] if place < len(data) else 0
            # Above 128 the next byte is repeated; else so many bytes follow.
            count = code - 128 if code > 128 else code
            following = 1 if code > 128 else count
            found = data[place + 1 : place + 1 + following]
            if not code or len(found) < following:
                raise ValueError(TOO_SHORT)
            planes += found * count if code > 128 else found
            place += 1 + following
        if len(planes) != channel * width:
            raise ValueError("a run is longer than its row")
    return np.frombuffer(planes, np.uint8).reshape(4, width).T, place


def pfm(path: Path) -> NDArray[np.float32]:
    """Read a portable float map, (H, W, 3) or (H, W, 1)."""
    content = path.read_bytes()
    header = PFM_HEADER.match(content)
    if header is None:
        raise ValueError("it has no kind, width, height and scale")
    kind, width, height, scale = header.groups()
    factor = float(scale)
    shape = (int(height), int(width), 3 if kind == b"PF" else 1)
    size = 4 * shape[0] * shape[1] * shape[2]
    if not size:
        raise ValueError(EMPTY)
    data = content[header.end() : header.end() + size]
    if len(data) < size:
        raise ValueError(TOO_SHORT)
    rows = np.frombuffer(data, "<f4" if factor < 0 else ">f4").reshape(shape)
    # The lowest row is the first.
    with np.errstate(all="ignore"):  # what becomes NaN or infinite is refused later
        return (rows[::-1] * abs(factor)).astype(np.float32)


def deep_png(path: Path) -> NDArray[np.uint16]:
    """Read a PNG with 16 bits of several channels, (H, W, C), of which Pillow keeps the high 8.

    Taken for little-endian, it gives the low ones.
    """
    with Image.open(path) as file:
        if not file.tile:
            raise ValueError(TOO_SHORT)
        coding = str(file.tile[0].args)
        clear = file.info.get("transparency")
    if coding == "LA;16B":  # four bytes of a pixel
        return _decoded(path, "RGBA").view(">u2").astype(np.uint16)
    high = _decoded(path, coding).astype(np.uint16)
    low = _decoded(path, coding.replace("16B", "16L"))
    colours: NDArray[np.uint16] = high << np.uint16(8) | low
    return colours if clear is None else with_alpha(colours, clear)


def grey_png(file: Image.Image, bits: int) -> NDArray[Any]:
    """Return the codes (H, W, 2) of a grey PNG with a clear one, of so many bits, and their alpha.

    Pillow compares codes of 2 and 4 bits that it has scaled to 8, and cuts those of 16.
    """
    codes = np.array(file.convert("L") if file.mode == "1" else file)
    largest = 2**bits - 1
    scale = int(np.iinfo(codes.dtype).max) // largest
    return with_alpha(codes[..., None], (file.info["transparency"] & largest) * scale)


def with_alpha(codes: NDArray[Any], clear: Any) -> NDArray[Any]:
    """Return codes (H, W, C) with an alpha that is 0 where they are the clear one."""
    is_clear = (codes == clear).all(axis=-1, keepdims=True)
    alpha = np.where(is_clear, 0, np.iinfo(codes.dtype).max).astype(codes.dtype)
    return np.concatenate([codes, alpha], axis=-1)


def png_chunk(path: Path, name: bytes) -> bytes | None:
    """Return the content of a chunk that stands before a PNG's pixels; None if there is none."""
    with path.open("rb") as stream:
        stream.seek(8)
        while True:
            size = int.from_bytes(stream.read(4), "big")
            kind = stream.read(4)
            if kind == name:
                return stream.read(size)
            if kind in (b"", b"IDAT"):
                return None
            stream.seek(size + 4, 1)


def _decoded(path: Path, coding: str) -> NDArray[np.uint8]:
    """Return the bytes (H, W, C) that Pillow makes of a file by one of its codings of pixels."""
    with Image.open(path) as file:
        file.tile = [file.tile[0]._replace(args=coding)]
        return np.array(file)
