"""Colour spaces that picture files name, converted to linear light with the primaries of BT.709.

Display white is 1. Whites are adapted by Bradford's matrix, as ICC profiles do, and colours outside
BT.709 are clipped at 0. What a file names and this module does not know raises `ValueError` with
the fault, since any guess would change the colours.

Sources: PNG specification, third edition (4.3: which chunk counts), ITU-T H.273 (numbers of cICP),
ITU-R BT.2100-2 (PQ), BT.2408 (its white), ICC.1:2022 (profiles), Exif 3.0 (R03, orientation).
"""

import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import ExifTags, Image

from fotismos.comparisons.departure.colour import (
    BT709,
    BT2020,
    CHROMATICITIES,
    Array,
    from_pq,
    from_srgb,
    rgb_to_xyz,
)
from fotismos.comparisons.records.departure import DEFAULT_VIEWING
from fotismos.heuristic.convention import Floats

Curve = Callable[[Array], Array]

SAME_PRIMARIES = 2e-3
"""Largest difference of chromaticities, or of gammas, that are the same: some files round them."""

GAMMA_OF_SRGB = 1 / 2.2
"""What a gAMA chunk has for sRGB (PNG specification, 11.3.2.4)."""

GAMMA_OF_ADOBE_RGB = 563 / 256

D65 = BT709[-1]
P3 = (0.680, 0.320, 0.265, 0.690, 0.150, 0.060)

PRIMARIES: dict[str, tuple[float, ...]] = {
    "BT.709": CHROMATICITIES,
    "BT.2020": tuple(value for point in BT2020 for value in point),
    "Display P3": (*P3, *D65),
    "DCI-P3": (*P3, 0.314, 0.351),
    "BT.601 of 625 lines": (0.640, 0.330, 0.290, 0.600, 0.150, 0.060, *D65),
    "BT.601 of 525 lines": (0.630, 0.340, 0.310, 0.595, 0.155, 0.070, *D65),
    "Adobe RGB": (0.640, 0.330, 0.210, 0.710, 0.150, 0.060, *D65),
    "ACEScg": (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767),
    "ACES2065-1": (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767),
}
"""Names of known primaries: x and y of red, green, blue and white."""

# Bradford's cone responses.
_CONES = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])

_WHITE = rgb_to_xyz(BT709).sum(axis=1)
_FROM_XYZ = np.linalg.inv(rgb_to_xyz(BT709))


@dataclass(frozen=True)
class ColourSpace:
    """How the codes of a file, 0 to 1, become light.

    ``curve`` decodes them; None if they are linear. ``matrix`` (3, 3) leads from linear values to
    BT.709; None if that is theirs. ``notes`` say it in words. ``ends_at_white``: 1 is the display's
    white.
    """

    curve: Curve | None = None
    matrix: Array | None = None
    notes: tuple[str, ...] = ()
    ends_at_white: bool = True

    def light(self, codes: Floats) -> Floats:
        """Return the linear light of codes (H, W, 3)."""
        linear = codes if self.curve is None else self.curve(codes.astype(float))
        if self.matrix is None:
            return linear
        converted: Array = np.maximum(linear @ self.matrix.T, 0.0)
        return converted


def power(gamma: float) -> Curve:
    """Return the curve ``v^gamma`` of codes ≥ 0."""
    return lambda codes: codes**gamma


# --- Primaries ---------------------------------------------------------------------------------


def of_primaries(primaries: Sequence[float]) -> ColourSpace:
    """Return the space of linear values with primaries: x and y of red, green, blue and white."""
    if _are_same(primaries, CHROMATICITIES):
        return ColourSpace()
    red, green, blue, white = np.reshape(primaries, (4, 2))
    is_finite = np.isfinite(primaries).all()
    area = abs(np.linalg.det(np.stack([green - red, blue - red]))) if is_finite else 0.0
    if area < SAME_PRIMARIES or white[1] <= 0:
        raise ValueError(f"{_named(primaries)} span no colours")
    to_xyz = rgb_to_xyz(tuple(zip(primaries[0::2], primaries[1::2], strict=True)))
    return ColourSpace(
        matrix=_from_xyz(to_xyz, to_xyz.sum(axis=1)),
        notes=(f"converted from {_named(primaries)} to BT.709",),
    )


