"""Charts: pictures that fit the page, and text that stays text."""

import json
import re

from reports.charts import vega
from reports.page import page
from tests import records
from tests.test_page import HOSTILE, Page


def bars(effect="shadow", **extra):
    return {
        "data": {"values": [{"effect": effect, "price": 2.0}]},
        "mark": "bar",
        "encoding": {
            "x": {"field": "price", "type": "quantitative"},
            "y": {"field": "effect", "type": "nominal"},
        },
        **extra,
    }


def test_a_chart_takes_the_texts_colour_and_has_a_transparent_ground():
    svg = vega.figure("Price", bars()).svg
    assert svg.startswith("<svg")
    assert 'fill="currentColor"' in svg
    assert 'fill="white"' not in svg
    assert "shadow" in svg


def test_a_specifications_own_config_has_the_last_word():
    spec = vega.figure(
        "Price", bars(config={"axis": {"labelFontSize": 7}, "bar": {"size": 3}})
    ).spec
    assert spec["config"]["axis"]["labelFontSize"] == 7
    assert spec["config"]["axis"]["labelColor"] == "currentColor"
    assert spec["config"]["bar"] == {"size": 3}
    assert "labelFontSize" in vega.CONFIG["axis"]
    assert vega.CONFIG["axis"]["labelFontSize"] != 7


def test_two_charts_on_a_page_share_no_id():
    pictures = [
        f'<svg width="{width}"><clipPath id="clip0"/><g clip-path="url(#clip0)"/></svg>'
        for width in (100, 200)
    ]
    charts = [vega._inline(picture) for picture in pictures]
    ids = [re.findall(r'\bid="([^"]+)"', svg) for svg in charts]
    assert ids[0] != ids[1]
    for svg, own in zip(charts, ids, strict=True):
        assert re.findall(r"url\(#([^)]+)\)", svg) == own
    clipped = bars()
    clipped["mark"] = {"type": "bar", "clip": True}
    svg = vega.figure("Price", clipped).svg
    used = set(re.findall(r"url\(#([^)]+)\)", svg))
    assert used
    assert used <= set(re.findall(r'\bid="([^"]+)"', svg))


def test_text_in_a_chart_stays_text():
    record = records.record()
    record["histograms"] = {}
    figure = vega.figure(HOSTILE, bars(HOSTILE, title=HOSTILE), HOSTILE)
    html = page.render([{"record": record, "images": {}, "charts": [figure]}])
    shown = Page(html)
    assert not [attrs for tag, attrs in shown.tags if tag == "img"]
    assert HOSTILE not in html
    island = re.search(r'<script type="application/json">(.*?)</script>', html, re.S)
    assert json.loads(island[1])["title"] == HOSTILE


def test_the_library_is_in_the_page_once_and_only_where_a_chart_is():
    record = records.record()
    view = {"record": record, "images": {}}
    assert page.render([view, view]).count("window.vegaEmbed=") == 1
    del record["histograms"]
    assert "window.vegaEmbed=" not in page.render([view])
    assert "How the error is distributed" not in page.render([view])


def test_the_library_can_stand_in_a_script_element():
    assert "</script" not in vega.bundle().lower()
    assert "<!--" not in vega.bundle()
