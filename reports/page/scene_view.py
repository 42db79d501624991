"""The page's data of one scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from msgspec import field

from comparisons.comparison import ComparisonRecord
from comparisons.cost.cost_record import Cost
from reference.records import Record
from reports.charts.vega import Figure
from reports.files import images
from reports.files.images import Sheet
from reports.page.embedding import Embedded
from reports.page.terms_view import TermsView
from reports.terminal.words import number, seconds

LEAST = 0.01
"""ΔE2000: smaller means are rounding or remaining noise."""


class EffectMap(Record):
    """The dominating effect of each pixel: a letter per pixel, row after row."""

    width: int
    height: int
    names: tuple[str, ...]
    colours: tuple[str, ...]
    map: str


class CostView(Record):
    """A page's data of a study.

    ``images`` are PNG files by their bare names; ``sheet`` has the hybrids.
    """

    record: Cost
    images: dict[str, bytes]
    noise: str
    effects: EffectMap
    sheet: Sheet | None = None

    def picture(self, kind: str, name: str) -> bytes:
        """Return the picture of a method, a part or an effect."""
        return self.images[picture_name(kind, name)]

    @property
    def switchboard(self) -> dict[str, Any]:
        """The switchboard's data: previews of combinations of effects; empty without a sheet."""
        if not self.sheet:
            return {}
        effects = [one.effect for one in self.record.attribution.effects]
        return images.placed(self.sheet) | {
            "hybrids": [
                {
                    "on": [effects.index(effect) for effect in hybrid.effects],
                    "error": number(hybrid.error) if hybrid.error >= LEAST else f"< {LEAST}",
                    "time": seconds(max(hybrid.seconds, 0.0)),
                }
                for hybrid in self.record.attribution.hybrids
            ],
        }


class Before(Record):
    """What moved in a scene since its baseline.

    ``moved`` has a name, before, now, standard errors and p. ``pictures`` are PNG files: the halves
    as they were, and ΔE2000 between then and now.
    """

    sentences: tuple[str, ...]
    moved: tuple[tuple[str, ...], ...]
    tested: int
    pictures: dict[str, bytes]
    command: str


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
    terms
        The terms of equation 8.10 at a grid of pixels.
    before
        What moved since a baseline, on the page of a check.
    """

    record: ComparisonRecord
    thumbnails: dict[str, bytes] = field(default_factory=dict)
    embedded: Embedded | None = None
    files: dict[str, str] = field(default_factory=dict)
    charts: tuple[Figure, ...] = ()
    cost: CostView | None = None
    terms: TermsView | None = None
    before: Before | None = None


@dataclass(frozen=True)
class Making:
    """The number of finished scenes of an unfinished run."""

    done: int
    total: int
    is_interrupted: bool = False


def picture_name(kind: str, name: str) -> str:
    """Return the name of a picture's file without suffix, such as cost-part-transport."""
    return f"cost-{kind}-{_plain(name)}"


def _plain(name: str) -> str:
    return "".join(c if c.isalnum() else "-" for c in name.lower()).replace("--", "-")
