"""Reads pictures as people have them: linear RGB with the primaries of BT.709, display white is 1.

=====================  ==========================================================================
File                   Read as
=====================  ==========================================================================
``.exr``               linear; other primaries are converted, by the file's chromaticities; a data
                       window is put into its display window, black around it
``.png``               as its cICP, iCCP, sRGB, gAMA and cHRM chunks say, the first of them first,
                       else sRGB; 8 or 16 bits
``.jpg``, ``.jpeg``    as its ICC profile says, else sRGB
``.hdr``               linear; its header's exposures are undone, and its primaries converted
``.pfm``               linear
``.npy``               linear; an array (H, W, 3), (H, W, 4) with alpha, or (H, W)
=====================  ==========================================================================

PNG and JPEG are turned as their EXIF data say. ``transfer`` replaces what they say about colours,
and the encoding of other files. What a file did not say plainly is said in words. Where alpha is
below 1, the picture is put over the colour ``over``: in EXR colours are premultiplied, in other
files they are not. Without that colour, these pixels do not count.
"""

import hashlib
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from fotismos.comparisons import colour_spaces, picture_formats
from fotismos.comparisons.colour_spaces import ColourSpace, Curve
from fotismos.comparisons.departure.colour import CHROMATICITIES, Array, from_srgb
from fotismos.comparisons.names import ARRAYS, PICTURES, picture_parts
from fotismos.heuristic.convention import Floats
from fotismos.heuristic.errors import InputError, NonFiniteError, suggestion
from fotismos.reference.rendering.passes import LARGEST_VALUE

MOST_NEGATIVE = -1e-3
"""Below this, a negative value is more than rounding."""

OPAQUE = 1 - 1 / 512
"""The smallest alpha that is opaque: 8 bits round it."""

MOST_PIXELS = 2**27
"""Pixels of the largest window that a data window is put into."""

HALF_STEP = 2.0**-10
"""Largest distance of neighbouring half floats, relative to their value."""

COLOURS = {"black": (0.0, 0.0, 0.0), "white": (1.0, 1.0, 1.0)}
"""The names of colours that a picture can be put over."""

STATED: dict[str, Curve | None] = {"srgb": from_srgb, "linear": None}
"""Curves by the words of `transfer`."""


@dataclass(frozen=True)
class Layer:
    """What a file holds, as encoded in it: colours (H, W, 3), and alpha (H, W) if it has any.

    ``space`` decodes the colours. ``step`` is the distance of neighbouring codes, one or (H, W, C),
    0 if it is far below what can be seen. ``is_encoded``: they end at display white. ``notes`` say
    what was done to them.
    """

    colours: Floats
    alpha: Floats | None = None
    space: ColourSpace = field(default_factory=ColourSpace)
    step: Floats | float = 0.0
    is_encoded: bool = False
    is_premultiplied: bool = False
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class PictureFile:
    """A picture, linear (H, W, 3) in float32, and how it was read, in words.

    ``opaque`` (H, W) are the pixels without transparency, ``digest`` is the file's SHA-256. What
    ``is_encoded`` ends at display white, as in a PNG. ``rounding`` (3,) is how far the file's steps
    may move the mean of red, green and blue, if all its values are rounded to one side.
    """

    image: Floats
    opaque: NDArray[np.bool_]
    digest: str
    rounding: Array
    is_encoded: bool = False
    notes: tuple[str, ...] = ()

    @classmethod
    def of(cls, values: NDArray[Any]) -> "PictureFile":
        """Return a linear image (H, W, 3) that is in no file; its digest is of its values."""
        image = np.ascontiguousarray(values)
        return cls(
            image=image,
            opaque=np.ones(image.shape[:2], bool),
            digest=hashlib.sha256(image.tobytes()).hexdigest(),
            rounding=np.zeros(3),
        )