def _from_xyz(to_xyz: Array, white: Array) -> Array:
    """Return the matrix to BT.709, for one (3, 3) to XYZ in which white has the values (3,)."""
    gains = (_CONES @ _WHITE) / (_CONES @ white)
    adapted: Array = np.linalg.inv(_CONES) @ np.diag(gains) @ _CONES
    return _FROM_XYZ @ adapted @ to_xyz


def _are_same(primaries: Sequence[float], others: Sequence[float]) -> bool:
    return bool(max(abs(np.subtract(primaries, others))) <= SAME_PRIMARIES)


def _named(primaries: Sequence[float]) -> str:
    for name, known in PRIMARIES.items():
        if _are_same(primaries, known):
            return name
    return f"the primaries and white ({', '.join(f'{value:.4g}' for value in primaries)})"


# --- EXR ---------------------------------------------------------------------------------------

INTEROP_IDS = {
    "lin_rec709_scene": "BT.709",
    "lin_rec2020_scene": "BT.2020",
    "lin_p3d65_scene": "Display P3",
    "lin_adobergb_scene": "Adobe RGB",
    "lin_ap1_scene": "ACEScg",
    "lin_ap0_scene": "ACES2065-1",
}
"""Primaries by the identifiers of the Color Interop Forum, for files that name one."""

NO_SPACE = ("", "data", "unknown")
"""Identifiers that name no colour space."""


def of_exr(header: Mapping[str, Any]) -> ColourSpace:
    """Return the space of an EXR file: by its chromaticities, or else its identifier."""
    identifier = str(header.get("colorInteropID", ""))
    if identifier not in (*INTEROP_IDS, *NO_SPACE):
        raise ValueError(f"its colorInteropID {identifier} is not read")
    primaries = header.get("chromaticities")
    if primaries is None:
        primaries = PRIMARIES[INTEROP_IDS.get(identifier, "BT.709")]
    return of_primaries(primaries)


# --- PNG and JPEG ------------------------------------------------------------------------------

CICP_PRIMARIES = {
    1: "BT.709",
    5: "BT.601 of 625 lines",
    6: "BT.601 of 525 lines",
    7: "BT.601 of 525 lines",
    9: "BT.2020",
    11: "DCI-P3",
    12: "Display P3",
}
"""Primaries by their numbers in ITU-T H.273."""


def _pq_light(codes: Array) -> Array:
    return from_pq(codes) / DEFAULT_VIEWING.white_luminance


CICP_CURVES: dict[int, tuple[str, Curve | None]] = {
    4: ("a gamma of 2.2", power(2.2)),
    5: ("a gamma of 2.8", power(2.8)),
    8: ("linear", None),
    13: ("sRGB's curve", from_srgb),
    16: (f"PQ, of which {DEFAULT_VIEWING.white_luminance:g} cd/m² are 1", _pq_light),
}
"""Curves by their numbers in ITU-T H.273, in words. Those of cameras (such as 1) and HLG (18) do
not say what a display shows."""


