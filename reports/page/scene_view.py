"""What the page shows of one scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import field

from comparisons.comparison import ComparisonRecord
from comparisons.records import Record
from reports.charts.vega import Figure
from reports.page.embedding import Embedded

if TYPE_CHECKING:  # few scenes have a study of cost
    from reports.run.cost_files import CostView


class SceneView(Record):
    """A comparison as the page shows it.

    record
        The content of ``comparison.json``.
    images
        PNG bytes by name, as `reports.files.images.pictures` makes them. A missing one is left out.
    thumbnails
        Small PNG bytes by name, of both halves and of the map by which scenes are judged.
    embedded
        The images as numbers, without which the scene has no viewer.
    files
        Paths relative to the page by label, shown as links.
    charts, cost
        Of what accuracy costs, where that was studied.
    """

    record: ComparisonRecord
    images: dict[str, bytes] = field(default_factory=dict)
    thumbnails: dict[str, bytes] = field(default_factory=dict)
    embedded: Embedded | None = None
    files: dict[str, str] = field(default_factory=dict)
    charts: tuple[Figure, ...] = ()
    cost: CostView | None = None
