"""The overview: its order, its filters, and the way to a scene and back."""

import pytest

from tests.browser.conftest import EXACT, FAILED, NOISY, NOISY_ID


def names(page):
    return [name.strip() for name in page.locator(".card:visible .name").all_text_contents()]


def test_cards_show_the_records_figures(visitor, report):
    page = visitor.open()
    assert names(page) == [NOISY, EXACT, FAILED]
    metrics = report.records[NOISY]["metrics"]
    values = page.locator(f".card[data-scene='{NOISY_ID}'] data").all()
    assert [float(value.get_attribute("value")) for value in values] == [
        metrics["dE2000"]["mean"],
        metrics["dE2000"]["after_exposure"]["mean"],
        metrics["dE2000"]["noise_floor"],
        report.records[NOISY]["significant"]["fraction"],
    ]
    pictures = page.locator(".card:visible img")
    assert pictures.count() == 6
    assert all(picture.evaluate("image => image.naturalWidth > 0") for picture in pictures.all())


@pytest.mark.parametrize(
    ("key", "order"),
    [
        ("run", [NOISY, EXACT, FAILED]),
        ("dE2000", [NOISY, EXACT, FAILED]),
        ("-dE2000", [EXACT, NOISY, FAILED]),
        ("marked", [NOISY, EXACT, FAILED]),
        ("name", [EXACT, FAILED, NOISY]),
        ("-name", [NOISY, FAILED, EXACT]),
    ],
)
def test_scenes_are_sorted(visitor, key, order):
    page = visitor.open()
    page.get_by_label("Sort by").select_option(key)
    assert names(page) == order
    assert visitor.state().get("sort", "run") == key


def test_the_table_is_sorted_by_its_headings_as_the_cards_are(visitor):
    page = visitor.open()
    page.get_by_role("button", name="Table").click()
    heading = page.locator("th", has=page.locator("[data-sort=dE_ITP]"))
    for expected, first in (("descending", NOISY), ("ascending", EXACT)):
        heading.get_by_role("button").click()
        assert heading.get_attribute("aria-sort") == expected
        assert page.locator(".overview tbody th").first.text_content().strip() == first
    assert visitor.state() == {"sort": "-dE_ITP", "list": "table"}
    page.get_by_role("button", name="Cards").click()
    assert names(page) == [EXACT, NOISY, FAILED]


def test_filters_leave_what_they_name(visitor):
    page = visitor.open()
    show = page.get_by_role("combobox", name="Show")
    show.select_option("significant")
    assert names(page) == [NOISY]
    assert page.locator(".count").text_content() == "1 of 3 scenes"
    show.select_option("failed")
    assert names(page) == [FAILED]
    assert "there is no such file" in page.locator(".card:visible").text_content()
    show.select_option("")
    page.get_by_role("searchbox").fill("EXA")
    assert names(page) == [EXACT]
    other = page.context.new_page()
    other.goto(page.url)
    assert names(other) == [EXACT]


def test_a_card_opens_its_scene_and_the_way_back_leads_back(visitor):
    page = visitor.open()
    page.get_by_role("link", name=EXACT).first.click()
    visitor.wait_for_viewer(EXACT)
    assert page.get_by_role("heading", level=2).all_text_contents()[0] == EXACT
    assert page.locator(".scene:visible").count() == 1
    assert not page.locator("#overview-section").is_visible()
    page.go_back()
    page.wait_for_function("() => document.documentElement.dataset.view === 'overview'")
    assert names(page) == [NOISY, EXACT, FAILED]
