"""The first screen: the verdict, its bars, and the tolerance."""

import pytest

from tests.browser.conftest import EXACT, NOISY, NOISY_ID


def rows(page):
    return page.locator(".bars li").all()


def test_the_first_heading_of_the_page_is_the_verdict(visitor):
    page = visitor.open()
    heading = page.get_by_role("heading", level=2).first
    assert heading.text_content() == "Textbook shading looks right in 1 of 2 scenes."
    assert heading.bounding_box()["y"] < 300


def test_bars_stand_worst_first_and_are_as_long_as_the_departure(visitor, report):
    page = visitor.open()
    assert [row.locator("a").text_content() for row in rows(page)] == [NOISY, EXACT]
    pieces = rows(page)[0].locator(".bar i").all()
    assert len(pieces) == 2  # interreflection and occlusion; one effect makes it worse
    widths = [piece.bounding_box()["width"] for piece in pieces]
    whole = rows(page)[0].locator(".bar").bounding_box()["width"]
    assert sum(widths) / whole == pytest.approx(1 / 1.04, abs=0.01)
    assert widths[0] / widths[1] == pytest.approx(5.895 / 3.141, rel=0.03)


@pytest.mark.parametrize("by_keyboard", [False, True])
def test_a_tolerance_says_which_scenes_pass_and_what_would_do(visitor, by_keyboard):
    page = visitor.open()
    remedy = rows(page)[0].locator(".remedy span:visible")
    assert page.locator("[data-count]").text_content() == "1 of 2 scenes pass."
    assert remedy.text_content() == "full plan, 56.7 ms"
    button = page.get_by_role("button", name="ΔE 5")
    if by_keyboard:
        button.focus()
        page.keyboard.press("Enter")
    else:
        button.click()
    assert button.get_attribute("aria-pressed") == "true"
    assert page.locator("[data-count]").text_content() == "2 of 2 scenes pass."
    assert remedy.text_content() == "good enough"


def test_the_line_stands_at_the_tolerance(visitor):
    page = visitor.open()
    for tolerance in (1, 2, 5):
        page.get_by_role("button", name=f"ΔE {tolerance}").click()
        at, top = page.evaluate(
            """() => {
              const bars = getComputedStyle(document.querySelector(".bars"));
              return [bars.getPropertyValue("--at"), bars.getPropertyValue("--top")].map(Number);
            }"""
        )
        assert at == tolerance
        assert top > 0


def test_a_bar_leads_to_its_scene(visitor):
    page = visitor.open()
    page.locator(f".bars li[data-scene='{NOISY_ID}'] a").click()
    visitor.wait_for_viewer()
    assert not page.locator(".verdict").is_visible()


@pytest.mark.parametrize("visitor", [{"viewport": {"width": 380, "height": 800}}], indirect=True)
def test_a_phone_shows_the_verdict_without_scrolling_sideways(visitor):
    page = visitor.open()
    assert page.get_by_role("heading", level=2).first.bounding_box()["y"] < 800 * 0.6
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
