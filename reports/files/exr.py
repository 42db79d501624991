"""Writing the layers of a comparison as one OpenEXR file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from comparisons import atomic
from heuristic.errors import InputError

#: Layers that keep float32; the others are maps, for which half's 11 bits are enough.
FULL_PRECISION = frozenset({"heuristic", "reference", "reference_stderr", "P", "N"})

#: Layers with X, Y, Z instead of R, G, B.
VECTORS = frozenset({"P", "N"})

#: CIE x, y of red, green, blue and white of ITU-R BT.709.
BT709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)

#: The largest finite half.
HALF_MAX = 65_504.0


def write(path: str | Path, layers: Mapping[str, ArrayLike], header: Mapping[str, str]) -> None:
    """Write layers to a file atomically, as one scanline part, ZIP-compressed.

    Parameters
    ----------
    layers
        Name → image, all of one height and width. (H, W, 3) becomes ``name.R``, ``name.G``,
        ``name.B``, or ``.X``, ``.Y``, ``.Z`` for "P" and "N"; (H, W), also boolean, becomes
        ``name.Y``. Layers in `FULL_PRECISION`, and those with values beyond half's 65,504, are
        float32; the others are half.
    header
        Metadata as strings, e.g. seed, samples and versions. BT.709's chromaticities are added.
    """
    import OpenEXR

    path = Path(path)
    attributes = {
        **{name: str(value) for name, value in header.items()},
        "type": OpenEXR.scanlineimage,
        "compression": OpenEXR.ZIP_COMPRESSION,
        "chromaticities": BT709,
    }
    file = OpenEXR.File(attributes, channels(layers))
    # Given a path, the bindings do not report that its end could not be written.
    with file, atomic.replacing(path) as partial, partial.open("wb") as stream:
        file.write(stream)


def channels(layers: Mapping[str, ArrayLike]) -> dict[str, np.ndarray]:
    """The layers as OpenEXR channels: name with suffix → contiguous (H, W) half or float32."""
    result: dict[str, np.ndarray] = {}
    size = None
    for name, values in layers.items():
        image = np.asarray(values)
        suffixes = _suffixes(name, image)
        size = size or image.shape[:2]
        if image.shape[:2] != size:
            raise InputError(
                f"EXR layer {name} is {image.shape[:2]}, the first {size}: make all the same size."
            )
        precision = _precision(name, image)
        planes = image[..., None] if image.ndim == 2 else image
        for index, suffix in enumerate(suffixes):
            plane = np.ascontiguousarray(planes[..., index], precision)
            result[f"{name}.{suffix}"] = plane
    return result


def _suffixes(name: str, image: np.ndarray) -> str:
    if image.ndim == 2:
        return "Y"
    if image.ndim == 3 and image.shape[2] == 3:
        return "XYZ" if name in VECTORS else "RGB"
    raise InputError(f"EXR layer {name} has shape {image.shape}: make it (H, W) or (H, W, 3).")


def _precision(name: str, image: np.ndarray) -> type[np.floating]:
    if name in FULL_PRECISION or (image.size and np.abs(image).max() > HALF_MAX):
        return np.float32
    return np.float16
