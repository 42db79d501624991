"""The report: one offline HTML file with the pictures, maps and numbers of a run.

`render` only prints the numbers of records and of images that are encoded already.
Names and messages come from users' files, so everything is escaped, and the page may load nothing:
a content security policy allows only the page's own scripts, by their hashes.

Without JavaScript the page has small pictures, numbers and charts, one scene after another. With
it, ``templates/viewer`` shows one scene at a time from its embedded numbers, and the others wait as
text.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import structs

from comparisons.comparison import ComparisonRecord
from comparisons.departure import criterion
from comparisons.departure.metrics import LEADING, METRICS
from reference.records import plain
from reports import glossary, verdict
from reports.charts import histograms, vega
from reports.charts.theme import EFFECT_COLOURS
from reports.page import templating, viewer_data
from reports.page.scene_view import Making, SceneView
from reports.run.results import Failure, RunRecord

if TYPE_CHECKING:  # few pages need these
    from comparisons.hard_cases import HardCases
    from comparisons.verification import Verification

#: The page's heading.
TITLE = "Textbook shading against physically based rendering"

ROOM = 1.04
"""Width of the bars, relative to the longest."""

#: The parts of the page's style and of its script, in order.
STYLES = (
    "base", "verdict", "overview", "scene", "viewer", "switchboard", "terms", "help",
    "print",
)  # fmt: skip
SCRIPTS = (
    "page", "numbers", "help", "decoding", "tonemaps", "spaces", "effects", "painting", "selection",
    "fragment", "address", "viewport", "drawing", "inspector", "distribution", "saving",
    "pointer", "controls", "viewer", "keyboard", "verdict",
    "termrows", "terms", "switchboard", "lazy", "main",
)  # fmt: skip


TOLERANCES = (1.0, 2.0, 5.0)
"""The tolerances that can be chosen."""

#: Fewest scenes for a meaningful ranking.
FEWEST = 4


@dataclass(frozen=True)
class Agreement:
    """How two metrics rank scenes, from −1 (opposite) over 0 (unrelated) to 1 (alike).

    Attributes
    ----------
    spearman
        Correlation of the ranks.
    kendall
        Share of the pairs of scenes in the same order, minus the share in opposite order
        (τ_b, which leaves ties out).
    """

    spearman: float
    kendall: float


class PageScene(SceneView, kw_only=True):
    """A scene in the page, and its name in the page's address."""

    id: str
    histograms: tuple[vega.Figure, ...]


class FailedScene(Failure, kw_only=True):
    """A scene that could not be compared, and its name in the page's address."""

    id: str


def render(
    views: Sequence[SceneView],
    title: str = TITLE,
    verifications: Sequence[Verification] = (),
    hard_cases: HardCases | None = None,
    failures: Sequence[Failure] = (),
    run: RunRecord | None = None,
    making: Making | None = None,
) -> str:
    """One HTML page of all scenes, in the given order.

    `verifications` and `hard_cases` are separate sections, omitted if empty. `failures` are the
    scenes that could not be compared. `run` says where the time went, `making` how far an
    unfinished run is.
    """
    taken: set[str] = set()
    scenes = [_scene(view, taken) for view in views]
    failed = [
        FailedScene(failure.scene, failure.error, id=_identifier(failure.scene, taken))
        for failure in failures
    ]
    return (
        templating.environment()
        .get_template("page.html.j2")
        .render(
            title=title,
            style=templating.style(STYLES),
            scripts=templating.scripts(SCRIPTS),
            page_data=_page_data(scenes, failed),
            verdict=_verdict(scenes) if scenes else None,
            scenes=scenes,
            failures=failed,
            metrics=METRICS,
            leading=LEADING,
            legends=viewer_data.legends(),
            glossary=glossary.GROUPS,
            verifications=verifications,
            hard_cases=hard_cases,
            ranking=rankings([scene.record for scene in scenes]),
            run=run,
            making=making,
        )
    )


