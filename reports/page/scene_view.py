"""The page's data of one scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from msgspec import field

from comparisons.comparison import ComparisonRecord
from comparisons.cost.cost_record import Cost
from comparisons.records import Record
from reports.charts.vega import Figure
from reports.files.sheets import Sheet
from reports.page.embedding import Embedded
from reports.page.lit import Lit
from reports.page.terms_view import TermsView


class EffectMap(Record):
    """The dominating effect of each pixel: a letter per pixel, row after row."""

    width: int
    height: int
    names: tuple[str, ...]
    colours: tuple[str, ...]
    map: str


class CostView(Record):
    """A page's data of a study.

    ``images`` are PNG files by their bare names; ``sheet`` has the corners of the lattice,
    ``points`` the measured points and then the reference. ``between`` is the part of the
    reference's light that comes from between surfaces, from 0 to 1.
    """

    record: Cost
    images: dict[str, bytes]
    noise: str
    effects: EffectMap
    sheet: Sheet | None = None
    points: Sheet | None = None
    between: Embedded | None = None

    def picture(self, kind: str, name: str) -> bytes:
        """Return the picture of a rung, a part or an effect."""
        return self.images[picture_name(kind, name)]

    @property
    def switchboard(self) -> dict[str, Any]:
        """The data of the switchboard's script; empty without a sheet."""
        from reports.page import switchboard

        return switchboard.data(self.record, self.sheet) if self.sheet else {}

    @property
    def measured(self) -> dict[str, Any]:
        """The data of the script that shows the points' pictures; empty without them."""
        from reports.page.costs import point_pictures

        return point_pictures.data(self.record, self.points) if self.points else {}


class SceneView(Record):
    """A comparison as the page shows it.

    Attributes
    ----------
    record
        The content of ``comparison.json``.
    thumbnails
        Small named WebP files, of both halves and of the leading metric's map.
    embedded
        The images as numbers; without them the scene has only the thumbnails.
    files
        Labels and paths relative to the page, shown as links.
    charts, cost
        The study of cost, if there is one.
    is_coarse
        Whether it is a small preview, which the page replaces later.
    terms
        The terms of equation 8.10 at a grid of pixels.
    lit
        The shape and the material that each pixel sees.
    """

    record: ComparisonRecord
    thumbnails: dict[str, bytes] = field(default_factory=dict)
    embedded: Embedded | None = None
    files: dict[str, str] = field(default_factory=dict)
    charts: tuple[Figure, ...] = ()
    cost: CostView | None = None
    is_coarse: bool = False
    terms: TermsView | None = None
    lit: Lit | None = None


@dataclass(frozen=True)
class Making:
    """The number of refined scenes of an unfinished run."""

    done: int
    total: int
    is_interrupted: bool = False


def picture_name(kind: str, name: str) -> str:
    """Return the name of a picture's file without suffix, such as cost-part-transport."""
    return f"cost-{kind}-{_plain(name)}"


def _plain(name: str) -> str:
    return "".join(c if c.isalnum() else "-" for c in name.lower()).replace("--", "-")
