"""The report's section on hard cases: its groups, and its pictures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from PIL import Image

from reports.files import images


@dataclass(frozen=True)
class Group:
    """Cases under one heading, with a note on their two errors.

    Without a note they are errors of the formula as printed and of the kernel.
    """

    title: str
    note: str = ""


#: Groups of cases in the order of the page.
GROUPS = {
    "exponents": Group("Exponents"),
    "geometry": Group("Geometry"),
    "lights": Group("Lights"),
    "shading": Group("Shading"),
    "reference": Group(
        "The reference",
        "If Mitsuba’s own formula breaks as printed, “ours” is Mitsuba’s value. If Mitsuba is at"
        " fault, the error is the part attributed to the heuristic: naively over all pixels, ours"
        " without those counted as limits of the reference.",
    ),
    "colour": Group(
        "Colour",
        "“Ours” are the metrics of this report, in double precision like the naive forms.",
    ),
}


def grey(image: ArrayLike) -> bytes:
    """The PNG of an image (H, W) of values from 0 to 1, enlarged pixel by pixel."""
    planes = np.repeat(np.nan_to_num(np.asarray(image, np.float32))[..., None], 3, axis=2)
    return images.png(images.tonemap(planes).resize((320, 320), Image.Resampling.NEAREST))
