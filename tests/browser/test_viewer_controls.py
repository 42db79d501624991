"""The viewer's controls: each does something or is disabled, and each is large enough."""

import colour
import numpy as np
import pytest
from PIL import Image

from tests.browser.conftest import EXACT, HEIGHT, NOISY, NOISY_ID, WIDTH
from tests.browser.test_viewer import SCENE, displayed, magma, read, rgb

PHONE = {"viewport": {"width": 390, "height": 844}, "is_mobile": True, "has_touch": True}
SMALL = {"viewport": {"width": 360, "height": 640}}


COUNTING = """() => {
  const replace = history.replaceState.bind(history);
  window.replaced = 0;
  history.replaceState = (...given) => {
    window.replaced += 1;
    replace(...given);
  };
}"""


def wheel(visitor, steps=3):
    for _ in range(steps):
        visitor.page.mouse.wheel(0, -120)
    visitor.page.wait_for_timeout(400)  # the gesture's end


@pytest.mark.parametrize("visitor", [{"viewport": {"width": 1200, "height": 500}}], indirect=True)
def test_the_wheel_scrolls_the_page_until_a_click_into_the_picture(visitor):
    page = visitor.open(f"{SCENE}&mode=error")
    page.evaluate("window.scrollTo(0, 500)")
    box = visitor.canvas().bounding_box()
    place = box["x"] + 200, max(box["y"], 0) + 100
    page.mouse.move(*place)
    wheel(visitor, 1)
    assert page.evaluate("window.scrollY") < 500
    assert "zoom" not in visitor.state()
    page.mouse.click(*place)
    before = page.evaluate("window.scrollY")
    page.evaluate(COUNTING)
    wheel(visitor)
    assert page.evaluate("window.scrollY") == before
    assert "zoom" in visitor.state()
    assert page.evaluate("window.replaced") == 1  # once for the whole gesture


def test_what_does_nothing_in_a_mode_is_disabled(visitor):
    page = visitor.open(f"{SCENE}&mode=error")
    of_renderings = [
        page.get_by_label("Tone map"),
        page.get_by_role("slider", name="Exposure"),
        page.get_by_role("button", name="Best exposure"),
    ]
    assert all(control.is_disabled() for control in of_renderings)
    for key in ("t", "]", "b"):
        page.keyboard.press(key)
    assert not {"tone", "ev", "best"} & set(visitor.state())
    assert page.get_by_label("Range").is_visible()
    page.keyboard.press("1")
    assert not any(control.is_disabled() for control in of_renderings)
    assert not page.get_by_label("Range").is_visible()
    assert page.get_by_role("button", name="Fit").is_disabled()
    page.keyboard.press("+")
    visitor.settle()
    assert not page.get_by_role("button", name="Fit").is_disabled()
    visitor.open(f"#scene={EXACT}")
    visitor.settle()
    assert page.get_by_role("button", name="Best exposure").is_disabled()


def test_the_range_of_the_map_is_automatic_and_can_be_set(visitor, report):
    page = visitor.open(f"{SCENE}&mode=error")
    map_ = report.channels[NOISY]["dE2000.Y"].astype(np.float64)
    held = np.quantile(map_[1:], 0.95, method="lower")
    automatic = next(top for top in (1, 2, 5, 10, 20, 40, 100) if top >= held)
    assert automatic != 20
    for chosen, top in (("", automatic), ("5", 5), ("100", 100)):
        page.get_by_label("Range").select_option(chosen)
        for x, y in ((30, 16), (20, 12)):
            np.testing.assert_allclose(
                visitor.colour_of(x, y), magma(map_[y, x], top), atol=8 if top < 10 else 4
            )
        assert f"≥ {top}" in page.locator(".legend:visible").text_content()
    assert visitor.state()["top"] == "100"
    selected = page.locator("[data-control=top] option").first.text_content()
    assert selected == f"automatic: {automatic}"


def test_the_best_exposure_is_one_switch_away(visitor, report):
    page = visitor.open(f"{SCENE}&mode=flicker")
    page.get_by_role("button", name="Best exposure").click()
    assert visitor.state()["best"] == "1"
    record = report.records[NOISY]
    factor = record["metrics"]["dE2000"]["after_exposure"]["exposure"]
    assert factor != 1
    means = record["metrics"]["dE2000"]
    said = page.locator("#viewer .gain").text_content()
    assert [read(text) for text in said.split("ΔE2000 ")[1].split(" → ")] == [
        float(f"{value:.2e}") for value in (means["mean"], means["after_exposure"]["mean"])
    ]
    for half, gain in (("heuristic", factor), ("reference", 1)):
        value = rgb(report.channels[NOISY], half, 8, 28)
        expected = displayed(value, record["viewing"]["exposure"] * gain)
        np.testing.assert_allclose(visitor.colour_of(8, 28), expected, atol=2)
        page.keyboard.press("f")


