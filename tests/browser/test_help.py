"""Help on terms, targets, the skip link, and the phone's first screen: a walk over the page."""

import pytest

from fotismos.reports import glossary
from tests.browser.conftest import NOISY_ID, PHONE, VIEWS

SCENE = f"#scene={NOISY_ID}"

PLAIN = {
    "", "scene", "material", "materials", "mean", "max", "name", "r", "g", "b", "a", "x", "y", "z",
    "l", "pixel", "pixels", "metric", "shape", "of the pixels", "term", "in numbers", "cause",
    "together", "keys", "time", "lights", "passes", "all passes", "first pass",
}  # fmt: skip
"""Headings in everyday words, and names of axes."""

HEADINGS = """() => [...document.querySelectorAll("thead th, .pixel th, dt")].filter((one) =>
  one.checkVisibility() && !one.dataset.term && !one.querySelector("[data-term]")
  && !one.closest(".reading, .records, .keys, .terms tbody"))
  .map((one) => one.innerHTML.replace(/<[^>]*>/g, " ").toLowerCase()
    .replace(/[^\\p{L}\\p{N}%]+/gu, " ").trim())"""

SMALL = """() => [...document.querySelectorAll(
    "button, select, input, summary, nav a, .bars a, .regions a, .carriers a, .actions a")]
  .filter((one) => one.checkVisibility())
  .map((one) => [one.outerHTML.slice(0, 90), one.getBoundingClientRect()])
  .filter(([, box]) => box.width && Math.min(box.height, box.width) < 31.9)
  .map(([name]) => name)"""

CLIPPED = """() => [...document.querySelectorAll("body *")].filter((one) =>
    one.checkVisibility() && !one.closest(".scroll, svg, .equation, .skip, pre"))
  .filter((one) => one.getBoundingClientRect().right > document.documentElement.clientWidth + 1
    || (one.matches("button, select, summary, label") && one.scrollWidth > one.clientWidth + 1))
  .map((one) => one.outerHTML.slice(0, 90))"""


def test_hover_and_focus_tell_what_a_term_means(visitor):
    page = visitor.open(SCENE)
    tip = page.locator("#tip")
    assert tip.is_hidden()
    page.locator("#inspector").get_by_text("Standard error", exact=True).hover()
    assert tip.text_content() == glossary.meanings()["standard error"]
    page.mouse.move(1, 1)
    assert tip.is_hidden()
    field = page.get_by_label("Map of the error")
    field.focus()
    assert tip.text_content() == glossary.meanings()["map of the error"]
    assert field.get_attribute("aria-describedby") == "tip"
    page.keyboard.press("Escape")
    assert tip.is_hidden()
    assert visitor.state()["scene"] == NOISY_ID


def test_no_term_is_without_help(visitor):
    for fragment in ("", SCENE):
        page = visitor.open(fragment)
        visitor.unfold()
        headings = page.evaluate(HEADINGS)
        found = {n for n in headings if not n.isdigit() and not n.startswith("one image of ")}
        assert found - PLAIN == set(), fragment


@pytest.mark.parametrize(
    "visitor", [{}, PHONE, {"viewport": {"width": 320, "height": 640}}], indirect=True
)
def test_targets_are_large_enough_and_nothing_is_clipped(visitor):
    for fragment in VIEWS:
        page = visitor.open(fragment)
        visitor.unfold()
        width = page.evaluate("document.documentElement.scrollWidth - window.innerWidth")
        assert width <= 0, fragment
        assert page.evaluate(SMALL) == [], fragment
        assert page.evaluate(CLIPPED) == [], fragment


def test_the_first_tab_skips_to_the_results(visitor):
    page = visitor.open()
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.className") == "skip"
    page.keyboard.press("Enter")
    page.wait_for_function("() => document.activeElement.id === 'main'")
    visitor.open(SCENE)
    page.locator(".skip").focus()
    page.keyboard.press("Enter")
    assert visitor.state()["scene"] == NOISY_ID
    page.wait_for_function("() => document.activeElement.id === 'main'")
