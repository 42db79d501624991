"""The page of one study of cost: its charts with the points' pictures, and its tables."""

from __future__ import annotations

from collections.abc import Sequence

from reports.charts.vega import Figure
from reports.page import templating
from reports.page.scene_view import CostView

STYLES = ("base", "scene", "points", "print")
SCRIPTS = ("points", "charts")


def render(view: CostView, charts: Sequence[Figure]) -> str:
    """Return the page of a study and its charts."""
    return (
        templating.environment()
        .get_template("cost_page.html.j2")
        .render(
            style=templating.style(STYLES),
            scripts=templating.scripts(SCRIPTS, True, "watchCharts(document.body);"),
            cost=view,
            r=view.record,
            charts=charts,
        )
    )