def test_values_stand_in_pixels_that_are_large(visitor):
    """Text is there at a high zoom and not at a lower one: a pixel has one colour, or more."""
    for zoom, printed in ((34, False), (60, True)):
        for mode in ("flicker", "error"):
            visitor.open(f"{SCENE}&mode={mode}&zoom={zoom}&x=20.5&y=20.5")
            visitor.settle()
            left, top = visitor.place_of(20, 20, zoom=zoom, centre=(20.5, 20.5))
            row = {visitor.colour_at(left + dx, top + dy) for dx in range(-9, 9) for dy in (-2, 2)}
            assert (len(row) > 1) == printed, (zoom, mode)


def test_other_spaces_are_those_of_colour_science(visitor, report):
    page = visitor.open(f"{SCENE}&mode=flicker&ev=1&tone=reinhard&pixel=30,12")
    space = colour.RGB_COLOURSPACES["sRGB"]
    white = colour.CCS_ILLUMINANTS["CIE 1931 2 Degree Standard Observer"]["D65"]
    exposure = report.records[NOISY]["viewing"]["exposure"]
    for x, y in ((30, 12), (8, 28), (4, 3)):
        visitor.open(f"{SCENE}&mode=flicker&ev=1&tone=reinhard&pixel={x},{y}")
        shown = visitor.inspected()
        for half in ("heuristic", "reference"):
            value = rgb(report.channels[NOISY], half, x, y).astype(np.float64)
            matrix = colour.normalised_primary_matrix(space.primaries, white)
            found = [read(shown[f"{half}_xyz.{axis}"]) for axis in range(3)]
            np.testing.assert_allclose(found, matrix @ value, rtol=0.02, atol=2e-5)
            lab = colour.XYZ_to_Lab(matrix @ np.clip(value * exposure, 0, 1), white)
            found = [read(shown[f"{half}_lab.{axis}"]) for axis in range(3)]
            np.testing.assert_allclose(found, lab, atol=0.6)
            levels = displayed(value, 2 * exposure, lambda light: light / (1 + light))
            text = shown[f"{half}_hex"]
            found = [int(text[place : place + 2], 16) for place in (1, 3, 5)]
            np.testing.assert_allclose(found, levels, atol=1.6)
    assert page.locator("#inspector .hex").first.is_visible()


def test_the_picture_is_saved_as_it_is_seen(visitor, tmp_path):
    page = visitor.open(f"{SCENE}&mode=error&map=dE_ITP&box=3,4,10,12")
    visitor.settle()
    expected = [visitor.colour_of(x, 20) for x in (5, 25, 40)]
    places = [visitor.place_of(x, 20) for x in (5, 25, 40)]
    for press in (
        lambda: page.get_by_role("button", name="Save picture").click(),
        lambda: page.keyboard.press("d"),
    ):
        with page.expect_download() as download:
            press()
        assert download.value.suggested_filename == f"{NOISY_ID}-error-dE_ITP-3,4+10x12.png"
    download.value.save_as(tmp_path / "saved.png")
    image = np.asarray(Image.open(tmp_path / "saved.png"))
    box = visitor.canvas().bounding_box()
    height, width = round(box["height"]), round(box["width"])
    assert image.shape[:2] == (height, width)
    for (left, top), seen in zip(places, expected, strict=True):
        np.testing.assert_array_equal(image[int(top), int(left), :3], seen)


@pytest.mark.parametrize("visitor", [{}, PHONE], indirect=True)
def test_a_link_to_a_region_never_shrinks_the_picture(visitor, report):
    page = visitor.open(f"{SCENE}&mode=error&top=20&zoom=2&x=24&y=16")
    whole = visitor.canvas().bounding_box()
    map_ = report.channels[NOISY]["dE2000.Y"]
    fit = min(whole["width"] / WIDTH, whole["height"] / HEIGHT)
    centre = visitor.place_of(24, 16, zoom=fit, centre=(24, 16))
    corner = centre[0] + (30 - 24) * fit, centre[1] + (20 - 16) * fit
    np.testing.assert_allclose(visitor.colour_at(*corner), magma(map_[20, 30], 20), atol=3)
    visitor.open(f"#scene={NOISY_ID}")
    page.locator(".scene.open .regions a").first.click()
    visitor.settle()
    region = report.records[NOISY]["regions"][0]
    box = ",".join(str(region[key]) for key in ("x", "y", "width", "height"))
    assert visitor.state()["box"] == box
    assert page.locator("#distribution h3").text_content() == "ΔE2000 in the selection"
