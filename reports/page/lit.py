"""Highlighting in the page: small maps of the shape and the material that each pixel sees."""

from __future__ import annotations

import base64
import zlib
from typing import Any

import numpy as np
from msgspec import structs
from numpy.typing import NDArray
from PIL import Image

from comparisons.record import Images
from comparisons.records import Record, plain
from reports.files.images import THUMBNAIL, tonemap
from reports.files.sheets import webp, webp_uri

#: The place of pixels without a shape.
NOTHING = 255


class Lit(Record):
    """A small picture of the reference, and two maps of it.

    picture
        A WebP file of `width` by `height` pixels.
    maps
        A byte per pixel, the place of its shape in the record; then the same for materials.
        Deflated (RFC 1950), in base64.
    """

    width: int
    height: int
    picture: bytes
    maps: str

    def data(self) -> dict[str, Any]:
        """Return the data of the page's script."""
        return plain(structs.replace(self, picture=b"")) | {"picture": webp_uri(self.picture)}


def lit(shown: Images, exposure: float = 1.0) -> Lit:
    """Return the maps of a comparison."""
    picture = tonemap(shown.reference, exposure)
    picture.thumbnail((THUMBNAIL, THUMBNAIL), Image.Resampling.BOX)
    maps = [_reduced(each, picture.size) for each in (shown.objects, shown.materials)]
    data = zlib.compress(b"".join(each.astype(np.uint8).tobytes() for each in maps), 9)
    return Lit(*picture.size, webp(picture), base64.b64encode(data).decode("ascii"))


def _reduced(places: NDArray, size: tuple[int, int]) -> NDArray:
    """Return the place in the middle of each pixel of a smaller picture; -1 is `NOTHING`."""
    height, width = places.shape
    rows = (np.arange(size[1]) * 2 + 1) * height // (2 * size[1])
    columns = (np.arange(size[0]) * 2 + 1) * width // (2 * size[0])
    return places[np.ix_(rows, columns)] & NOTHING
