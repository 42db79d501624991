"""The report's section on hard cases, out of the record that `hard.collection` makes."""

from __future__ import annotations

import base64
import math
from typing import Any

import numpy as np
from PIL import Image

from comparisons.hard.collection import HardCases
from comparisons.hard.furnace import ANGLES
from reports.files import images

#: Groups of cases in the order of the page.
GROUPS = {
    "exponents": "Exponents",
    "geometry": "Geometry",
    "lights": "Lights",
    "shading": "Shading",
    "reference": "The reference",
    "colour": "Colour",
}


#: What a group's two errors are of, where it is not the formula as printed and the kernel.
NOTES = {
    "reference": (
        "Where Mitsuba’s own formula breaks as printed, “ours” is Mitsuba’s value. Where Mitsuba is"
        " at fault, the error is what would be booked on the heuristic: naively of every pixel,"
        " ours without those that are counted as limits of the reference."
    ),
    "colour": "“Ours” are the metrics of this report, in double precision like the naive forms.",
}


def view(record: HardCases) -> dict[str, Any]:
    """What the template ``hard_cases.html.j2`` shows.

    groups
        Each with its ``title``, ``note`` and ``rows``: case, hard, naive, ours, bound and holds. An
        error that is infinite stands as None, and is printed as the NaN or infinity that it is.
    conventions
        What is laid down: case, text and holds.
    pictures
        Each with its ``title`` and the two images as data URIs.
    furnaces, angles
        The models' albedo under light from each angle, and their asymmetry.
    """
    return {
        "groups": [
            {
                "title": title,
                "note": NOTES.get(group),
                "rows": [_row(o) for o in record.outcomes if o.case.group == group],
            }
            for group, title in GROUPS.items()
        ],
        "conventions": [
            {"case": convention.name, "text": convention.text, "holds": holds}
            for convention, holds in record.conventions
        ],
        "pictures": [
            {"title": picture.title, "naive": _uri(picture.naive), "ours": _uri(picture.ours)}
            for picture in record.pictures
        ],
        "furnaces": record.furnaces,
        "angles": ANGLES,
    }


def _row(outcome):
    return {
        "case": outcome.case.name,
        "hard": outcome.case.hard,
        "naive": _finite(outcome.naive_error),
        "ours": _finite(outcome.our_error),
        "bound": outcome.case.bound,
        "holds": outcome.holds,
    }


def _finite(value):
    return value if math.isfinite(value) else None


def _uri(image):
    grey = np.repeat(np.nan_to_num(np.float32(image))[..., None], 3, axis=2)
    picture = images.tonemap(grey).resize((320, 320), Image.Resampling.NEAREST)
    return "data:image/png;base64," + base64.b64encode(images.png(picture)).decode("ascii")
