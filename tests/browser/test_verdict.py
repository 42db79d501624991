"""The first screen: the verdict at a threshold, its pictures, and its bars."""

import math

import pytest

from fotismos.comparisons.departure.metrics import THRESHOLDS
from fotismos.reports.page.page import render
from tests.browser.conftest import EXACT, FAILED, NOISY, NOISY_ID, PHONE
from tests.shared import records

DESK = {"viewport": {"width": 1440, "height": 900}}
PLACE = "document.querySelector('.worst li img').getBoundingClientRect().bottom"


def names(page):
    return [row.locator("a").text_content() for row in page.locator(".bars tr:has(.bar)").all()]


@pytest.mark.parametrize("visitor", [DESK, PHONE], indirect=True)
def test_verdict_and_first_pictures_stand_on_the_first_screen(visitor):
    page = visitor.open()
    heading = page.get_by_role("heading", level=1)
    assert heading.text_content() == "Textbook shading looks right in 1 of 2 scenes."
    assert page.evaluate(PLACE) < page.evaluate("innerHeight")
    pictures = page.locator(".worst img:visible")
    assert pictures.count() == 6
    assert all(picture.evaluate("image => image.naturalWidth > 0") for picture in pictures.all())
    assert FAILED in page.locator(".bars .failure").text_content()


@pytest.mark.parametrize("by", ["keyboard", "mouse"])
def test_the_slider_drives_headline_bars_map_and_address_together(visitor, report, by):
    page = visitor.open()
    slider = page.locator("#overview [data-threshold]")
    if by == "keyboard":
        slider.focus()
        for _ in range(12):
            page.keyboard.press("ArrowRight")
    else:
        box = slider.bounding_box()
        page.mouse.click(box["x"] + 8 + (box["width"] - 16) * 4 / 9, box["y"] + box["height"] / 2)
    assert visitor.state() == {"t": "5"}
    assert page.locator("#headline").text_content() == (
        "Textbook shading looks right in 2 of 2 scenes."
    )
    row = page.locator(f".bars [data-scene='{NOISY_ID}']")
    shares = {each["threshold"]: each["value"] for each in visible(report)}
    assert row.locator("[data-show=share]").text_content() == f"{100 * shares[5]:.1f} %"
    whole, bar = (row.locator(part).bounding_box()["width"] for part in (".bar", ".bar > span"))
    assert bar / whole == pytest.approx(shares[5], abs=0.005)
    assert row.locator("[data-cell=needs]").text_content() == "nothing"
    row.locator("a").click()
    visitor.wait_for_viewer()
    assert visitor.state() == {"scene": NOISY_ID, "t": "5"}
    assert page.locator("#viewer [data-threshold]").input_value() == "5"
    assert "grey up to 5" in page.locator(".legend").text_content()
    assert f"{100 * shares[5]:.1f} %" in page.locator(".scene.open h1").text_content()


def visible(report):
    return report.records[NOISY]["metrics"]["dE2000"]["visible"]


def test_bars_are_divided_by_what_is_missing_and_stand_worst_first(visitor):
    page = visitor.open()
    assert names(page) == [NOISY, EXACT]
    pieces = page.locator(f".bars [data-scene='{NOISY_ID}'] .bar i").all()
    titles = [piece.get_attribute("title").partition(":")[0] for piece in pieces]
    assert titles == ["interreflection", "occlusion"]
    widths = [piece.bounding_box()["width"] for piece in pieces]
    assert widths[0] / widths[1] == pytest.approx(5.895 / 3.141, rel=0.05)


@pytest.mark.parametrize("visitor", [{"viewport": {"width": 1200, "height": 300}}], indirect=True)
def test_back_leads_to_the_place_that_was_left(visitor):
    page = visitor.open("#t=3")
    link = page.locator(f".bars [data-scene='{EXACT}'] a")
    link.scroll_into_view_if_needed()
    before = page.evaluate("scrollY")
    assert before > 0
    link.click()
    visitor.wait_for_viewer(EXACT)
    assert page.evaluate("scrollY") == 0
    assert page.locator(".scene:visible h1").count() == 1
    assert not page.locator("#overview").is_visible()
    page.go_back()
    page.wait_for_function("() => document.documentElement.dataset.view === 'overview'")
    assert page.evaluate("scrollY") == before
    assert visitor.state() == {"t": "3"}


def test_the_navigation_stays_and_leads_to_scenes_and_details(visitor):
    page = visitor.open(f"#scene={NOISY_ID}&t=4")
    page.evaluate("window.scrollTo(0, 600)")
    assert page.locator("nav.top").bounding_box()["y"] == 0
    page.get_by_role("link", name="Scenes", exact=True).click()
    page.wait_for_function("() => document.documentElement.dataset.view === 'overview'")
    assert visitor.state() == {"t": "4"}
    page.get_by_role("link", name="Details").click()
    assert page.get_by_role("heading", level=1).text_content() == "Details"
    assert page.locator("#glossary").count() == 1


