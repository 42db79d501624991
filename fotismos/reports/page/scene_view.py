"""The page's data of one scene, and the colours of effects."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from msgspec import field

from fotismos.comparisons.departure.criterion import TOLERANCE
from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.comparisons.records.comparison import ComparisonRecord
from fotismos.reference.planning.effects import EFFECTS
from fotismos.reference.records import Record
from fotismos.reports import verdict
from fotismos.reports.page.embedding import Embedded

EFFECT_COLOURS = {effect.label: effect.colour for effect in EFFECTS if effect.colour}
"""Colours of effects in attributions: Okabe and Ito's seven for those that often come together, and
four of Tol's muted scheme. Both suit the common colour deficiencies."""


def parts(record: ComparisonRecord) -> list[tuple[str, str, float]]:
    """Return what a scene's picture lacks: effects as nouns, with their colours and parts."""
    return [
        (verdict.noun(effect), EFFECT_COLOURS[effect], part)
        for effect, part in verdict.missing(record).items()
    ]


def title_of(record: ComparisonRecord) -> str:
    """Return what a built-in scene shows; empty for others."""
    return SCENES[record.scene].title if record.scene in SCENES else ""


EFFECTS_TITLE = "Effects"
"""Title of the map of dominant effects."""

NO_EFFECT = "#dee2e6"
"""Colour where no effect removes enough to be seen."""


@dataclass(frozen=True)
class Figure:
    """A chart for the page: its title, a sentence, and its picture."""

    title: str
    note: str
    svg: str


class WhyView(Record):
    """A page's data of causes, beside the record's.

    ``map`` has a letter for each pixel, row after row: that of ``names`` which dominates there.
    ``pictures`` has a plane of each channel of the record's hybrids, in their order, and of the
    error that each leaves, such as ``0.R`` and ``0.dE2000``; None for fewer than two hybrids.
    """

    width: int
    height: int
    names: tuple[str, ...]
    map: str
    pictures: Embedded | None = None


class PointsView(Record):
    """The page's data of points: their planes in a ``grid``, and what its script reads beside it.

    ``missing`` says why there are none.
    """

    grid: Embedded | None = None
    data: dict[str, Any] = field(default_factory=dict)
    missing: str = ""

    def manifest(self) -> dict[str, Any]:
        """The data of the page's script, except the grid's planes, as plain data."""
        grid = self.grid.manifest() if self.grid else None
        return self.data | {"grid": grid, "missing": self.missing}


class CostView(Record):
    """A page's data of a study.

    ``record`` is a :class:`fotismos.comparisons.records.cost.Cost`, or an ``EngineCost``
    without a scene, whose types few pages need to load. ``images`` are small WebP files by the
    methods' names, ``reference`` is one. Pixels of given pictures differ visibly above the ΔE2000
    ``within``.
    """

    record: Any
    images: dict[str, bytes]
    reference: bytes
    within: float = TOLERANCE


class Before(Record):
    """What moved in a scene or picture since its baseline, as the page of a check shows it.

    ``check`` is a :class:`fotismos.comparisons.records.check.CheckRecord`, which only checks load.
    ``pictures`` are WebP files by their captions: before, now, and the map of the change. A test
    has an ``approval`` in place of the check's command.
    """

    check: Any
    pictures: dict[str, bytes]
    approval: str = ""

    @property
    def command(self) -> str:
        """The command after which the change counts as intended."""
        return self.approval or str(self.check.update_command)


class SceneView(Record):
    """A comparison as the page shows it.

    ``thumbnails`` are small named WebP files of both halves, the leading metric's map and terms;
    without ``embedded`` images, the scene has only these. ``worst`` is column and row of the pixel
    with the largest error. ``files`` are labels, and paths relative to the page. ``terms`` are
    those of 8.10 at pixels, ``live`` the points that the page can shade again
    (:mod:`fotismos.reports.page.why_view`).
    """

    record: ComparisonRecord
    thumbnails: dict[str, bytes] = field(default_factory=dict)
    embedded: Embedded | None = None
    worst: tuple[int, int] = (0, 0)
    files: dict[str, str] = field(default_factory=dict)
    chart: Figure | None = None
    cost: CostView | None = None
    terms: PointsView | None = None
    live: PointsView | None = None
    why: WhyView | None = None

    @property
    def studied(self) -> tuple[ComparisonRecord, Any]:
        """The record, and that of its study of cost if there is one."""
        return self.record, self.cost.record if self.cost else None