def of_bitmap(file: Image.Image, kind: str, cicp: bytes | None) -> ColourSpace:
    """Return the space of a PNG or JPEG that Pillow has loaded; ``cicp`` is the chunk's content.

    What comes first counts: cICP, ICC profile, sRGB, gAMA with cHRM; without any, sRGB.
    """
    info = file.info
    if cicp is not None:
        return _of_cicp(cicp)
    if "icc_profile" in info:
        return of_profile(info["icc_profile"] or b"", is_grey=file.mode in ("1", "L", "LA", "I;16"))
    if file.getexif().get_ifd(ExifTags.IFD.Interop).get(1) == "R03":
        adobe = of_primaries(PRIMARIES["Adobe RGB"])
        note = "converted from Adobe RGB, which its EXIF data name"
        return ColourSpace(power(GAMMA_OF_ADOBE_RGB), adobe.matrix, (note,))
    gamma = None if "srgb" in info else info.get("gamma")
    curve: Curve | None = from_srgb
    note = f"read as sRGB, as {kind} files are"
    if gamma:
        note = f"read with the gamma of its gAMA chunk, {gamma:g}"
        if abs(gamma - 1) < SAME_PRIMARIES:
            curve = None
        elif abs(gamma - GAMMA_OF_SRGB) >= SAME_PRIMARIES:
            curve = power(1 / gamma)
    linear = ColourSpace()
    if "chromaticity" in info and "srgb" not in info:
        white, *colours = np.reshape(info["chromaticity"], (4, 2))
        linear = of_primaries(np.ravel([*colours, white]).tolist())
    return ColourSpace(curve, linear.matrix, (note, *linear.notes))


def _of_cicp(content: bytes) -> ColourSpace:
    primaries, transfer, matrix, full_range = content.ljust(4, b"\0")
    if matrix != 0 or full_range != 1:
        raise ValueError("its cICP chunk names luma and chroma, or a narrow range")
    for word, number, known in (
        ("primaries", primaries, list(CICP_PRIMARIES)),
        ("the curve", transfer, list(CICP_CURVES)),
    ):
        if number not in known:
            allowed = ", ".join(map(str, known))
            raise ValueError(f"its cICP chunk names {word} {number}, and those read are {allowed}")
    name = CICP_PRIMARIES[primaries]
    linear = of_primaries(PRIMARIES[name])
    words, curve = CICP_CURVES[transfer]
    return ColourSpace(
        curve=curve,
        matrix=linear.matrix,
        notes=(f"read as its cICP chunk says: {name}, {words}",),
        ends_at_white=curve is not _pq_light,
    )


# --- ICC profiles ------------------------------------------------------------------------------

D50 = np.array((0.9642, 1.0, 0.8249))
"""XYZ of the white to which profiles refer."""

DAMAGED = "its ICC profile is damaged"

PARAMETERS = (1, 3, 4, 5, 7)
"""How many parameters each kind of parametric curve has (ICC.1:2022, 10.18)."""


def of_profile(profile: bytes, is_grey: bool = False) -> ColourSpace:
    """Return the space of an ICC profile: of three primaries and curves, or of one curve of grey.

    Profiles with tables (``A2B0``), such as those of printers, are refused with a message.
    """
    tags = _tags(profile)
    name = _description(tags.get("desc", b""))
    called = f"its ICC profile{f', {name},' if name else ''}"
    space = profile[16:20]
    if any(tag.startswith(("A2B", "D2B")) for tag in tags):
        raise ValueError(f"{called} has tables, which are not read")
    needed = {b"RGB ": ("rTRC", "gTRC", "bTRC", "rXYZ", "gXYZ", "bXYZ"), b"GRAY": ("kTRC",)}
    if not set(needed.get(space, ("none",))) <= set(tags) or profile[20:24] != b"XYZ ":
        raise ValueError(f"{called} has no curves and primaries from RGB or grey to XYZ")
    if space == b"GRAY" and not is_grey:
        raise ValueError(f"{called} is for grey, and the picture has colours")
    notes = (f"converted from {called.rstrip(',')}",)
    if space == b"GRAY":
        return ColourSpace(curve=_curve(tags["kTRC"]), notes=notes)
    curves = [_curve(tags[f"{c}TRC"]) for c in "rgb"]
    columns = [_fixed(tags[f"{c}XYZ"], place=8, count=3) for c in "rgb"]
    matrix = _from_xyz(np.array(columns).T, D50)
    return ColourSpace(curve=partial(_by_channel, curves), matrix=matrix, notes=notes)


def _by_channel(curves: Sequence[Curve], codes: Array) -> Array:
    return np.stack([curve(codes[..., c]) for c, curve in enumerate(curves)], axis=-1)