def _verdict(scenes: Sequence[PageScene]) -> dict[str, Any]:
    """Return the data of the first screen: the verdict, and a bar for each scene, worst first."""
    studied = [(scene.record, scene.cost.record if scene.cost else None) for scene in scenes]
    rows: list[dict[str, Any]] = [
        {
            "id": scene.id,
            "name": record.scene,
            "mean": record.metrics[LEADING.name].mean,
            "parts": verdict.missing(record, cost),
            "passes": [t for t in TOLERANCES if verdict.decision(record, t) == "pass"],
            "sentences": {t: verdict.sentence(record, cost, t) for t in TOLERANCES},
        }
        for scene, (record, cost) in zip(scenes, studied, strict=True)
    ]
    names = dict.fromkeys(effect for row in rows for effect in row["parts"])
    records = [scene.record for scene in scenes]
    return {
        "sentences": [verdict.headline(records), verdict.most_missing(studied)],
        "rows": sorted(rows, key=lambda row: -row["mean"]),
        "about": {s.id: verdict.about(*pair) for s, pair in zip(scenes, studied, strict=True)},
        "tolerances": TOLERANCES,
        "usual": criterion.TOLERANCE,
        "share": criterion.LIMIT,
        "top": ROOM * max((row["mean"] for row in rows), default=1.0) or 1.0,
        "effects": {name: EFFECT_COLOURS[name] for name in names},
    }


def _scene(view: SceneView, taken: set[str]) -> PageScene:
    return PageScene(
        **structs.asdict(view),
        id=_identifier(view.record.scene, taken),
        histograms=tuple(histograms.figures(view.record)),
    )


def _page_data(scenes: Sequence[PageScene], failed: Sequence[FailedScene]) -> dict[str, Any]:
    """The data of the page's script: the scenes, and how maps are drawn."""
    return {
        "scenes": [
            *map(_scene_data, scenes),
            *({"id": failure.id, "name": failure.scene, "failed": True} for failure in failed),
        ],
        "terms": glossary.meanings(),
        **viewer_data.drawing(),
    }


def _scene_data(scene: PageScene) -> dict[str, Any]:
    record = scene.record
    return {
        "id": scene.id,
        "name": record.scene,
        "width": record.resolution[0],
        "height": record.resolution[1],
        "exposure": record.viewing.exposure,
        "judged": asdict(verdict.judged(record)),
        "regions": plain(record.regions),
        "best": viewer_data.best_exposures(record.metrics),
        "images": scene.embedded.manifest() if scene.embedded else None,
        "effects": plain(scene.cost.effects) if scene.cost else None,
        "terms": scene.terms.manifest() if scene.terms else None,
    }


def _identifier(name: str, taken: set[str]) -> str:
    """Return a name for a scene in the page's address: plain characters; added to `taken`."""
    plain = "".join(c if (c.isascii() and c.isalnum()) or c in "-_." else "-" for c in name)
    chosen, count = plain or "scene", 1
    while chosen in taken:
        count += 1
        chosen = f"{plain or 'scene'}-{count}"
    taken.add(chosen)
    return chosen


def rankings(records: Sequence[ComparisonRecord]) -> dict[str, dict[str, Agreement]]:
    """Return the agreement of each pair of metrics on means without noise, by their names.

    Empty for fewer than `FEWEST` scenes. A metric with the same value in all scenes ranks nothing,
    and is left out.
    """
    if len(records) < FEWEST:
        return {}
    from scipy.stats import kendalltau, spearmanr  # takes a second to import

    values = {name: [r.metrics[name].debiased for r in records] for name in METRICS}
    values = {name: means for name, means in values.items() if np.ptp(means) > 0.0}
    return {
        one: {
            other: Agreement(
                float(spearmanr(values[one], values[other]).statistic),
                float(kendalltau(values[one], values[other]).statistic),
            )
            for other in values
        }
        for one in values
    }
