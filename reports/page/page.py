"""The report: one offline HTML file with the pictures, maps and numbers of a run.

`render` only prints the numbers of records and of images that are encoded already.
Names and messages come from users' files, so everything is escaped, and the page may load nothing:
a content security policy allows only the page's own scripts, by their hashes.

Without JavaScript the page has small pictures, numbers and charts, one scene after another. With
it, ``templates/viewer`` shows one scene at a time from its embedded numbers, and the others wait as
text.
"""

from __future__ import annotations

import base64
import hashlib
import math
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup
from msgspec import structs

from comparisons.departure.metrics import LEADING, METRICS
from comparisons.records import plain
from reports.charts import histograms, theme, vega
from reports.files import images
from reports.page import embedding, overview, switchboard, verdict_view, viewer_data
from reports.page.legends import legends
from reports.page.scene_view import Making, SceneView
from reports.ranking import rankings
from reports.run.stages import Failure, Run
from reports.terminal.printing import (
    NOTICEABLE,
    about_noise,
    code_spans,
    difference,
    may_be_none,
    number,
    parameter,
    percent,
    seconds,
)

if TYPE_CHECKING:  # few pages need these
    from comparisons.cost.cost_record import Cost
    from comparisons.hard.collection import HardCases
    from comparisons.verification import Verification
    from heuristic.equations import Entry

#: The page's heading.
TITLE = "Textbook shading against physically based rendering"

#: Pictures narrower than this are enlarged without smoothing.
PIXELATED_BELOW = 400

#: How values are printed, by the names of forms.
FORMS = {form.__name__: form for form in (number, difference, parameter, seconds, percent)}

TEMPLATES = Path(__file__).parent / "templates"

#: The parts of the page's style and of its script, in order.
STYLES = ("base", "verdict", "overview", "scene", "viewer", "switchboard", "terms", "print")
SCRIPTS = (
    "page", "numbers", "decoding", "tonemaps", "spaces", "effects", "painting", "selection",
    "fragment", "address", "viewport", "drawing", "inspector", "distribution", "saving", "pointer",
    "controls", "viewer", "keyboard", "overview", "charts", "verdict", "vectors", "termrows",
    "terms", "switchboard", "objects", "lazy", "main",
)  # fmt: skip

#: Runs before anything is drawn: content that needs scripts is shown only if they run.
EARLY = 'document.documentElement.className = "js";'

#: Tells the page that the module before it has run; inline modules have no such event.
LOADED = '\nwindow.dispatchEvent(new Event("vega"));'


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
    code = "\n".join(_source(f"viewer/{part}.js") for part in SCRIPTS)
    scripts = [EARLY, *([_vega()] if charted else []), '"use strict";\n' + code]
    return (
        _environment()
        .get_template("page.html.j2")
        .render(
            title=title,
            style=Markup("".join(_source(f"styles/{part}.css") for part in STYLES)),
            scripts=[{"code": Markup(script), "source": _hash(script)} for script in scripts],
            vega=embedding.deflated(_vega().encode(), 9) if charted else "",
            page_data=_page_data(scenes, failed),
            verdict=verdict_view.context(scenes) if scenes else None,
            scenes=scenes,
            failures=failed,
            metrics=METRICS,
            leading=LEADING,
            columns=overview.columns(),
            legends=legends(),
            equations=equations,
            ranking=rankings([scene.record for scene in scenes]),
            verifications=verifications,
            **_of_few_pages([scene.cost.record for scene in scenes if scene.cost], hard_cases),
            run=run,
            making=making,
        )
    )


def _vega() -> str:
    return vega.bundle() + LOADED


def _of_few_pages(costs: Sequence[Cost], hard_cases: HardCases | None) -> dict[str, Any]:
    """Content of few pages, made by modules that the others do not import."""
    shown: dict[str, Any] = {"cost_rows": (), "hard_cases": hard_cases}
    if costs:
        from reports.page import cost_overview

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
        "regions": plain(record.regions),
        "best": viewer_data.best_exposures(record.metrics),
        "images": scene.embedded.manifest() if scene.embedded else None,
        "effects": plain(scene.cost.effects) if scene.cost else None,
        "terms": scene.terms.manifest() if scene.terms else None,
        "keys": overview.keys(record),
        "significant": overview.is_significant(record),
    }


def _data_uri(png: bytes) -> str:
    return "data:image/png;base64," + base64.b64encode(png).decode("ascii")


def _hash(script: str) -> Markup:
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode("ascii")
    return Markup(f"'sha256-{digest}'")


def _source(name: str) -> str:
    return (TEMPLATES / name).read_text(encoding="utf-8")


@lru_cache(maxsize=1)
def _environment() -> Environment:
    environment = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    environment.filters.update(
        FORMS,
        code_spans=code_spans,
        region_view=viewer_data.region_view,
        plain=plain,
        uri=_data_uri,
        webp_uri=switchboard.webp_uri,
    )
    environment.tests.update(about_noise=about_noise, may_be_none=may_be_none, finite=math.isfinite)
    environment.globals.update(
        forms=FORMS,
        marked=images.css_colour(images.MARKED),
        unmarked=images.css_colour(images.UNMARKED),
        uncounted=images.css_colour(images.UNCOUNTED),
        undetermined=images.css_colour(images.UNDETERMINED),
        effects_title=theme.EFFECTS_TITLE,
        value_bar=images.colour_bar(images.VALUE_COLOURS),
        pixelated_below=PIXELATED_BELOW,
        noticeable=NOTICEABLE,
    )
    return environment
