"""The report: an offline page of a run's pictures, maps and numbers, and one of details beside it.

`render` and `details` only print the numbers of records and of images that are encoded already.
Names and messages come from users' files, so everything is escaped, and a page may load nothing: a
content security policy allows only its own scripts, by their hashes.

Without JavaScript the page has small pictures, numbers and charts, one scene after another. With
it, ``templates/viewer`` shows one scene at a time from its embedded numbers, and the others wait as
text.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict
from datetime import date
from functools import partial
from time import time
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import structs

from fotismos.comparisons.departure.colour import BT709, rgb_to_xyz
from fotismos.comparisons.departure.criterion import LIMIT, TOLERANCE
from fotismos.comparisons.departure.metrics import (
    LEADING,
    LOG2_EPSILON,
    METRICS,
    RATIO,
    THRESHOLDS,
    declared,
)
from fotismos.reference.records import Machine
from fotismos.reports import glossary, tables, verdict
from fotismos.reports.files import images
from fotismos.reports.files.results import DETAILS, Failure, RunRecord
from fotismos.reports.page.scene_view import (
    EFFECT_COLOURS,
    EFFECTS_TITLE,
    NO_EFFECT,
    SceneView,
    WhyView,
    parts,
)
from fotismos.reports.page.templating import HELP, environment, identifier, rendered
from fotismos.reports.terminal.words import difference

if TYPE_CHECKING:  # few pages need these
    from fotismos.comparisons.hard_cases import HardCases
    from fotismos.comparisons.records.comparison import Attribution, ComparisonRecord

TITLE = "Textbook shading against physically based rendering"
PICTURES_TITLE = "A picture against a reference"

SCRIPTS = (
    *HELP, "address", "overview", "images", "viewport", "drawing", "switches", "panels", "viewer",
    "pointer", "keyboard", "terms", "shading", "numbers", "live", "main",
)  # fmt: skip

WORST = 3
"""Scenes whose pictures begin the overview."""

LOOK = 16
APART = 12
"""Two scenes look nearly alike if their pictures, in grey at so many pixels, are less apart: the
mean difference of their levels, of 255."""

CHARTED = 6
"""Most charts of error against time on the overview."""

Runs = list[tuple[int, str]]
"""Texts by the place of the threshold from which each holds."""


NEIGHBOURS = "<!-- the scenes beside it -->"
"""Where a scene's section gets links to the scenes beside it, which its page knows."""


class PageScene(SceneView):
    """A scene as it is drawn once for the pages of a run.

    ``id`` is its name in the address, ``script`` what the page's script has of it, and ``section``
    its part of the page.
    """

    id: str
    script: dict[str, Any]
    section: str = ""


def render(
    views: Sequence[SceneView],
    failures: Sequence[Failure] = (),
    state: str = "",
    threshold: float = TOLERANCE,
    reloads: bool = False,
) -> str:
    """One HTML page of all scenes, worst first, that begins at a threshold.

    Views that :func:`drawn_scene` drew before are taken as they are: only new ones are work.
    `failures` are the scenes that could not be compared; `state` is a sentence on an unfinished
    run. The page ``reloads`` itself until one that does not takes its place, or until none was
    written for a while.
    """
    taken = {view.id for view in views if isinstance(view, PageScene)}
    usual = THRESHOLDS.index(threshold)
    records = [view.record for view in views]
    scenes = [
        view if isinstance(view, PageScene) else drawn_scene(view, taken, threshold)
        for view in views
    ]
    scenes.sort(key=lambda scene: tables.extent(scene.record, threshold), reverse=True)
    failed = {identifier(failure.scene, taken): failure for failure in failures}
    data = {
        "scenes": [
            *(scene.script for scene in scenes),
            *({"id": id, "name": failure.scene, "failed": True} for id, failure in failed.items()),
        ],
        "written": round(1000 * time()) if reloads else None,
        "thresholds": THRESHOLDS,
        "usual": threshold,
        "headlines": _runs(lambda t: verdict.headline(records, t)),
        "missing": _runs(lambda t: verdict.most_missing(records, t)),
        "costs": _runs(lambda t: verdict.costs(records, t)),
        "terms": glossary.meanings(),
        "axis": _axis(scenes),
        **_drawing(),
    }
    return rendered(
        "page.html.j2",
        SCRIPTS,
        title=title_of(records),
        data=data,
        scenes=scenes,
        columns=tables.scenes(records, threshold).columns,
        neighbours=NEIGHBOURS,
        worst=_worst(scenes),
        legend=dict(sorted({part[:2] for view in views for part in parts(view.record)})),
        settings=_size(records) if records else "",
        failures=failed,
        usual=usual,
        priced=scenes if len(scenes) > 1 else [],
        charted=[scene for scene in scenes if scene.chart][:CHARTED],
        limit=LIMIT,
        leading=LEADING,
        details=DETAILS,
        state=state,
    )


