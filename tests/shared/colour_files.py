"""PNG files and ICC profiles of all kinds, byte by byte as their specifications say."""

import struct
import zlib
from collections.abc import Mapping, Sequence

import numpy as np

KINDS = {1: 0, 2: 4, 3: 2, 4: 6}
"""PNG's kind of colours by the number of channels."""

D50 = (0.9642, 1.0, 0.8249)


def chunk(name: str, content: bytes) -> bytes:
    body = name.encode() + content
    return struct.pack(">I", len(content)) + body + struct.pack(">I", zlib.crc32(body))


def png(
    codes: np.ndarray, chunks: Mapping[str, bytes] | None = None, bits: int | None = None
) -> bytes:
    """Return a PNG file of codes (H, W, C) of 8 or 16 bits, or of grey (H, W, 1) of fewer."""
    height, width, channels = codes.shape
    bits = bits or 8 * codes.dtype.itemsize
    header = struct.pack(">IIBBBBB", width, height, bits, KINDS[channels], 0, 0, 0)
    if bits < 8:
        places = np.unpackbits(codes.astype(np.uint8), axis=2).reshape(height, width, 8)
        rows = np.packbits(places[..., 8 - bits :].reshape(height, -1), axis=1)
    else:
        rows = codes.astype(f">u{bits // 8}").reshape(height, -1).view(np.uint8)
    data = zlib.compress(b"".join(b"\0" + row.tobytes() for row in rows))
    named = b"".join(chunk(name, content) for name, content in (chunks or {}).items())
    ends = chunk("IDAT", data) + chunk("IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + chunk("IHDR", header) + named + ends


def iccp(profile: bytes) -> bytes:
    """Return the content of an iCCP chunk."""
    return b"x\0\0" + zlib.compress(profile)


def chrm(primaries: Sequence[float]) -> bytes:
    """Return the content of a cHRM chunk, for x and y of red, green, blue and white."""
    white_first = [*primaries[6:], *primaries[:6]]
    return struct.pack(">8I", *(round(100_000 * value) for value in white_first))


def gama(gamma: float) -> bytes:
    return struct.pack(">I", round(100_000 * gamma))


def orientation(number: int) -> bytes:
    """Return EXIF data that say how a picture is turned."""
    entry = struct.pack(">HHIHH", 0x0112, 3, 1, number, 0)
    return b"MM\0*" + struct.pack(">IH", 8, 1) + entry + bytes(4)


# --- Profiles ----------------------------------------------------------------------------------


def fixed(values: Sequence[float]) -> bytes:
    return struct.pack(f">{len(values)}i", *(round(65536 * value) for value in values))


def curv(values: Sequence[float]) -> bytes:
    """Return a curve of one exponent, or of a table from 0 to 1."""
    values = list(values)
    codes = [round(256 * values[0])] if len(values) == 1 else [round(65535 * v) for v in values]
    return b"curv" + struct.pack(f">II{len(codes)}H", 0, len(codes), *codes)


def para(kind: int, values: Sequence[float]) -> bytes:
    """Return a parametric curve: exponent g, then a to f."""
    return b"para" + struct.pack(">IHH", 0, kind, 0) + fixed(values)


def profile(tags: Mapping[str, bytes], space: str = "RGB ", name: str = "planted") -> bytes:
    """Return an ICC profile of version 4 for a display."""
    text = name.encode("utf-16-be")
    words = b"mluc" + struct.pack(">III2s2sII", 0, 1, 12, b"en", b"US", len(text), 28) + text
    white = b"XYZ " + bytes(4) + fixed(D50)
    tags = {"desc": words, "cprt": words, "wtpt": white, **tags}
    place = 128 + 4 + 12 * len(tags)
    table = struct.pack(">I", len(tags))
    contents = b""
    for tag, content in tags.items():
        content += bytes(-len(content) % 4)
        table += struct.pack(">4sII", tag.encode(), place + len(contents), len(content))
        contents += content
    size = place + len(contents)
    header = struct.pack(
        ">I4sI4s4s4s", size, bytes(4), 0x0430_0000, b"mntr", space.encode(), b"XYZ "
    )
    header += struct.pack(">6H4s", 2026, 1, 1, 0, 0, 0, b"acsp") + bytes(28)
    header += fixed(D50)
    return header.ljust(128, b"\0") + table + contents


def matrix_profile(to_d50: np.ndarray, curve: bytes, name: str = "planted") -> bytes:
    """Return a profile of three primaries, the columns of a matrix (3, 3) to XYZ under D50."""
    colorants = {
        f"{c}XYZ": b"XYZ " + bytes(4) + fixed(column)
        for c, column in zip("rgb", to_d50.T, strict=True)
    }
    return profile({**colorants, **{f"{c}TRC": curve for c in "rgb"}}, name=name)