def read_file(
    word: str, transfer: str | None = None, over: str | None = None, is_mask: bool = False
) -> PictureFile:
    """Return a picture; ``word`` is the path of a file, or ``FILE.exr:LAYER``.

    Where alpha is below 1, the picture is put over the colour ``over``. Without one, those pixels
    do not count if alpha ``is_mask``, or else the picture is refused.
    """
    path, layer_name = picture_parts(word)
    if word in ARRAYS:
        layer = _of_values(path, np.asarray(ARRAYS[word]), is_light=transfer is None)
    elif not path.is_file():
        fault = "it is not a regular file" if path.exists() else "there is no such file"
        raise InputError(f"{path}: {fault}. Give a {' or '.join(PICTURES)} picture.")
    elif layer_name and path.suffix.lower() != ".exr":
        raise InputError(f"{word}: only EXR files have layers. Give {path}.")
    elif path.suffix.lower() == ".exr":
        layer = _exr(path, layer_name)
    elif path.suffix.lower() == ".npy":
        layer = _array(path, is_light=transfer is None)
    else:
        layer = _bitmap(path, path.suffix.lower(), is_stated=transfer is not None)
    # A NaN would pass the later tests: it is neither above nor below.
    wrong = ~np.isfinite(layer.colours)
    if layer.alpha is not None:
        wrong |= ~np.isfinite(layer.alpha)[..., None]
    if wrong.any():
        raise NonFiniteError(f"{word}: {_counted(wrong)} NaN or infinite. Repair the picture.")
    space = layer.space if transfer is None else replace(layer.space, curve=STATED[transfer])
    image = space.light(layer.colours)
    behind = None if over is None else colour_over(over)
    opaque = np.ones(image.shape[:2], bool)
    notes = [*layer.space.notes, *layer.notes]
    if layer.alpha is not None and behind is None and is_mask:
        opaque = layer.alpha >= OPAQUE
        if not opaque.all():
            notes.append(f"{np.count_nonzero(~opaque)} pixels with alpha below 1 do not count")
    else:
        image = _opaque(path, image, layer, behind)
    wrong = image > LARGEST_VALUE
    if wrong.any():
        raise InputError(
            f"{word}: {_counted(wrong)} above {LARGEST_VALUE:g}, which is too bright. Divide the"
            " picture and all lights by the same number."
        )
    wrong = image < MOST_NEGATIVE
    if wrong.any():
        raise InputError(
            f"{word}: {_counted(wrong)} negative. Colours outside BT.709 are, if the file does not"
            " say its primaries, and so are overshoots of a sharpening filter. Write the"
            " chromaticities, or clip the picture at 0."
        )
    image = np.where(np.abs(image) < 1 / LARGEST_VALUE, 0.0, image)
    if over is not None:
        notes.append(f"alpha over {over}")
    content = ARRAYS[word].tobytes() if word in ARRAYS else path.read_bytes()
    return PictureFile(
        image=np.ascontiguousarray(image, np.float32),
        opaque=opaque,
        digest=hashlib.sha256(content).hexdigest(),
        rounding=_rounding(layer, space),
        is_encoded=layer.is_encoded,
        notes=tuple(notes),
    )


def _rounding(layer: Layer, space: ColourSpace) -> Array:
    """Return the mean of half the step of light (3,) that a step of the codes makes."""
    half = np.asarray(layer.step) / 2
    if not half.any():
        return np.zeros(3)
    above = space.light(layer.colours + half)
    below = space.light(np.maximum(layer.colours - half, 0.0))
    rounding: Array = np.abs(above - below).mean(axis=(0, 1)) / 2
    return rounding


# --- Alpha -------------------------------------------------------------------------------------


def colour_over(text: str) -> Array:
    """Return the linear colour that a picture is put over: a name, or three numbers."""
    if text in COLOURS:
        return np.array(COLOURS[text])
    try:
        numbers = np.array([float(part) for part in text.split(",")])
    except ValueError:
        numbers = np.array([])
    if numbers.shape != (3,) or not (np.isfinite(numbers).all() and (numbers >= 0).all()):
        raise InputError(
            f"over = {text} is not allowed: give {', '.join(COLOURS)}, or three linear numbers,"
            " such as 0.5,0.5,0.5."
        )
    return numbers


def _opaque(path: Path, image: Floats, layer: Layer, behind: Array | None) -> Floats:
    """Return linear colours over the colour behind them; without alpha, unchanged."""
    alpha = layer.alpha
    if alpha is None or (alpha >= OPAQUE).all():
        return image
    if behind is None:
        count = int(np.count_nonzero(alpha < OPAQUE))
        raise InputError(
            f"{path}: {count} of {alpha.size} pixels have an alpha below 1. Give the colour behind"
            " them, `over=black`, or write the picture without alpha."
        )
    alpha = np.clip(alpha, 0, 1)[..., None]
    front = image if layer.is_premultiplied else image * alpha
    shown: Array = front + (1 - alpha) * behind
    return shown


