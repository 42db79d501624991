"""Pictures of linear images and maps: OpenEXR, 8 bits (Pillow) with colour bars, small WebP.

Colour maps are Matplotlib's tables, read without pyplot: magma for errors, RdBu for signed values
(both readable with common colour-vision deficiencies). The caller fixes the ranges, which are
printed next to the picture; values beyond them take the end's colour.
"""

import base64
from collections.abc import Mapping
from functools import lru_cache
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image

from fotismos.comparisons import atomic
from fotismos.comparisons.departure import marks
from fotismos.comparisons.departure.blocks import shrunk
from fotismos.comparisons.departure.colour import CHROMATICITIES, to_srgb
from fotismos.comparisons.departure.criterion import TOLERANCE
from fotismos.comparisons.departure.metrics import LEADING, RATIO, drawn
from fotismos.comparisons.records.images import Images

Bytes = NDArray[np.uint8]

#: Quality of WebP pictures, from 0 to 100.
QUALITY = 80

#: Colour maps by purpose.
ERROR_COLOURS = "magma"
SIGNED_COLOURS = "RdBu_r"

#: The greatest grey of a difference that is not visible.
DARK = 70

#: Pixels of a thumbnail's longer side; cards show it at two thirds of that size.
THUMBNAIL = 160

#: Colours of `mask_map`: marked, not marked, not counted, undetermined (sRGB).
MARKED = (213, 94, 0)
UNMARKED = (222, 226, 230)
UNCOUNTED = (130, 136, 143)
UNDETERMINED = (240, 201, 119)


def tonemap(rgb: ArrayLike, exposure: float = 1.0) -> Image.Image:
    """Linear RGB (H, W, 3) as sRGB: × exposure, clipped to [0, 1], as 8 bits."""
    linear = np.clip(np.asarray(rgb, np.float32) * np.float32(exposure), 0.0, 1.0)
    return Image.fromarray(np.round(255.0 * to_srgb(linear)).astype(np.uint8))


def error_map(values: ArrayLike, vmax: float) -> Image.Image:
    """A map (H, W) of values ≥ 0: 0 to `vmax` over the colour map, beyond it the last colour."""
    return _coloured(np.asarray(values, np.float64) / vmax, ERROR_COLOURS)


def difference_map(values: ArrayLike, threshold: float, top: float) -> Image.Image:
    """A map (H, W) of differences: grey up to a threshold, then the colours from a quarter to all.

    The page's script draws its maps by the same rule, with a threshold that moves.
    """
    values = np.asarray(values, np.float64)
    table = _table(ERROR_COLOURS)
    above = np.clip(64 + 192 * (values - threshold) / (top - threshold), 64, 255).astype(np.uint8)
    grey = np.round(DARK * np.clip(values / threshold, 0, 1)).astype(np.uint8)
    return Image.fromarray(np.where((values > threshold)[..., None], table[above], grey[..., None]))


def mask_map(marked: ArrayLike, counted: ArrayLike) -> Image.Image:
    """A map (H, W) of marks, 1, 0.5 or 0: orange if marked, pale if undetermined, else grey.

    Pixels that are not counted are a darker grey.
    """
    marked = np.asarray(marked, np.float64)
    index = np.where(marked == marks.MARKED, np.uint8(0), np.uint8(1))
    index[marked == marks.UNDETERMINED] = 3
    index[~np.asarray(counted, bool)] = 2
    colours = [MARKED, UNMARKED, UNCOUNTED, UNDETERMINED]
    return _with_palette(index, np.array(colours, np.uint8))


def colour_table(colormap: str) -> str:
    """The 256 colours of a map as hexadecimal digits, six per colour."""
    return _table(colormap).tobytes().hex()


def png(picture: Image.Image) -> bytes:
    """The PNG file of a picture, pixel for pixel; the bytes depend on the pixels alone."""
    buffer = BytesIO()
    # Level 4: half the time of 6 for files 5 % larger.
    picture.save(buffer, "PNG", compress_level=4)
    return buffer.getvalue()


def pictures(shown: Images, exposure: float = 1.0) -> dict[str, bytes]:
    """The named PNG files of a comparison, each map over the fixed range of its metric.

    The ratio's is signed: from its limit below 0 (blue) over 0 (near white) to that above (red).
    """
    ratio = 0.5 + 0.5 * np.asarray(shown.maps[RATIO.name], np.float64) / RATIO.limit
    panels = {
        "heuristic": tonemap(shown.heuristic, exposure),
        "reference": tonemap(shown.reference, exposure),
        "significant": mask_map(shown.significant, shown.counted),
        RATIO.name: _coloured(ratio, SIGNED_COLOURS),
    }
    for name, metric in drawn().items():
        panels[name] = error_map(shown.maps[name], metric.map_range[1])
    return {name: png(picture) for name, picture in panels.items()}


