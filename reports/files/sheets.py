"""Small pictures for the page: WebP files, and sheets of several of one size."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from functools import lru_cache
from io import BytesIO
from typing import Any

from PIL import Image

from comparisons.records import Record

#: Quality of the WebP file, from 0 to 100.
QUALITY = 80

#: Previews in a row of the picture.
COLUMNS = 4


class Sheet(Record):
    """Previews of `width` by `height` pixels in rows of `COLUMNS`, as one WebP file."""

    width: int
    height: int
    webp: bytes


def sheet(previews: Sequence[Image.Image]) -> Sheet | None:
    """Return the sheet of previews of one size, in order; None for fewer than two."""
    if len(previews) < 2:
        return None
    width, height = previews[0].size
    rows = -(-len(previews) // COLUMNS)
    whole = Image.new("RGB", (width * COLUMNS, height * rows))
    for place, preview in enumerate(previews):
        row, column = divmod(place, COLUMNS)
        whole.paste(preview, (column * width, row * height))
    return Sheet(width, height, webp(whole))


def webp(picture: Image.Image) -> bytes:
    """Return the WebP file of a picture."""
    buffer = BytesIO()
    picture.save(buffer, "WEBP", quality=QUALITY, method=4)
    return buffer.getvalue()


@lru_cache(maxsize=4096)
def webp_of(png: bytes) -> bytes:
    """Return a small PNG picture as WebP, kept for the next time that the page is written."""
    return webp(Image.open(BytesIO(png)).convert("RGB"))


def webp_uri(file: bytes) -> str:
    """Return a WebP file as an address that holds it."""
    return "data:image/webp;base64," + base64.b64encode(file).decode("ascii")


def placed(shown: Sheet) -> dict[str, Any]:
    """Return the sheet, and where its pictures are, for the page's scripts."""
    return {
        "sheet": webp_uri(shown.webp),
        "width": shown.width,
        "height": shown.height,
        "columns": COLUMNS,
    }
