"""What accuracy costs, in the page: charts that answer to the pointer, and the map of effects."""

import numpy as np
import pytest

from comparisons.departure.metrics import drawn
from comparisons.effects.dominance import dominating
from reports.charts import theme
from tests.browser.conftest import EXACT, HEIGHT, NOISY_ID, WIDTH
from tests.cost_records import HEIGHT as ROWS
from tests.cost_records import WIDTH as COLUMNS

SCENE = f"#scene={NOISY_ID}"
CHARTS = len(drawn()) + 2
"""A histogram per metric, error against time, and prices."""


def enlivened(visitor):
    page = visitor.open(SCENE)
    visitor.unfold()
    for charts in page.locator(".scene.open .charts").all():
        charts.scroll_into_view_if_needed()
    page.wait_for_function(
        "count => document.querySelectorAll('.scene.open .chart.vega-embed svg').length === count",
        arg=CHARTS,
    )
    return page


def bytes_of(css):
    return tuple(bytes.fromhex(css[1:]))


def test_charts_come_alive(visitor):
    page = enlivened(visitor)
    assert page.locator(".scene.open .chart svg").count() == CHARTS
    titles = page.locator(".scene.open .charts.wide .chart-figure > figcaption").all_text_contents()
    assert titles == ["Error against time", "Price of an effect"]


def test_a_point_of_the_chart_tells_its_method_time_and_error(visitor, report):
    page = enlivened(visitor)
    chart = page.locator(".scene.open .charts.wide .chart").first
    symbols = chart.locator(".mark-symbol path")
    points = report.study.record.points
    assert symbols.count() == len(points)
    symbols.nth(2).hover()
    tooltip = page.locator("#vg-tooltip-element.visible")
    tooltip.wait_for()
    text = tooltip.text_content()
    for part in (points[2].rung, "16", "56.7", "1.23"):
        assert part in text


def test_a_bar_tells_what_its_effect_removes_and_adds(visitor):
    page = enlivened(visitor)
    page.locator(".scene.open .charts.wide .chart").nth(1).locator(".mark-rect path").first.hover()
    tooltip = page.locator("#vg-tooltip-element.visible")
    tooltip.wait_for()
    for part in ("occlusion", "3.14", "11.1"):
        assert part in tooltip.text_content()


def place(x, y):
    """The pixel of the study that holds the middle of one of the image."""
    return int((y + 0.5) * ROWS / HEIGHT), int((x + 0.5) * COLUMNS / WIDTH)


@pytest.mark.parametrize("pixel", [(5, 12), (40, 12), (23, 16), (24, 16), (30, 31), (30, 1)])
def test_map_and_inspector_name_the_effect_that_dominates(visitor, report, pixel):
    page = visitor.open(f"{SCENE}&mode=error&map=effects&boxes=0&pixel={pixel[0]},{pixel[1]}")
    study = report.study
    known = dominating(study.effects, study.counted)[place(*pixel)]
    names = [*study.effects, "", "none visible"]
    colours = [*map(theme.EFFECT_COLOURS.get, study.effects), "#82888f", theme.NO_EFFECT]
    shown = visitor.inspected()["effect"]
    assert shown == (names[known] or "–") or (shown == "" and not names[known])
    x, y = pixel[0] + (2 if pixel[0] != 23 else -2), pixel[1]  # beside the mark
    np.testing.assert_allclose(visitor.colour_of(x, y), bytes_of(colours[known]), atol=1)
    assert page.locator(".legend:visible").count() == 1


def test_the_legend_names_every_effect_of_the_scene(visitor, report):
    page = visitor.open(f"{SCENE}&mode=side&map=effects")
    keys = page.locator("[data-legend=effects] .key").all_text_contents()
    assert keys == [*report.study.effects, "none visible"]


def test_a_scene_without_prices_has_no_map_of_effects(visitor):
    page = visitor.open(f"#scene={EXACT}&mode=error&map=effects")
    assert page.get_by_label("Map of the error").input_value() == "dE2000"
    assert page.locator("option[value=effects]").is_disabled()
    page.keyboard.press("3")
    for _ in range(8):
        page.keyboard.press("m")
        assert visitor.state().get("map") != "effects"
    visitor.open(f"{SCENE}&mode=error&map=significant")
    page.keyboard.press("m")
    assert visitor.state()["map"] == "effects"


def test_the_regions_name_their_effect_in_words(visitor):
    page = visitor.open(SCENE)
    assert "interreflection" in page.locator(".scene.open .regions").text_content()