def _tags(profile: bytes) -> dict[str, bytes]:
    """Return the contents of a profile's tags by their signatures."""
    if profile[36:40] != b"acsp" or len(profile) < 132:
        raise ValueError(DAMAGED)
    count = int.from_bytes(profile[128:132], "big")
    if 132 + 12 * count > len(profile):
        raise ValueError(DAMAGED)
    tags = {}
    for signature, place, size in struct.iter_unpack(">4sII", profile[132 : 132 + 12 * count]):
        if place + size > len(profile):
            raise ValueError(DAMAGED)
        tags[signature.decode("latin-1")] = profile[place : place + size]
    return tags


def _description(tag: bytes) -> str:
    """Return the name of a profile: of version 2 in ASCII, of version 4 in UTF-16."""
    if tag[:4] == b"mluc":
        size = int.from_bytes(tag[20:24], "big")
        place = int.from_bytes(tag[24:28], "big")
        text = tag[place : place + size].decode("utf-16-be", "ignore")
    else:
        text = tag[12 : 12 + int.from_bytes(tag[8:12], "big")].decode("ascii", "ignore")
    return "".join(character for character in text if character.isprintable()).strip()


def _fixed(tag: bytes, place: int, count: int) -> list[float]:
    """Return numbers of a tag, in units of 1 / 65536."""
    if len(tag) < place + 4 * count:
        raise ValueError(DAMAGED)
    return [number / 65536 for number in struct.unpack_from(f">{count}i", tag, place)]


def _curve(tag: bytes) -> Curve:
    """Return a curve of a profile, of codes from 0 to 1: a power, a table, or a formula."""
    if tag[:4] == b"para" and len(tag) >= 12:
        return _formula(tag)
    count = int.from_bytes(tag[8:12], "big")
    if tag[:4] != b"curv" or len(tag) < 12 + 2 * count:
        raise ValueError(DAMAGED)
    numbers = np.frombuffer(tag, ">u2", count, offset=12)
    if count < 2:
        return power(float(numbers[0]) / 256 if count else 1.0)
    table = numbers / 65535
    places = np.linspace(0.0, 1.0, count)
    return lambda codes: np.interp(codes, places, table)


def _formula(tag: bytes) -> Curve:
    """Return ``(a x + b)^g + e`` from a place on, and ``c x + f`` below it."""
    kind = int.from_bytes(tag[8:10], "big")
    if kind >= len(PARAMETERS):
        raise ValueError(DAMAGED)
    numbers = _fixed(tag, place=12, count=PARAMETERS[kind])
    g, a, b, c, d, e, f = [*numbers, *[0.0] * (7 - len(numbers))]
    if kind == 0:
        a = 1.0
    if kind in (1, 2):  # their fourth number, if any, is added everywhere
        d = -b / a if a else 0.0
        e = f = c
        c = 0.0
    if g <= 0:
        raise ValueError(DAMAGED)
    return lambda codes: np.where(
        codes >= d, np.maximum(a * codes + b, 0.0) ** g + e, c * codes + f
    )


# --- Orientation -------------------------------------------------------------------------------

TURNS: dict[int, Callable[[NDArray[Any]], NDArray[Any]]] = {
    2: lambda pixels: pixels[:, ::-1],
    3: lambda pixels: pixels[::-1, ::-1],
    4: lambda pixels: pixels[::-1],
    5: lambda pixels: pixels.swapaxes(0, 1),
    6: lambda pixels: np.rot90(pixels, -1),
    7: lambda pixels: pixels[::-1, ::-1].swapaxes(0, 1),
    8: lambda pixels: np.rot90(pixels),
}
"""What shows pixels (H, W, C) upright, by the number of EXIF's orientation; 1 is upright."""


def turn(file: Image.Image) -> Callable[[NDArray[Any]], NDArray[Any]] | None:
    """Return what shows the pixels of a file upright; None if they are."""
    return TURNS.get(file.getexif().get(ExifTags.Base.Orientation, 1))