LABELS = """bars => bars.map((bar) => {
  const range = document.createRange(), box = bar.getBoundingClientRect();
  range.selectNodeContents(bar);
  const label = range.getBoundingClientRect();
  const fits = label.left >= box.left && label.right <= box.right && label.top < box.bottom;
  return fits ? "whole" : label.top >= box.bottom ? "hidden" : "cut";
})"""


@pytest.mark.parametrize("visitor", [DESK, PHONE], indirect=True)
def test_labels_of_bars_are_whole_or_hidden(visitor):
    found = set()
    for threshold in (1, 1.25, 1.5, 1.75, 2, 2.5, 3, 5):
        page = visitor.open(f"#scene={NOISY_ID}&t={threshold}")
        found |= {*page.locator(".scene.open .bar i:not(:empty)").evaluate_all(LABELS)}
    assert found == {"whole", "hidden"}


def priced(name, low, high):
    """Return a scene that fails, and needs ``low`` samples at 3 and above, and ``high`` below."""
    wrong = records.data() | {"scene": name}
    for share in wrong["metrics"]["dE2000"]["visible"]:
        value = 0.9 if share["threshold"] < 4 else 0.5
        share |= dict.fromkeys(("value", "low", "high"), value)
    samples = []
    for threshold in THRESHOLDS:
        count = low if threshold >= 3 else high
        samples.append({"threshold": threshold, "value": count, "low": count, "high": count})
    wrong["price"] = {
        "ratio": {"value": 2.0, "low": 1.9, "high": 2.1},
        "reason": "",
        "heuristic_s": 1e-6,
        "reference_s": 2e-6,
        "pixels": 100,
        "samples": samples,
    }
    return records.view(wrong)


@pytest.fixture(params=[DESK, PHONE], ids=["desk", "phone"])
def prices(request, chromium, tmp_path):
    """A page of two scenes with prices."""
    file = tmp_path / "index.html"
    page = chromium.new_page(**request.param)
    file.write_text(render([priced("a", 4, 64), priced("b", 16, None)]))
    yield page, file.as_uri()
    page.close()


def test_rows_chart_sentence_and_address_agree_about_prices(prices):
    page, address = prices
    page.goto(f"{address}#t=2")
    slider = page.locator("#overview [data-threshold]")

    def cells(name):
        row = page.locator(f".bars [data-scene='{name}']")
        return [row.locator(f"[data-cell={what}]").text_content() for what in ("samples", "time")]

    points = {name: page.locator(f"[data-price='{name}'] a") for name in "ab"}

    def centre(name):
        box = points[name].bounding_box()
        return box["x"] + box["width"] / 2

    plot = page.locator(".plot").bounding_box()
    assert cells("a") == ["64", "12.8 ms"]
    assert cells("b") == ["> 65,536", ""]
    assert "In 0 of 2 scenes" in page.locator("#costs-sentence").text_content()
    # The axis is from 1 to 100; what is not known has no place on it.
    first = plot["x"] + plot["width"] * math.log10(32) / 2
    assert centre("a") == pytest.approx(first, abs=3)
    assert not points["b"].is_visible()
    unknown = page.locator("#unpriced")
    assert unknown.text_content() == "Not known of b."

    slider.focus()
    for _ in range(4):
        page.keyboard.press("ArrowRight")
    assert page.evaluate("location.hash") == "#t=3"
    assert cells("a") == ["4", "800 µs"]
    assert cells("b") == ["16", "3.20 ms"]
    assert centre("a") == pytest.approx(plot["x"] + plot["width"] * math.log10(2) / 2, abs=3)
    assert centre("b") == pytest.approx(plot["x"] + plot["width"] * math.log10(8) / 2, abs=3)
    assert unknown.text_content() == ""
    points["a"].click()
    # The link names the scene; then the page adds its threshold.
    page.wait_for_function("() => location.hash === '#scene=a&t=3'")
    command = page.locator(".scene:visible [data-command]").text_content()
    assert command.endswith("--within 3")


def test_points_of_the_chart_stay_within_it_and_names_do_not_overlap(prices):
    page, address = prices
    page.goto(f"{address}#t=3")
    names = page.locator(".plot .named span")
    assert names.count() == 2
    boxes = [name.bounding_box() for name in names.all()]
    width = page.evaluate("innerWidth")
    assert all(box["x"] >= 0 and box["x"] + box["width"] <= width for box in boxes)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