def thumbnails(shown: Images, exposure: float = 1.0) -> dict[str, bytes]:
    """Small WebP files: both halves, the leading metric's map, and terms that are not black."""
    panels = {
        "heuristic": tonemap(shown.heuristic, exposure),
        "reference": tonemap(shown.reference, exposure),
        LEADING.name: difference_map(shown.maps[LEADING.name], TOLERANCE, LEADING.map_range[1]),
    }
    panels |= {name: tonemap(term, exposure) for name, term in shown.terms.items() if term.any()}
    size = shrunk(panels["reference"].size, THUMBNAIL)
    return {
        # Pillow resizes a palette by the nearest pixel: colours first, so that they are averaged.
        name: webp(picture.convert("RGB").resize(size, Image.Resampling.BOX))
        for name, picture in panels.items()
    }


def _coloured(fraction: NDArray[np.float64], colormap: str) -> Image.Image:
    table = _table(colormap)
    index = np.clip(fraction * len(table), 0, len(table) - 1).astype(np.uint8)
    return _with_palette(index, table)


def _with_palette(index: Bytes, table: Bytes) -> Image.Image:
    # A palette keeps the file half as large as three channels would.
    picture = Image.fromarray(index)
    picture.putpalette(table.tobytes())
    return picture


@lru_cache
def _table(colormap: str) -> Bytes:
    from matplotlib import colormaps

    colours: np.ndarray = colormaps[colormap].resampled(256)(np.arange(256))[:, :3]
    return np.round(255 * colours).astype(np.uint8)


# --- Small pictures for the page ---------------------------------------------------------------


def webp(picture: Image.Image, lossless: bool = False) -> bytes:
    """Return the WebP file of a picture."""
    buffer = BytesIO()
    # Without loss, `quality` means the effort to pack.
    picture.convert("RGB").save(buffer, "WEBP", quality=QUALITY, method=4, lossless=lossless)
    return buffer.getvalue()


def reduced(file: bytes, side: int) -> NDArray[np.float64]:
    """Return a picture's file in grey at ``side`` by ``side`` pixels, as one row."""
    with Image.open(BytesIO(file)) as picture:
        small = picture.convert("L").resize((side, side), Image.Resampling.BOX)
    return np.asarray(small, np.float64).ravel()


def webp_uri(file: bytes) -> str:
    """Return a WebP file as an address that holds it."""
    return "data:image/webp;base64," + base64.b64encode(file).decode("ascii")


# --- OpenEXR ----------------------------------------------------------------------------------

#: Layers that keep float32, as terms do; the others are maps, for which half's 11 bits are enough.
FULL_PRECISION = frozenset({"heuristic", "reference", "reference_stderr", "P", "N"})

#: How the layers of a baseline begin.
PASS = "pass."

#: How further layers begin that keep float32.
FULL_PREFIXES = ("term.", PASS)

#: Layers with X, Y, Z instead of R, G, B.
VECTORS = frozenset({"P", "N"})

#: The largest finite half.
HALF_MAX = 65_504.0


def write_exr(path: Path, layers: Mapping[str, ArrayLike], header: Mapping[str, object]) -> None:
    """Write named images to a file atomically, as one scanline part, ZIP-compressed.

    See :func:`channels`. The header is metadata, e.g. seed, samples and versions; BT.709's
    chromaticities are added.
    """
    import OpenEXR

    attributes = {
        **{name: str(value) for name, value in header.items()},
        "type": OpenEXR.scanlineimage,
        "compression": OpenEXR.ZIP_COMPRESSION,
        "chromaticities": CHROMATICITIES,
    }
    file = OpenEXR.File(attributes, channels(layers))
    # Given a path, the bindings do not report that its end could not be written.
    with file, atomic.replacing(path) as partial, partial.open("wb") as stream:
        file.write(stream)


def channels(layers: Mapping[str, ArrayLike]) -> dict[str, np.ndarray]:
    """Return images of one size as OpenEXR channels: contiguous (H, W) half or float32.

    (H, W, 3) becomes ``name.R``, ``name.G``, ``name.B``, or ``.X``, ``.Y``, ``.Z`` for "P" and "N";
    (H, W), also boolean, becomes ``name.Y``. `FULL_PRECISION`, `FULL_PREFIXES` and values beyond
    half are float32.
    """
    result: dict[str, np.ndarray] = {}
    for name, values in layers.items():
        image = np.asarray(values)
        # Above HALF_MAX a half becomes infinite.
        is_large = bool(image.size) and np.abs(image).max() > HALF_MAX
        is_full = is_large or name in FULL_PRECISION or name.startswith(FULL_PREFIXES)
        precision = np.float32 if is_full else np.float16
        suffixes = "Y" if image.ndim == 2 else "XYZ" if name in VECTORS else "RGB"
        planes = image[..., None] if image.ndim == 2 else image
        for index, suffix in enumerate(suffixes):
            result[f"{name}.{suffix}"] = np.ascontiguousarray(planes[..., index], precision)
    return result
