"""The switches of effects in the viewer, by mouse, keyboard and touch."""

import pytest

from tests.browser.conftest import NOISY_ID
from tests.browser.test_page_at_large import PHONE
from tests.cost_records import EFFECTS, HYBRIDS

SCENE = f"#scene={NOISY_ID}"
NEVER = "microfacets and Fresnel"
"""The effect that the made-up lattice has with all others alone."""


def switch(page, name):
    return page.locator(".switches").get_by_role("button", name=name)


def press(visitor, name, way="mouse"):
    button = switch(visitor.page, name)
    if way == "keyboard":
        button.focus()
        visitor.page.keyboard.press("Space")
    elif way == "touch":
        button.tap(force=True)  # also where it says that it is disabled
    else:
        button.click(force=True)
    visitor.settle()


def numbers(page):
    return page.locator("[data-part=numbers]").text_content()


def grey(value):
    """A linear grey as a byte of sRGB."""
    return 255 * (1.055 * value ** (1 / 2.4) - 0.055)


def hybrid(report, effects):
    """The made-up picture of a hybrid."""
    level = 0.1 * (1 + list(HYBRIDS).index(effects))
    return pytest.approx([grey(level * report.study.record.viewing.exposure)] * 3, abs=4)


WAYS = [({}, "mouse"), ({}, "keyboard"), (PHONE, "touch")]


@pytest.mark.parametrize(("visitor", "way"), WAYS, indirect=["visitor"])
def test_switches_change_the_middle_picture_the_map_and_the_numbers(visitor, report, way):
    page = visitor.open(SCENE)
    left, map_ = visitor.colour_of(40, 22, pane=0), visitor.colour_of(40, 22, pane=2)
    assert "→" not in numbers(page)
    press(visitor, "occlusion", way)
    assert "mean 8.77 → 5.43" in numbers(page)
    assert "100 % → 100 %" in numbers(page)
    assert switch(page, "occlusion").get_attribute("aria-pressed") == "true"
    assert visitor.colour_of(40, 22, pane=1) == hybrid(report, ("occlusion",))
    assert visitor.colour_of(40, 22, pane=0) == left
    assert visitor.colour_of(40, 22, pane=2) != map_
    assert "occlusion, error left" in visitor.canvas().get_attribute("aria-label")
    press(visitor, "interreflection", way)
    press(visitor, "occlusion", way)
    assert "mean 8.77 → 4.32" in numbers(page)
    assert visitor.colour_of(40, 22, pane=1) == hybrid(report, ("interreflection",))
    assert visitor.state()["on"] == "2"
    press(visitor, "interreflection", way)
    assert "on" not in visitor.state()
    assert visitor.colour_of(40, 22, pane=2) == map_


def test_with_all_effects_no_error_is_left(visitor, report):
    page = visitor.open(SCENE)
    for name in ("occlusion", "interreflection", NEVER):
        press(visitor, name)
    assert "100 % → 0 %" in numbers(page)
    assert "mean 8.77 → 0" in numbers(page)
    assert visitor.colour_of(40, 22, pane=1) == hybrid(report, EFFECTS)
    assert visitor.colour_of(40, 22, pane=2) == (0, 0, 0)


@pytest.mark.parametrize(("visitor", "way"), WAYS, indirect=["visitor"])
def test_a_combination_that_was_not_rendered_is_refused_in_words(visitor, way):
    page = visitor.open(SCENE)
    assert switch(page, NEVER).get_attribute("aria-disabled") == "true"
    assert "not rendered" in switch(page, NEVER).get_attribute("title")
    before = numbers(page)
    press(visitor, NEVER, way)
    assert numbers(page) == before
    press(visitor, "occlusion", way)
    press(visitor, "interreflection", way)
    assert switch(page, NEVER).get_attribute("aria-disabled") == "false"