def title_of(records: Sequence[ComparisonRecord]) -> str:
    """Return the title of a page of comparisons."""
    are_pictures = bool(records) and all(record.pairing is None for record in records)
    return PICTURES_TITLE if are_pictures else TITLE


def details(
    hard_cases: HardCases | None = None,
    run: RunRecord | None = None,
    records: Sequence[ComparisonRecord] = (),
) -> str:
    """The page beside that of so many scenes: how to read it, and what was checked.

    Parts that are not given are left out; `run` says where the time went, and `records` how far
    colour differences are from colour-science's.
    """
    return rendered(
        "details.html.j2",
        HELP,
        title="Details",
        settings=_settings(records) if records else "",
        data={"terms": glossary.meanings()},
        metrics=METRICS,
        glossary=glossary.GROUPS,
        hard_cases=hard_cases,
        run=run,
        compared=[record for record in records if record.colour_science],
    )


def _worst(scenes: Sequence[PageScene]) -> list[PageScene]:
    """Return the scenes of largest mean error; of those that look nearly alike, only the first."""
    chosen: list[PageScene] = []
    looks: list[np.ndarray] = []
    pictured = [scene for scene in scenes if scene.thumbnails]
    for scene in sorted(pictured, key=lambda each: -each.record.metrics[LEADING.name].mean):
        halves = [scene.thumbnails["heuristic"], scene.thumbnails["reference"]]
        look = np.array([images.reduced(half, LOOK) for half in halves])
        if all(np.abs(look - other).mean() >= APART for other in looks):
            chosen.append(scene)
            looks.append(look)
    return chosen[:WORST]


def _size(records: Sequence[ComparisonRecord]) -> str:
    """Return the size, samples and variants of a page, as words."""
    sizes = dict.fromkeys("{} × {}".format(*record.resolution) for record in records)
    samples = dict.fromkeys(sorted(record.plan.spp for record in records if record.plan))
    variants = dict.fromkeys(record.variant for record in records if record.variant)
    parts = (
        f"{', '.join(sizes)} pixels",
        f"{', '.join(map(str, samples))} samples per pixel" if samples else "",
        ", ".join(variants),
    )
    return f"{'; '.join(filter(None, parts))}."


def _settings(records: Sequence[ComparisonRecord]) -> str:
    """Return how a page was made: sizes, versions, machine and date, as words."""
    computer = Machine.here()
    versions = ", ".join(f"{name} {version}" for name, version in records[0].versions.items())
    machine = f"{computer.processor}, {computer.cores} cores"
    return f"{_size(records)[:-1]}; {versions}; {machine}; {date.today().isoformat()}."


def _runs(text: Callable[[float], str]) -> Runs:
    """Return the texts at all thresholds, each where it begins."""
    texts = [text(threshold) for threshold in THRESHOLDS]
    return [(i, text) for i, text in enumerate(texts) if i == 0 or text != texts[i - 1]]


def drawn_scene(view: SceneView, taken: set[str], threshold: float = TOLERANCE) -> PageScene:
    """Draw a scene for pages that begin at a threshold; its name is added to those `taken`."""
    name = identifier(view.record.scene, taken)
    scene = PageScene(**structs.asdict(view), id=name, script=_script_data(name, view))
    template = environment().get_template("scene.html.j2")
    section = template.render(
        scene=scene,
        usual=THRESHOLDS.index(threshold),
        metrics=METRICS,
        leading=LEADING,
        neighbours=NEIGHBOURS,
        threshold=threshold,
        epsilon=LOG2_EPSILON,
    )
    return structs.replace(scene, section=section)


def _digits(price: float | None) -> float | None:
    """Return a price with the digits that a chart can show."""
    return None if price is None else float(f"{price:.3g}")


