"""Reading pictures (EXR and PNG) as linear values, and rejecting all others.

Values are in units of display white, with the primaries of BT.709, like all images here. A PNG
does not state its transfer function, so the user must:

==========  ========================================================================
Transfer    Linear value of a stored one, ``v`` in 0..1
==========  ========================================================================
``linear``  ``v``
``srgb``    ``v / 12.92`` up to 0.04045, else ``((v + 0.055) / 1.055)^2.4`` (IEC 61966-2-1)
==========  ========================================================================
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from heuristic.errors import InputError, NonFiniteError, suggestion, unknown

TRANSFERS = ("linear", "srgb")
SUFFIXES = (".exr", ".png")

BT709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
"""CIE x, y of red, green, blue and white."""

SAME_PRIMARIES = 2e-3
"""Largest difference of chromaticities that are the same: some files round them."""

MOST_NEGATIVE = -1e-3
"""Below this, a negative value is more than rounding."""


def read(word: str, transfer: str | None = None) -> np.ndarray:
    """Return a picture as linear RGB, (H, W, 3), float32.

    Parameters
    ----------
    word
        Path of a file; ``FILE.exr:LAYER`` for a layer of an EXR file.
    transfer
        One of :data:`TRANSFERS`; if omitted, an EXR is linear.

    Raises
    ------
    InputError
        When the file cannot be read, is not a picture of opaque colours in BT.709, or is a PNG
        without a stated transfer function.
    NonFiniteError
        When it holds a NaN or an infinity.
    """
    if transfer not in (None, *TRANSFERS):
        raise unknown("transfer", transfer, TRANSFERS)
    path, layer = _parts(word)
    if not path.is_file():
        raise InputError(f"{path}: there is no such file. Give a {' or '.join(SUFFIXES)} picture.")
    image = _exr(path, layer) if path.suffix.lower() == ".exr" else _png(path, transfer)
    _require_finite(image, word)
    if transfer == "srgb":
        image = decoded(image)
    _require_light(image, word)
    return np.ascontiguousarray(image, np.float32)


def decoded(image: np.ndarray) -> np.ndarray:
    """Return sRGB-encoded values as linear ones."""
    low = image <= 0.04045
    return np.where(low, image / 12.92, ((np.maximum(image, 0.04045) + 0.055) / 1.055) ** 2.4)


def encoded(image: np.ndarray) -> np.ndarray:
    """Return linear values as sRGB-encoded ones."""
    image = np.maximum(image, 0)
    low = image <= 0.0031308
    return np.where(low, 12.92 * image, 1.055 * np.maximum(image, 0.0031308) ** (1 / 2.4) - 0.055)


def path_of(word: str) -> Path:
    """Return the file that a word names."""
    return _parts(word)[0]


def _parts(word: str) -> tuple[Path, str]:
    file, _, layer = word.rpartition(":")
    if file.lower().endswith(SUFFIXES):
        return Path(file), layer
    if not word.lower().endswith(SUFFIXES):
        raise InputError(f"{word}: pictures are {' or '.join(SUFFIXES)} files. Convert it to EXR.")
    return Path(word), ""


def _exr(path: Path, layer: str) -> np.ndarray:
    import OpenEXR

    try:
        with OpenEXR.File(str(path), separate_channels=True) as file:
            header = dict(file.header())
            channels = {name: np.array(c.pixels) for name, c in file.channels().items()}
    except Exception as error:  # the library raises many types for a file that is not EXR
        raise InputError(f"{path}: not a readable EXR file: {error}.") from error
    _require_whole(path, header)
    _require_bt709(path, header)
    prefix = f"{layer}." if layer else ""
    if not {f"{prefix}{c}" for c in "RGB"} <= set(channels):
        layers = sorted({name[:-2] for name in channels if name.endswith(".R")})
        if layer and {*"RGB"} <= set(channels):
            raise InputError(f"{path}: it has R, G and B but no layer {layer!r}: give {path}.")
        if not layers:
            raise InputError(
                f"{path}: its channels are {', '.join(sorted(channels))}. Give R, G and B."
            )
        where = f"no layer {layer!r}{suggestion(layer, layers)}" if layer else "no channel R"
        raise InputError(
            f"{path}: it has {where}. Its layers are {', '.join(layers)}: give {path}:{layers[0]}."
        )
    _require_opaque(path, channels.get(f"{prefix}A"))
    return np.stack([channels[f"{prefix}{c}"].astype(float) for c in "RGB"], axis=-1)


def _require_whole(path: Path, header: Mapping[str, Any]) -> None:
    data, display = (np.array(header[name]).tolist() for name in ("dataWindow", "displayWindow"))
    if data != display:
        raise InputError(
            f"{path}: it is cropped: its data window is {_box(data)}, its display window"
            f" {_box(display)}. Save the whole picture."
        )


def _box(window: list[list[int]]) -> str:
    (left, top), (right, bottom) = window
    return f"{right - left + 1}x{bottom - top + 1} from ({left}, {top})"


def _require_bt709(path: Path, header: Mapping[str, Any]) -> None:
    found = header.get("chromaticities")
    if found is None or max(abs(np.subtract(found, BT709))) <= SAME_PRIMARIES:
        return
    shown = ", ".join(f"{value:.4g}" for value in found)
    raise InputError(
        f"{path}: its primaries and white are ({shown}). Convert it to BT.709 (sRGB):"
        f" {', '.join(map(str, BT709))}."
    )


def _png(path: Path, transfer: str | None) -> np.ndarray:
    if transfer is None:
        raise InputError(
            f"{path}: a PNG does not state its transfer function. Add --transfer srgb for values"
            " encoded for displays, or --transfer linear."
        )
    try:
        pixels = np.array(mi.Bitmap(str(path)))
    except RuntimeError as error:
        raise InputError(f"{path}: not a readable PNG file: {error}.") from error
    image = pixels / float(np.iinfo(pixels.dtype).max)
    image = image[..., None] if image.ndim == 2 else image
    colours, rest = (3, image[..., 3:]) if image.shape[2] > 2 else (1, image[..., 1:])
    _require_opaque(path, rest[..., 0] if rest.size else None)
    return np.broadcast_to(image[..., :colours], (*image.shape[:2], 3))


def _require_opaque(path: Path, alpha: np.ndarray | None) -> None:
    if alpha is None or (alpha >= 1 - 1 / 512).all():
        return
    count = int(np.count_nonzero(alpha < 1 - 1 / 512))
    raise InputError(
        f"{path}: {count} of {alpha.size} pixels have an alpha below 1, and their colours may or"
        " may not be premultiplied. Composite the picture over its background, without alpha."
    )


def _require_finite(image: np.ndarray, word: str) -> None:
    wrong = ~np.isfinite(image).all(axis=-1)
    if wrong.any():
        raise NonFiniteError(
            f"{word}: {_counted(wrong)} NaN or infinite. Repair the picture; such pixels are not"
            " skipped."
        )


def _require_light(image: np.ndarray, word: str) -> None:
    wrong = np.any(image < MOST_NEGATIVE, axis=-1)
    if wrong.any():
        raise InputError(
            f"{word}: {_counted(wrong)} negative. Colours outside BT.709 are negative, and so are"
            " overshoots of a sharpening filter: write linear BT.709 without either."
        )


def _counted(wrong: np.ndarray) -> str:
    y, x = np.unravel_index(np.argmax(wrong), wrong.shape)
    count = int(np.count_nonzero(wrong))
    return f"{count} of {wrong.size} pixels, the first at (x, y) = ({x}, {y}), are"
