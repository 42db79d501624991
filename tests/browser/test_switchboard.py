"""The switches of effects in the viewer, by mouse, keyboard and touch."""

import numpy as np
import pytest

from fotismos.comparisons.departure.metrics import LEADING
from tests.browser.conftest import NOISY_ID, PHONE
from tests.shared.cost_records import EFFECTS, HYBRIDS

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


def level(effects):
    """The grey of the made-up picture of a hybrid."""
    return 0.1 * (1 + list(HYBRIDS).index(effects))


def hybrid(report, effects):
    """The made-up picture of a hybrid."""
    return pytest.approx([grey(level(effects) * report.study.record.viewing.exposure)] * 3, abs=4)


WAYS = [({}, "mouse"), ({}, "keyboard"), (PHONE, "touch")]


@pytest.mark.parametrize(("visitor", "way"), WAYS, indirect=["visitor"])
def test_switches_change_the_middle_picture_the_map_and_the_numbers(visitor, report, way):
    page = visitor.open(SCENE)
    left, physical, map_ = (visitor.colour_of(40, 22, pane=pane) for pane in range(3))
    assert not numbers(page)
    press(visitor, "occlusion", way)
    assert "mean without noise 8.77 → 5.43" in numbers(page)
    assert "100 % → 100 %" in numbers(page)
    assert numbers(page).endswith("; at 24 × 16")
    assert switch(page, "occlusion").get_attribute("aria-pressed") == "true"
    assert visitor.colour_of(40, 22, pane=1) == hybrid(report, ("occlusion",))
    assert visitor.colour_of(40, 22, pane=0) == left
    assert visitor.colour_of(40, 22, pane=2) == physical
    assert visitor.colour_of(40, 22, pane=3) != map_
    assert "occlusion, physical, error left" in visitor.canvas().get_attribute("aria-label")
    press(visitor, "interreflection", way)
    press(visitor, "occlusion", way)
    assert "mean without noise 8.77 → 4.32" in numbers(page)
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
    assert "mean without noise 8.77 → 0" in numbers(page)
    assert visitor.colour_of(40, 22, pane=1) == hybrid(report, EFFECTS)
    assert visitor.colour_of(40, 22, pane=3) == (0, 0, 0)


def test_a_combination_that_was_not_rendered_is_refused_in_words(visitor):
    page = visitor.open(SCENE)
    assert switch(page, NEVER).get_attribute("aria-disabled") == "true"
    assert "not rendered" in switch(page, NEVER).get_attribute("title")
    before = numbers(page)
    press(visitor, NEVER)
    assert numbers(page) == before
    press(visitor, "occlusion")
    press(visitor, "interreflection")
    assert switch(page, NEVER).get_attribute("aria-disabled") == "false"


def test_the_panels_have_the_numbers_of_the_picture_with_effects(visitor, report):
    page = visitor.open(f"{SCENE}&pixel=40,22&box=2,8,9,9")
    plain, whole = visitor.inspected(), numbers(page)
    press(visitor, "occlusion")
    viewing, grey_of = report.study.record.viewing, level(("occlusion",))
    halves = (np.full((1, 1, 3), value) for value in (grey_of, level(EFFECTS)))
    left = float(LEADING(*halves, viewing)[0, 0])
    shown = visitor.inspected()
    assert shown["position"] == "Pixel 40, 22 + occlusion, at 24 × 16"
    for half, value in (("heuristic", grey_of), ("reference", level(EFFECTS))):
        found = [float(shown[f"{half}.{channel}"]) for channel in range(3)]
        assert found == pytest.approx([value] * 3, rel=0.01)
        assert int(shown[f"{half}_hex"][1:3], 16) == pytest.approx(
            grey(value * viewing.exposure), abs=2
        )
    assert float(shown["dE2000"]) == pytest.approx(left, rel=0.01)
    assert [shown[name] for name in ("cause", "standard_error", "significant")] == ["–"] * 3
    panel = {
        cell.get_attribute("data-part"): cell.text_content()
        for cell in page.locator("#distribution td").all()
    }
    assert float(panel["mean"]) == pytest.approx(left, rel=0.01)
    assert panel["visible"] == "100 %"
    assert page.locator("#inspector [data-judged]").first.text_content() == "Textbook +"
    press(visitor, "occlusion")
    assert visitor.inspected() == plain
    assert numbers(page) == whole


def test_the_divide_parts_the_picture_with_effects_from_the_physical_one(visitor, report):
    page = visitor.open(f"{SCENE}&mode=split&split=0")
    physical = visitor.colour_of(40, 22)
    press(visitor, "occlusion")
    assert visitor.colour_of(40, 22) == physical
    visitor.open(f"{SCENE}&mode=split&split=1&on=0")
    assert visitor.colour_of(40, 22) == hybrid(report, ("occlusion",))
    visitor.open(f"{SCENE}&ev=1&on=0")
    brighter = grey(2 * level(("occlusion",)) * report.study.record.viewing.exposure)
    assert visitor.colour_of(40, 22, pane=1) == pytest.approx([brighter] * 3, abs=4)
    assert page.locator("[data-part=numbers]").is_visible()