def _axis(scenes: Sequence[PageScene]) -> dict[str, Any]:
    """Return the ends of the chart of prices, and its marks: powers of ten."""
    prices = [price for scene in scenes for price in scene.script["prices"] if price]
    low = math.floor(math.log10(min(prices, default=1.0)))
    high = max(math.ceil(math.log10(max(prices, default=1.0))), low + 1)
    return {"low": low, "high": high, "marks": [10.0**power for power in range(low, high + 1)]}


def _script_data(name: str, scene: SceneView) -> dict[str, Any]:
    """Return what the page's script has of a scene, as plain data.

    ``shares``, ``verdicts`` and ``prices`` are by threshold, ``verdicts`` with a letter for each:
    "p", "f" or "u" (:func:`fotismos.reports.verdict.price_at`).
    """
    record, cost = scene.studied
    visible = record.metrics[LEADING.name].visible
    why = scene.why
    return {
        "id": name,
        "name": record.scene,
        "width": record.resolution[0],
        "height": record.resolution[1],
        "exposure": record.viewing.exposure,
        "judged": asdict(verdict.judged(record)),
        "truth": asdict(verdict.truth(record)),
        "arePictures": record.pairing is None,
        "isNoiseKnown": record.is_noise_known,
        "mean": difference(record.metrics[LEADING.name].mean),
        "worst": {"pixel": scene.worst, "error": difference(record.metrics[LEADING.name].max)},
        "shares": [round(share.value, 5) for share in visible],
        "verdicts": "".join(verdict.decision(record, t)[0] for t in THRESHOLDS),
        "advice": _runs(lambda t: verdict.sentence(record, cost, t)),
        "cells": {name: _runs(partial(what, record)) for name, what in tables.CELLS.items()},
        "prices": [_digits(verdict.price_at(record, t)) for t in THRESHOLDS],
        "regions": [
            {key: getattr(region, key) for key in ("x", "y", "width", "height")}
            | {"effect": region.effect and verdict.noun(region.effect)}
            for region in record.regions
        ],
        "images": scene.embedded.manifest() if scene.embedded else None,
        "effects": _effects(why, record),
        "board": _board(why, record.why),
        "terms": scene.terms.manifest() if scene.terms else None,
        "live": scene.live.manifest() if scene.live else None,
    }


def _effects(why: WhyView | None, record: ComparisonRecord) -> dict[str, Any] | None:
    """Return where each effect dominates, with the effects' names, colours and parts."""
    if not why:
        return None
    missing = verdict.missing(record)
    return {
        "width": why.width,
        "height": why.height,
        "map": why.map,
        "names": [verdict.noun(name) for name in why.names],
        "colours": [EFFECT_COLOURS[name] for name in why.names],
        "parts": [missing.get(name, 0.0) for name in why.names],
    }


def _board(why: WhyView | None, found: Attribution | None) -> dict[str, Any] | None:
    """Return which effects each small picture has, and the mean error that they leave."""
    if not why or not why.pictures or not found:
        return None
    return {
        "images": why.pictures.manifest(),
        "hybrids": [
            {
                "on": [why.names.index(effect) for effect in hybrid.effects],
                "mean": difference(max(hybrid.error, 0.0)),
            }
            for hybrid in found.hybrids
        ],
    }


def _drawing() -> dict[str, Any]:
    """Return the maps, their colours, and XYZ of linear RGB, under the script's names."""
    maps = (
        (LEADING.name, LEADING.label, "difference", LEADING.map_range[1]),
        ("effects", EFFECTS_TITLE, "effects", 0),
        (RATIO.name, RATIO.label, "ratio", RATIO.limit),
        ("significant", "Certain to differ", "mask", 0),
        *(
            (metric.name, metric.label, "metric", metric.map_range[1])
            for metric in declared().values()
        ),
    )
    return {
        "maps": [dict(zip(("name", "title", "kind", "top"), shown, strict=True)) for shown in maps],
        "noEffect": NO_EFFECT,
        "dark": images.DARK,
        "colours": {
            "error": images.colour_table(images.ERROR_COLOURS),
            "signed": images.colour_table(images.SIGNED_COLOURS),
        },
        "mask": [images.MARKED, images.UNMARKED, images.UNCOUNTED, images.UNDETERMINED],
        "xyz": rgb_to_xyz(BT709).tolist(),
        "epsilon": LOG2_EPSILON,
    }
