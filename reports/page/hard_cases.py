"""The report's section on hard cases, out of the record that `hard.collection` makes."""

from __future__ import annotations

import base64
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from PIL import Image

from comparisons.hard.cases import Convention, HardCase, Outcome
from comparisons.hard.collection import HardCases
from comparisons.hard.furnace import ANGLES, Furnace
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


@dataclass(frozen=True)
class Row:
    """A case; an error that is not finite is None."""

    case: HardCase
    naive: float | None
    ours: float | None
    holds: bool


@dataclass(frozen=True)
class Group:
    """Cases under one heading, and what their errors are of."""

    title: str
    note: str | None
    rows: tuple[Row, ...]


@dataclass(frozen=True)
class Pair:
    """One thing seen by the naive formula and by ours, as data URIs."""

    title: str
    naive: str
    ours: str


@dataclass(frozen=True)
class HardCasesView:
    """What the template ``hard_cases.html.j2`` shows.

    ``conventions`` are pairs of what is laid down and whether it holds; ``furnaces`` the models'
    albedo under light from each of ``angles``, and their asymmetry.
    """

    groups: tuple[Group, ...]
    conventions: tuple[tuple[Convention, bool], ...]
    pictures: tuple[Pair, ...]
    furnaces: tuple[Furnace, ...]
    angles: tuple[float, ...] = ANGLES


def view(record: HardCases) -> HardCasesView:
    """Group the cases, and make the pictures part of the page."""
    groups = (
        Group(title, NOTES.get(name), tuple(map(_row, record.of_group(name))))
        for name, title in GROUPS.items()
    )
    return HardCasesView(
        groups=tuple(groups),
        conventions=record.conventions,
        pictures=tuple(Pair(p.title, _uri(p.naive), _uri(p.ours)) for p in record.pictures),
        furnaces=record.furnaces,
    )


def _row(outcome: Outcome) -> Row:
    naive, ours = (
        error if math.isfinite(error) else None
        for error in (outcome.naive_error, outcome.our_error)
    )
    return Row(outcome.case, naive, ours, outcome.holds)


def _uri(image: ArrayLike) -> str:
    grey = np.repeat(np.nan_to_num(np.float32(image))[..., None], 3, axis=2)
    picture = images.tonemap(grey).resize((320, 320), Image.Resampling.NEAREST)
    return "data:image/png;base64," + base64.b64encode(images.png(picture)).decode("ascii")