# --- OpenEXR -----------------------------------------------------------------------------------

LOSSY = ("DWAA", "DWAB")
LOSSY_FOR_HALF = ("B44", "B44A")
"""Compressions of EXR that change values, and make them finite."""


def _exr(path: Path, name: str) -> Layer:
    header = exr_header(path)
    sampling = {c.name: (c.xSampling, c.ySampling) for c in header["channels"]}
    prefix = f"{name}." if name else ""
    names = [f"{prefix}{c}" for c in "RGB"]
    if not set(names) <= set(sampling):
        names = [f"{prefix}Y"]
        if {f"{prefix}RY", f"{prefix}BY"} & set(sampling):
            raise InputError(
                f"{path}: its colours are luminance and chroma, {prefix}Y, RY and BY. Save it as R,"
                " G and B."
            )
    if not set(names) <= set(sampling):
        raise _without_colours(path, name, sampling)
    for channel in (*names, f"{prefix}A"):
        x_step, y_step = sampling.get(channel, (1, 1))
        if (x_step, y_step) != (1, 1):
            raise InputError(
                f"{path}: its channel {channel} has one value for {x_step}x{y_step} pixels. Save it"
                " with a sampling of 1."
            )
    channels = exr_channels(path)
    is_half = any(channels[channel].dtype == np.float16 for channel in names)
    colours: Floats = np.stack([channels[channel].astype(np.float32) for channel in names], axis=-1)
    colours = np.broadcast_to(colours, (*colours.shape[:2], 3))
    alpha = channels.get(f"{prefix}A")
    notes = []
    compression = str(header["compression"]).rpartition(".")[2].removesuffix("_COMPRESSION")
    if compression in LOSSY or (is_half and compression in LOSSY_FOR_HALF):
        notes.append(
            f"its compression {compression} has losses: what was NaN or infinite may be an ordinary"
            " number"
        )
    data = np.array(header["dataWindow"]).tolist()
    display = np.array(header["displayWindow"]).tolist()
    if data != display:
        colours = _in_window(path, colours, data, display)
        if alpha is not None:
            alpha = _in_window(path, alpha[..., None], data, display)[..., 0]
        notes.append("its data window was put into its display window")
    return Layer(
        colours=colours,
        alpha=alpha,
        space=_known(path, lambda: colour_spaces.of_exr(header)),
        step=np.abs(colours) * HALF_STEP if is_half else 0.0,
        is_premultiplied=True,
        notes=tuple(notes),
    )


def exr_header(path: Path) -> dict[str, Any]:
    """Return the header of an EXR file of one part."""
    import OpenEXR  # loaded late: other pictures do not need it

    try:
        with _quiet(), OpenEXR.File(str(path), header_only=True) as file:
            parts = [part.name() for part in file.parts]
            header = dict(file.header())
    except Exception as error:  # the library raises many types for a file that is not EXR
        raise _unreadable(path, "EXR", error) from error
    if len(parts) > 1:
        raise InputError(
            f"{path}: it has {len(parts)} parts, {', '.join(map(repr, parts))}. Save the picture"
            " as a file of one part; several layers are allowed."
        )
    if "deep" in str(header.get("type")):
        raise InputError(f"{path}: it is deep, with several samples in a pixel. Flatten it.")
    return header


def exr_channels(path: Path) -> dict[str, NDArray[Any]]:
    """Return the channels (H, W) of an EXR file of one part."""
    import OpenEXR

    try:
        with _quiet(), OpenEXR.File(str(path), separate_channels=True) as file:
            if not file.parts:  # the library keeps none that it cannot read to its end
                raise ValueError("it ends too soon, or is damaged")
            return {name: np.array(channel.pixels) for name, channel in file.channels().items()}
    except Exception as error:
        raise _unreadable(path, "EXR", error) from error


def _known(path: Path, read: Callable[[], ColourSpace]) -> ColourSpace:
    """Return a colour space; InputError if it is not one that is read."""
    try:
        return read()
    except ValueError as fault:
        raise InputError(
            f"{path}: {fault}. Save it as linear BT.709 or sRGB; `transfer` reads a PNG or JPEG as"
            " if it named no colour space."
        ) from fault


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep a library's own messages from being printed: the error that is raised says it."""
    kept = {stream: os.dup(stream) for stream in (1, 2)}
    # It prints by C, and by Python's streams, which are others in a notebook.
    with open(os.devnull, "w") as nothing, redirect_stdout(nothing), redirect_stderr(nothing):
        try:
            for stream in kept:
                os.dup2(nothing.fileno(), stream)
            yield
        finally:
            for stream, copy in kept.items():
                os.dup2(copy, stream)
                os.close(copy)


