"""The page's data of one scene, and the colours of effects."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from msgspec import field

from fotismos.comparisons.records.comparison import ComparisonRecord
from fotismos.reference.planning.effects import EFFECTS
from fotismos.reference.records import Record, plain
from fotismos.reports.page.embedding import Embedded

EFFECT_COLOURS = {effect.label: effect.colour for effect in EFFECTS if effect.colour}
"""Colours of effects in attributions: Okabe and Ito's seven for those that often come together, and
four of Tol's muted scheme. Both suit the common colour deficiencies."""

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


class EffectMap(Record):
    """The dominating effect of each pixel: a letter per pixel, row after row."""

    width: int
    height: int
    names: tuple[str, ...]
    colours: tuple[str, ...]
    map: str


class WhyView(Record):
    """A page's data of causes.

    ``pictures`` has a plane of each channel of the record's hybrids, in their order, and of the
    error that each leaves, such as ``0.R`` and ``0.dE2000``; None for fewer than two hybrids.
    """

    effects: EffectMap
    pictures: Embedded | None = None


class TermsView(Record):
    """The page's data of the terms of a scene.

    ``grid`` has planes over the grid of pixels in ``columns`` and ``rows``, and ``tops`` those of
    its values ≥ 0; lights have a name, ``L_d`` and ``L_s``. ``missing`` says why there are none.
    """

    grid: Embedded | None = None
    columns: list[int] = field(default_factory=list)
    rows: list[int] = field(default_factory=list)
    tops: dict[str, float] = field(default_factory=dict)
    materials: tuple[dict[str, Any], ...] = ()
    lights: tuple[dict[str, Any], ...] = ()
    missing: str = ""

    def manifest(self) -> dict[str, Any]:
        """The data of the page's script, except the grid's planes, as plain data."""
        shown: dict[str, Any] = plain(self)
        return shown | {"grid": self.grid.manifest() if self.grid else None}


class LiveView(TermsView):
    """The page's data of the points that it can shade again; ``missing`` says why there are none.

    ``grid`` has planes as differences to the row above, and ``tops`` their largest sizes; ``rays``
    are those of :class:`fotismos.comparisons.records.images.LivePoints`. ``fit`` is the mean ΔE2000
    that a fit of the scene reached, with its width and height.
    """

    rays: list[Any] = field(default_factory=list)
    is_flat: bool = False
    fit: tuple[float, int, int] | None = None


class EngineView(Record):
    """A page's sentences on an engine's settings, and their shares above the usual threshold.

    ``judgements`` are one for each, ``stated`` says what their times are of, and ``odd`` what is
    odd about the pictures. ``shares`` are those of the pixels above the ΔE2000 ``within``.
    """

    judgements: tuple[str, ...]
    stated: str
    odd: tuple[str, ...]
    within: float
    shares: tuple[Any, ...]


class CostView(Record):
    """A page's data of a study.

    ``record`` is a :class:`fotismos.comparisons.records.cost.Cost`, whose type few pages need
    to load. ``images`` are small WebP files by the methods' names; ``said`` and ``busy`` are
    sentences on its sums and on the machine, ``answer`` one on the cheapest method that looks
    right; ``colours`` are those of the effects; ``left_out`` are sentences on methods. ``engine``
    is None without given pictures; ``reference`` is a small WebP file. Without a scene, ``judged``
    says by which reference, and ``record`` is an ``EngineCost``.
    """

    record: Any
    images: dict[str, bytes]
    answer: str
    said: str = ""
    busy: str = ""
    colours: tuple[str, ...] = ()
    engine: EngineView | None = None
    left_out: tuple[str, ...] = ()
    reference: bytes | None = None
    judged: str = ""


class Before(Record):
    """What moved in a scene or picture since its baseline.

    ``headline`` says what moved most; ``moved`` has a name, before, now, standard errors and p.
    ``pictures`` are WebP files by their captions: how it was, and maps of the change.
    """

    name: str
    headline: str
    sentences: tuple[str, ...]
    moved: tuple[tuple[str, ...], ...]
    tested: int
    pictures: dict[str, bytes]
    command: str


class SceneView(Record):
    """A comparison as the page shows it.

    ``thumbnails`` are small named WebP files of both halves, the leading metric's map and terms;
    without ``embedded`` images, the scene has only these. ``worst`` is column and row of the pixel
    with the largest error. ``files`` are labels, and paths relative to the page. ``before`` is what
    moved since a baseline, on the page of a check.
    """

    record: ComparisonRecord
    thumbnails: dict[str, bytes] = field(default_factory=dict)
    embedded: Embedded | None = None
    worst: tuple[int, int] = (0, 0)
    files: dict[str, str] = field(default_factory=dict)
    chart: Figure | None = None
    cost: CostView | None = None
    terms: TermsView | None = None
    live: LiveView | None = None
    before: Before | None = None
    why: WhyView | None = None

    @property
    def studied(self) -> tuple[ComparisonRecord, Any]:
        """The record, and that of its study of cost if there is one."""
        return self.record, self.cost.record if self.cost else None
