"""Pictures of other renderers (EXR and PNG) in place of the heuristic half.

Values are linear, in units of display white, with the primaries of BT.709, like all images here. A
PNG does not state its transfer function, so the user must. What cannot be compared is rejected.
"""

from collections.abc import Mapping
from pathlib import Path
from time import perf_counter
from typing import Any

import mitsuba as mi
import numpy as np

from comparisons.departure.colour import from_srgb
from comparisons.options import Options
from heuristic.errors import InputError, NonFiniteError, suggestion, unknown
from reference.pairing.prepare import film_size
from reference.rendering.renderer import Renderer, Times
from reference.scene.source import Source

TRANSFERS = ("linear", "srgb")
SUFFIXES = (".exr", ".png")

BT709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
"""CIE x, y of red, green, blue and white."""

SAME_PRIMARIES = 2e-3
"""Largest difference of chromaticities that are the same: some files round them."""

MOST_NEGATIVE = -1e-3
"""Below this, a negative value is more than rounding."""


class PictureHalf:
    """Pictures (H, W, 3) as the passes of a heuristic half, one after another.

    Several are repeats, whose spread gives the noise; a single one serves for every pass. ``half``
    is the renderer that they replace.
    """

    def __init__(self, images: list[np.ndarray], half: Renderer) -> None:
        self.images, self.half = images, half
        self.variant = half.variant
        self.times: list[float] = []
        self.compilation = 0.0

    def render(self, seed: int) -> mi.TensorXf:
        """Return the next picture; the seed is ignored."""
        begin = perf_counter()
        image = mi.TensorXf(self.images[len(self.times) % len(self.images)])
        self.times.append(perf_counter() - begin)
        return image

    def pass_times(self) -> Times:
        """Return the times of reading the pictures."""
        return Times.of(self.times, 0.0)


def read_all(options: Options) -> list[np.ndarray]:
    """Return the pictures that options name: all of one size, and one or an even number."""
    images = [read(word, options.transfer) for word in options.image]
    sizes = {image.shape[:2] for image in images}
    if len(sizes) > 1:
        shown = ", ".join(f"{width}x{height}" for height, width in sorted(sizes))
        raise InputError(f"pictures of {shown}: give repeats of one size.")
    if len(images) > 1 and options.noise is not None:
        raise InputError(
            f"noise = {options.noise:g} and {len(images)} repeats: a noise target may need more"
            " passes than there are pictures. Give --spp instead of --noise."
        )
    if len(images) > 1 and len(images) % 2:
        raise InputError(
            f"{len(images)} repeats: give one, or an even number, whose halves give the noise."
        )
    return images


def at_size_of_pictures(source: Source, options: Options) -> Options:
    """Return options with the resolution of their pictures, which must be the film's in shape."""
    height, width = read_all(options)[0].shape[:2]
    own = film_size(source.parse(), options.sensor)
    film = options.resolution or own
    if options.resolution and film != (width, height):
        raise InputError(
            f"{options.image[0]}: it has {width}x{height} pixels, and --resolution"
            f" {film[0]}x{film[1]} is requested. Omit the option."
        )
    if abs(width * film[1] - height * film[0]) > max(film):  # more than a pixel
        raise InputError(
            f"{options.image[0]}: it has {width}x{height} pixels, an aspect ratio of"
            f" {width / height:.4g}, and the scene's film {film[0]}x{film[1]},"
            f" {film[0] / film[1]:.4g}. Render the picture with the scene's camera, or ignore the"
            f" film's size with --resolution {width}x{height}."
        )
    return options.changed(resolution=(width, height))


def read(word: str, transfer: str | None = None) -> np.ndarray:
    """Return a picture as linear RGB, (H, W, 3), float32.

    ``word`` is the path of a file, or ``FILE.exr:LAYER``. Without one of :data:`TRANSFERS`, an EXR
    is linear.
    """
    if transfer not in (None, *TRANSFERS):
        raise unknown("transfer", transfer, TRANSFERS)
    path, layer = _parts(word)
    if not path.is_file():
        raise InputError(f"{path}: there is no such file. Give a {' or '.join(SUFFIXES)} picture.")
    image = _exr(path, layer) if path.suffix.lower() == ".exr" else _png(path, transfer)
    wrong = ~np.isfinite(image).all(axis=-1)
    if wrong.any():
        raise NonFiniteError(
            f"{word}: {_counted(wrong)} NaN or infinite. Repair the picture; such pixels are not"
            " skipped."
        )
    if transfer == "srgb":
        image = from_srgb(image)
    wrong = np.any(image < MOST_NEGATIVE, axis=-1)
    if wrong.any():
        raise InputError(
            f"{word}: {_counted(wrong)} negative. Colours outside BT.709 are negative, and so are"
            " overshoots of a sharpening filter: write linear BT.709 without either."
        )
    return np.ascontiguousarray(image, np.float32)


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
    import OpenEXR  # only pictures need it

    try:
        with OpenEXR.File(str(path), separate_channels=True) as file:
            header = dict(file.header())
            channels = {name: np.array(c.pixels) for name, c in file.channels().items()}
    except Exception as error:  # the library raises many types for a file that is not EXR
        raise InputError(f"{path}: not a readable EXR file: {error}.") from error
    _require_plain(path, header)
    prefix = f"{layer}." if layer else ""
    if not {f"{prefix}{c}" for c in "RGB"} <= set(channels):
        raise _without_colours(path, layer, channels)
    _require_opaque(path, channels.get(f"{prefix}A"))
    return np.stack([channels[f"{prefix}{c}"].astype(float) for c in "RGB"], axis=-1)


def _without_colours(path: Path, layer: str, channels: Mapping[str, Any]) -> InputError:
    layers = sorted({name[:-2] for name in channels if name.endswith(".R")})
    if layer and {*"RGB"} <= set(channels):
        return InputError(f"{path}: it has R, G and B but no layer {layer!r}: give {path}.")
    if not layers:
        return InputError(
            f"{path}: its channels are {', '.join(sorted(channels))}. Give R, G and B."
        )
    where = f"no layer {layer!r}{suggestion(layer, layers)}" if layer else "no channel R"
    return InputError(
        f"{path}: it has {where}. Its layers are {', '.join(layers)}: give {path}:{layers[0]}."
    )


def _require_plain(path: Path, header: Mapping[str, Any]) -> None:
    """Require a whole picture in BT.709."""
    data, display = (np.array(header[name]).tolist() for name in ("dataWindow", "displayWindow"))
    if data != display:
        sizes = (
            f"{right - left + 1}x{bottom - top + 1} from ({left}, {top})"
            for (left, top), (right, bottom) in (data, display)
        )
        raise InputError(
            f"{path}: it is cropped: its data window is {next(sizes)}, its display window"
            f" {next(sizes)}. Save the whole picture."
        )
    primaries = header.get("chromaticities")
    if primaries is not None and max(abs(np.subtract(primaries, BT709))) > SAME_PRIMARIES:
        raise InputError(
            f"{path}: its primaries and white are ({', '.join(f'{v:.4g}' for v in primaries)})."
            f" Convert it to BT.709 (sRGB): {', '.join(map(str, BT709))}."
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


def _counted(wrong: np.ndarray) -> str:
    y, x = np.unravel_index(np.argmax(wrong), wrong.shape)
    count = int(np.count_nonzero(wrong))
    return f"{count} of {wrong.size} pixels, the first at (x, y) = ({x}, {y}), are"
