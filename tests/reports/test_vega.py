"""Charts: pictures that fit the page, and text that stays text."""

import re

from fotismos.reports.charts import vega


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


def test_paper_is_white_with_black_text_and_otherwise_as_the_page():
    svg = vega.paper(bars()).decode()
    assert 'fill="white"' in svg
    assert "currentColor" not in svg
    for part in ("axis", "legend", "title"):
        inked = {**vega.PAPER[part]}
        differing = {key for key, value in vega.PAGE[part].items() if inked[key] != value}
        assert all("olor" in key for key in differing), differing


def test_two_charts_on_a_page_share_no_id(monkeypatch):
    ids = []
    for width in (100, 200):
        drawn = f'<svg width="{width}"><clipPath id="clip0"/><g clip-path="url(#clip0)"/></svg>'
        monkeypatch.setattr("vl_convert.vegalite_to_svg", lambda spec, drawn=drawn: drawn)
        svg = vega.figure("Price", bars(drawn)).svg
        ids += re.findall(r'\bid="([^"]+)"', svg)
        assert re.findall(r"url\(#([^)]+)\)", svg) == ids[-1:]
    assert ids[0] != ids[1]


class PanicException(BaseException):
    """What a library in Rust raises when it cannot continue."""
