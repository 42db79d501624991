"""The page of one study of cost: its charts with the points' pictures, and its tables."""

from __future__ import annotations

from collections.abc import Sequence

from reports import glossary
from reports.charts.vega import Figure
from reports.page import templating
from reports.page.scene_view import CostView

STYLES = ("base", "scene", "points", "help", "print")
SCRIPTS = ("page", "numbers", "decoding", "help", "points", "charts")

#: Makes the page live.
BEGIN = """
watchCharts(document.body);
explainTerms(document.body);
listenForHelp(document.getElementById("tip"));
"""


def render(view: CostView, charts: Sequence[Figure]) -> str:
    """Return the page of a study and its charts."""
    return (
        templating.environment()
        .get_template("cost_page.html.j2")
        .render(
            style=templating.style(STYLES),
            scripts=templating.scripts(SCRIPTS, True, BEGIN),
            cost=view,
            r=view.record,
            charts=charts,
            terms=glossary.meanings(),
        )
    )