def _without_colours(path: Path, layer: str, channels: Mapping[str, Any]) -> InputError:
    layers = sorted({name[:-2] for name in channels if name.endswith((".R", ".Y"))})
    if layer and {*"RGB"} <= set(channels):
        return InputError(f"{path}: it has R, G and B but no layer {layer!r}: give {path}.")
    if not layers:
        grey = " Z is depth, or grey as pyexr writes it: name it Y." if {*channels} == {"Z"} else ""
        return InputError(
            f"{path}: its channels are {', '.join(sorted(channels))}. Give R, G and B, or Y.{grey}"
        )
    where = f"no layer {layer!r}{suggestion(layer, layers)}" if layer else "no channel R"
    return InputError(
        f"{path}: it has {where}. Its layers are {', '.join(layers)}: give {path}:{layers[0]}."
    )


def _in_window(path: Path, values: Floats, data: Any, display: Any) -> Floats:
    """Return values of a data window (h, w, C) in the display window (H, W, C), 0 around them."""
    (left, top), (right, bottom) = display
    (data_left, data_top), _ = data
    width = right - left + 1
    height = bottom - top + 1
    if width * height > MOST_PIXELS:
        raise InputError(
            f"{path}: its display window has {width}x{height} pixels, and at most {MOST_PIXELS} are"
            " read. Save the picture again."
        )
    whole = np.zeros((height, width, values.shape[2]))
    # What lies outside the display window, such as overscan, is not seen.
    down = data_top - top
    right_by = data_left - left
    seen = values[max(-down, 0) :, max(-right_by, 0) :]
    shown = whole[max(down, 0) :, max(right_by, 0) :]
    shown = shown[: seen.shape[0], : seen.shape[1]]
    if not shown.size:
        raise InputError(
            f"{path}: its data window lies outside its display window, so nothing of it is seen."
            " Save the picture again."
        )
    shown[...] = seen[: shown.shape[0], : shown.shape[1]]
    return whole


# --- Other files -------------------------------------------------------------------------------


BEGINNINGS = {".hdr": (b"#?",), ".pfm": (b"PF", b"Pf")}
"""What files begin with; a PNG or JPEG is told by its content."""

HDR_BITS = 8
"""Bits of a mantissa."""

PNG_HEADER = 26
"""Bytes that a PNG file begins with; the last two are its bit depth and its kind of colours."""

GREY = 0
PALETTE = 3
"""Kinds of a PNG's colours."""

MODES = ("L", "LA", "RGB", "RGBA", "I;16")
"""What Pillow calls the pixels that are read as they are."""


