"""The switchboard of effects, by mouse, keyboard and touch."""

import pytest

from tests.browser.conftest import EXACT, NOISY_ID
from tests.browser.test_page_at_large import PHONE, violations
from tests.cost_records import EFFECTS, HYBRIDS

SCENE = f"#scene={NOISY_ID}"
NEVER = "microfacets and Fresnel"
"""The effect that the made-up lattice has with all others alone."""


def opened(visitor):
    page = visitor.open(SCENE)
    page.wait_for_selector(".scene.open .switchboard[data-ready=yes]")
    return page


def switch(page, name):
    return page.locator(".scene.open .switches").get_by_role("button", name=name)


def press(page, name, way):
    button = switch(page, name)
    if way == "keyboard":
        button.focus()
        page.keyboard.press("Space")
    elif way == "touch":
        button.tap(force=True)  # also where it says that it is disabled
    else:
        button.click(force=True)


def gain(page):
    return page.locator(".scene.open .remains").text_content()


def colour(page, canvas, x=0.5, y=0.5):
    """The colour of a canvas at a place from 0 to 1."""
    return page.evaluate(
        """([canvas, x, y]) => {
          const element = document.querySelector(`.scene.open canvas[${canvas}]`);
          const copy = document.createElement("canvas");
          copy.width = copy.height = 1;
          const context = copy.getContext("2d", { willReadFrequently: true });
          const [left, top] = [x * element.width, y * element.height].map(Math.floor);
          context.drawImage(element, -left, -top);
          return [...context.getImageData(0, 0, 1, 1).data.slice(0, 3)];
        }""",
        [canvas, x, y],
    )


def grey(value):
    """A linear grey as a byte of sRGB."""
    return 255 * (1.055 * value ** (1 / 2.4) - 0.055)


def preview(report, effects):
    """What the made-up preview of a hybrid shows."""
    level = 0.1 * (1 + list(HYBRIDS).index(effects))
    return pytest.approx([grey(level * report.study.record.viewing.exposure)] * 3, abs=4)


WAYS = [({}, "mouse"), ({}, "keyboard"), (PHONE, "touch")]


@pytest.mark.parametrize(("visitor", "way"), WAYS, indirect=["visitor"])
def test_switches_put_picture_error_and_time_together(visitor, report, way):
    page = opened(visitor)
    assert gain(page) == "ΔE2000 8.77, 1.20 ms"
    assert colour(page, "data-board=seen") == preview(report, ())
    assert colour(page, "data-board=whole") == preview(report, EFFECTS)
    press(page, "occlusion", way)
    assert gain(page) == "ΔE2000 8.77 → 5.43, 1.20 ms → 23.4 ms"
    assert switch(page, "occlusion").get_attribute("aria-pressed") == "true"
    assert colour(page, "data-board=seen") == preview(report, ("occlusion",))
    press(page, "interreflection", way)
    press(page, "occlusion", way)
    assert gain(page) == "ΔE2000 8.77 → 4.32, 1.20 ms → 34.5 ms"
    assert colour(page, "data-board=seen") == preview(report, ("interreflection",))
    label = page.locator(".scene.open [data-board=seen]").get_attribute("aria-label")
    assert label == "Preview: Textbook shading + interreflection"


def test_an_error_below_what_can_be_told_reads_so(visitor):
    page = opened(visitor)
    for name in ("occlusion", "interreflection", NEVER):
        press(page, name, "mouse")
    assert gain(page) == "ΔE2000 8.77 → < 0.01, 1.20 ms → 55.7 ms"


@pytest.mark.parametrize(("visitor", "way"), WAYS, indirect=["visitor"])
def test_a_combination_that_was_not_rendered_is_refused_in_words(visitor, way):
    page = opened(visitor)
    assert switch(page, NEVER).get_attribute("aria-disabled") == "true"
    before = gain(page)
    press(page, NEVER, way)
    refused = page.locator(".scene.open [data-board=refused]")
    assert refused.text_content() == (
        f"Textbook shading + {NEVER} was not rendered. Switch another effect first."
    )
    assert gain(page) == before
    press(page, "occlusion", way)
    assert refused.is_hidden()
    press(page, "interreflection", way)
    assert switch(page, NEVER).get_attribute("aria-disabled") == "false"


def test_a_scene_without_causes_has_no_switchboard(visitor):
    page = visitor.open(f"#scene={EXACT}")
    assert page.locator(".scene.open .switchboard").count() == 0


@pytest.mark.parametrize("visitor", [{}, {"color_scheme": "dark"}, PHONE], indirect=True)
def test_axe_finds_no_violation_while_effects_are_on(visitor):
    page = opened(visitor)
    for name in ("occlusion", NEVER):
        press(page, name, "mouse")
    assert not violations(page)
    for button in page.locator(".scene.open .switches button").all():
        assert button.bounding_box()["height"] >= 32
