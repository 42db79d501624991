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
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from msgspec import structs

from comparisons.departure.metrics import LEADING, METRICS
from comparisons.records import plain
from reports import glossary, verdict
from reports.charts import histograms, vega
from reports.page import overview, templating, verdict_view, viewer_data
from reports.page.legends import legends
from reports.page.scene_view import Making, SceneView
from reports.run.stages import Failure, Run

if TYPE_CHECKING:  # few pages need these
    from comparisons.hard.collection import HardCases
    from comparisons.verification import Verification
    from heuristic.equations import Entry

#: The page's heading.
TITLE = "Textbook shading against physically based rendering"

#: The parts of the page's style and of its script, in order.
STYLES = (
    "base", "verdict", "overview", "scene", "viewer", "switchboard", "terms", "points", "help",
    "print",
)  # fmt: skip
SCRIPTS = (
    "page", "numbers", "help", "decoding", "tonemaps", "spaces", "effects", "painting", "selection",
    "fragment", "address", "viewport", "drawing", "inspector", "distribution", "caption", "saving",
    "pointer", "controls", "viewer", "keyboard", "overview", "points", "charts", "verdict",
    "vectors", "termrows", "terms", "switchboard", "objects", "lazy", "main",
)  # fmt: skip


class Scene(SceneView, kw_only=True):
    """A scene in the page, and its name in the page's address."""

    id: str
    histograms: tuple[vega.Figure, ...]


class FailedScene(Failure, kw_only=True):
    """A scene that could not be compared, and its name in the page's address."""

    id: str


def render(
    views: Sequence[SceneView],
    title: str = TITLE,
    equations: Sequence[Entry] = (),
    verifications: Sequence[Verification] = (),
    hard_cases: HardCases | None = None,
    failures: Sequence[Failure] = (),
    run: Run | None = None,
    making: Making | None = None,
) -> str:
    """One HTML page of all scenes, in the given order.

    `equations` is the index of `heuristic.equations`; it, `verifications` and `hard_cases` are
    separate sections, omitted if empty. `failures` are the scenes that could not be compared. `run`
    says where the time went, `making` how far an unfinished run is.
    """
    taken: set[str] = set()
    scenes = [_scene(view, taken) for view in views]
    failed = [
        FailedScene(failure.scene, failure.error, id=overview.identifier(failure.scene, taken))
        for failure in failures
    ]
    charted = any(scene.histograms or scene.charts for scene in scenes)
    return (
        templating.environment()
        .get_template("page.html.j2")
        .render(
            title=title,
            style=templating.style(STYLES),
            scripts=templating.scripts(SCRIPTS, charted),
            page_data=_page_data(scenes, failed),
            verdict=verdict_view.context(scenes) if scenes else None,
            scenes=scenes,
            failures=failed,
            metrics=METRICS,
            leading=LEADING,
            columns=overview.columns(),
            legends=legends(),
            glossary=glossary.GROUPS,
            equations=equations,
            verifications=verifications,
            **_of_few_pages(scenes, hard_cases),
            run=run,
            making=making,
        )
    )


def _of_few_pages(scenes: Sequence[Scene], hard_cases: HardCases | None) -> dict[str, Any]:
    """Content of few pages, made by modules that the others do not import."""
    costs = [scene.cost.record for scene in scenes if scene.cost]
    shown: dict[str, Any] = {"cost_rows": (), "hard_cases": hard_cases, "ranking": {}}
    if len(scenes) > 1:
        from reports.ranking import rankings

        shown["ranking"] = rankings([scene.record for scene in scenes])
    if costs:
        from reports.page.costs import cost_overview

        shown["cost_methods"] = cost_overview.methods(costs)
        shown["cost_rows"] = cost_overview.rows(costs)
    if hard_cases:
        from reports.page.hard_cases import GROUPS, grey

        shown |= {"hard_groups": GROUPS, "grey": grey}
    return shown


def _scene(view: SceneView, taken: set[str]) -> Scene:
    return Scene(
        **structs.asdict(view),
        id=overview.identifier(view.record.scene, taken),
        histograms=tuple(histograms.figures(view.record)),
    )


def _page_data(scenes: Sequence[Scene], failed: Sequence[FailedScene]) -> dict[str, Any]:
    """The data of the page's script: the scenes, and how maps are drawn."""
    return {
        "scenes": [
            *map(_scene_data, scenes),
            *({"id": failure.id, "name": failure.scene, "failed": True} for failure in failed),
        ],
        "terms": glossary.meanings(),
        **viewer_data.drawing(),
    }


def _scene_data(scene: Scene) -> dict[str, Any]:
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
        "between": plain(scene.cost.between) if scene.cost else None,
        "terms": scene.terms.manifest() if scene.terms else None,
        "keys": overview.keys(record),
        "significant": overview.is_significant(record),
    }