def _bitmap(path: Path, suffix: str, is_stated: bool) -> Layer:
    """Read a file by Pillow, or by :mod:`fotismos.comparisons.picture_formats`.

    If its encoding ``is_stated``, what it says about its colours does not count.
    """
    kind = (suffix or path.name).removeprefix(".").upper()
    with path.open("rb") as stream:
        header = stream.read(PNG_HEADER)
    if not header.startswith(BEGINNINGS.get(suffix, (b"",))):
        raise _unreadable(path, kind, ValueError("it does not begin as one"))
    space = ColourSpace()
    notes: tuple[str, ...] = ()
    try:
        if suffix == ".pfm":
            return _layer(path, picture_formats.pfm(path).astype(float))
        if suffix == ".hdr":
            return _radiance(path, picture_formats.hdr(path))
        with Image.open(path) as file:
            is_png = file.format == "PNG"
            bits, of_colours = header[PNG_HEADER - 2 :] if is_png else (8, GREY)
            if bits == 16 and of_colours != GREY:
                pixels = picture_formats.deep_png(path)
            elif is_png and of_colours == GREY and "transparency" in file.info:
                pixels = picture_formats.grey_png(file, bits)
            else:
                pixels = _by_pillow(path, file)
            if not is_stated:
                cicp = picture_formats.png_chunk(path, b"cICP") if is_png else None
                space = _known(path, lambda: colour_spaces.of_bitmap(file, kind, cicp))
            turn = colour_spaces.turn(file)
    except (OSError, RuntimeError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise _unreadable(path, kind, error) from error
    pixels = pixels[..., None] if pixels.ndim == 2 else pixels
    if turn is not None:
        pixels = turn(pixels)
        notes = ("turned as its EXIF data say",)
    return replace(
        _layer(path, pixels / float(np.iinfo(pixels.dtype).max)),
        space=space,
        step=1.0 / (2 ** (8 if of_colours == PALETTE else bits) - 1),
        is_encoded=space.ends_at_white,
        notes=notes,
    )


def _radiance(path: Path, picture: picture_formats.RadiancePicture) -> Layer:
    """Return a Radiance picture as the light that it had before its exposures."""
    values = picture.values.astype(float)
    factor = picture.exposure * picture.correction
    _, exponents = np.frexp(values.max(axis=-1, keepdims=True, initial=0.0))
    notes = ["read half a step above its codes, as Radiance does"]
    if picture.exposure != 1:
        notes.append(f"divided by its EXPOSURE, {picture.exposure:g}")
    if (picture.correction != 1).any():
        shown = " ".join(f"{number:g}" for number in picture.correction)
        notes.append(f"divided by its COLORCORR, {shown}")
    primaries = picture.primaries
    return replace(
        _layer(path, values / factor),
        space=_known(path, lambda: colour_spaces.of_primaries(primaries or CHROMATICITIES)),
        step=np.ldexp(1.0, exponents - HDR_BITS) / factor,
        notes=tuple(notes),
    )


def _by_pillow(path: Path, file: Image.Image) -> NDArray[Any]:
    if file.has_transparency_data and file.mode not in MODES[1::2]:
        return np.array(file.convert("RGBA"))
    if file.mode in ("1", "P"):
        return np.array(file.convert("L" if file.mode == "1" else "RGB"))
    if file.mode not in MODES:
        raise InputError(f"{path}: its colours are {file.mode}. Save it as RGB.")
    return np.array(file)


def _array(path: Path, is_light: bool) -> Layer:
    try:
        with path.open("rb") as stream:
            values = np.lib.format.read_array(stream, allow_pickle=False)
    except (ValueError, OSError, EOFError, MemoryError) as error:
        raise _unreadable(path, "NPY", error) from error
    return _of_values(path, values, is_light)


def require_linear(values: NDArray[Any], name: str) -> None:
    """Reject whole numbers, which are codes of a display and not linear light."""
    if values.dtype.kind in "iu":
        raise InputError(
            f"{name}: an array of {values.dtype} is not linear light. Give floats, of which 1 is"
            " white: divide by the largest code, and decode sRGB. Or give the file itself."
        )


def _of_values(path: Path, values: NDArray[Any], is_light: bool) -> Layer:
    """Return an array as a layer; InputError if its shape or type is not a picture's.

    If it ``is_light``, it must not have whole numbers.
    """
    if is_light:
        require_linear(values, str(path))
    values = values[..., None] if values.ndim == 2 else values
    if values.ndim != 3 or values.shape[2] not in (1, 3, 4) or values.dtype.kind not in "fiu":
        raise InputError(
            f"{path}: an array of shape {values.shape} and type {values.dtype} is not a picture:"
            " give numbers (H, W, 3), (H, W, 4) or (H, W)."
        )
    return _layer(path, values.astype(float))


def _layer(path: Path, values: Array) -> Layer:
    """Return channels (H, W, C), grey or RGB, each with or without alpha, as colours and alpha."""
    if not values.size:
        raise InputError(f"{path}: it has no pixels. Save the picture again.")
    count = 3 if values.shape[2] > 2 else 1
    rest = values[..., count:]
    colours = np.broadcast_to(values[..., :count], (*values.shape[:2], 3))
    return Layer(colours=colours, alpha=rest[..., 0] if rest.shape[2] else None)


def _unreadable(path: Path, kind: str, error: Exception) -> InputError:
    fault = str(error).rstrip(". ")
    return InputError(f"{path}: not a readable {kind} file: {fault}. Save the picture again.")


def _counted(channels: NDArray[np.bool_]) -> str:
    """Return how many pixels are wrong in any channel (H, W, C), and which is the first."""
    wrong = channels.any(axis=-1)
    y, x = np.unravel_index(np.argmax(wrong), wrong.shape)
    count = int(np.count_nonzero(wrong))
    return f"{count} of {wrong.size} pixels, the first at (x, y) = ({x}, {y}), are"
