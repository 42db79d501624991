"""The viewer of a scene: what it draws and prints is what the files hold."""

import numpy as np
import pytest

from fotismos.comparisons.departure.metrics import log2_luminance_ratio
from tests.browser.conftest import EXACT, HEIGHT, NOISY, NOISY_ID, TOP, WIDTH

SCENE = f"#scene={NOISY_ID}"

COUNTING = """() => {
  const replace = history.replaceState.bind(history);
  window.replaced = 0;
  history.replaceState = (...given) => {
    window.replaced += 1;
    replace(...given);
  };
}"""

TURNING = """(canvas, turn) => {  // at once: a slow machine would pause between turns
  const options = { bubbles: true, cancelable: true, ...turn };
  for (let i = 0; i < 6; i++) canvas.dispatchEvent(new WheelEvent("wheel", options));
}"""


def displayed(linear, exposure):
    """8-bit sRGB of linear light (IEC 61966-2-1), after the exposure."""
    x = np.clip(np.float64(linear) * exposure, 0, 1)
    return 255 * np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)


def rgb(channels, half, x, y):
    return np.array([channels[f"{half}.{colour}"][y, x] for colour in "RGB"])


def box_of(region):
    return [region[key] for key in ("x", "y", "width", "height")]


def difference_colour(value, threshold, top):
    """Grey up to the threshold, then magma from its first quarter on."""
    from matplotlib import colormaps

    if value <= threshold:
        return np.full(3, round(70 * value / threshold))
    place = np.clip(64 + 192 * (value - threshold) / (top - threshold), 64, 255)
    return 255 * np.array(colormaps["magma"](int(place))[:3])


def read(text):
    """The number that a text stands for, with its digits as it has them."""
    mantissa, _, power = text.replace("−", "-").partition(" × 10")
    superscripts = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
    return float(f"{mantissa}e{power.translate(superscripts) or 0}")


def test_a_scene_opens_on_its_worst_pixel_and_its_worst_region(visitor, report):
    page = visitor.open(SCENE)
    left, top, width, _ = box_of(report.records[NOISY]["regions"][0])
    map_ = report.channels[NOISY]["dE2000.Y"][1:]  # the first row does not count
    y, x = np.unravel_index(map_.argmax(), map_.shape)
    shown = visitor.inspected()
    assert shown["position"] == f"Worst pixel: {x}, {y + 1}"
    assert shown["cause"] in ("occlusion", "interreflection")
    assert page.locator("#viewer button[aria-pressed=true]").first.text_content() == "Side by side"
    edge = visitor.place_of(left + width // 2, top, pane=1)
    zoom = (visitor.canvas().bounding_box()["width"] - 16) / 3 / WIDTH
    column = [visitor.colour_at(edge[0], edge[1] - zoom / 2 + dy) for dy in (-1, 0, 1)]
    assert any(np.abs(np.subtract(colour, (94, 240, 255))).max() < 60 for colour in column)


def test_the_inspector_prints_what_the_exr_holds(visitor, report):
    channels = report.channels[NOISY]
    exposure = report.records[NOISY]["viewing"]["exposure"]
    for x, y in ((30, 12), (4, 3), (0, 0), (47, 31), (17, 20)):
        visitor.open(f"{SCENE}&pixel={x},{y}")
        visitor.settle()
        shown = visitor.inspected()
        assert shown["position"].endswith(f" {x}, {y}")
        for half in ("heuristic", "reference"):
            value = rgb(channels, half, x, y)
            found = [read(shown[f"{half}.{index}"]) for index in range(3)]
            np.testing.assert_allclose(found, value, rtol=0.008, atol=6e-5)
            found = [*bytes.fromhex(shown[f"{half}_hex"][1:])]
            np.testing.assert_allclose(found, displayed(value, exposure), atol=1.6)
        assert read(shown["dE2000"]) == pytest.approx(channels["dE2000.Y"][y, x], rel=0.008)
        error = max(map(float, rgb(channels, "reference_stderr", x, y)))
        assert read(shown["standard_error"]) == pytest.approx(error, rel=0.08)
        marked = {0.0: "no", 0.5: "undetermined", 1.0: "yes"}[channels["significant.Y"][y, x]]
        assert shown["significant"] == (marked if y else "not counted")


def test_a_hover_is_inspected_and_moves_nothing(visitor, report):
    page = visitor.open(f"#scene={EXACT}&mode=error")
    region = report.records[EXACT]["regions"][0]
    where = "[...document.querySelectorAll('.side > *, .terms, h3')].map((e) => e.offsetTop)"
    before = page.evaluate(where)
    for pixel, cause in (((region["x"], region["y"]), "extended lights"), ((0, 31), "unknown")):
        visitor.canvas().hover(position=dict(zip("xy", visitor.place_of(*pixel), strict=True)))
        assert visitor.inspected()["position"] == f"Pixel {pixel[0]}, {pixel[1]}"
        assert visitor.inspected()["cause"] == cause
        assert page.evaluate(where) == before


def test_three_panes_show_both_halves_and_the_error(visitor, report):
    channels = report.channels[NOISY]
    for stops in (-3, 0, 2.5):
        visitor.open(f"{SCENE}&ev={stops}&t=3")
        visitor.settle()
        exposure = report.records[NOISY]["viewing"]["exposure"] * 2**stops
        for x, y in ((24, 20), (6, 20), (12, 4), (43, 22)):
            for pane, half in enumerate(("heuristic", "reference")):
                expected = displayed(rgb(channels, half, x, y), exposure)
                np.testing.assert_allclose(visitor.colour_of(x, y, pane=pane), expected, atol=2)
            expected = difference_colour(channels["dE2000.Y"][y, x], 3, TOP)
            np.testing.assert_allclose(visitor.colour_of(x, y, pane=2), expected, atol=4)


def test_the_divide_parts_textbook_from_physical_and_can_be_dragged(visitor, report):
    page = visitor.open(f"{SCENE}&mode=split")
    exposure = report.records[NOISY]["viewing"]["exposure"]

    def expected(half):
        return displayed(rgb(report.channels[NOISY], half, 20, 28), exposure)

    np.testing.assert_allclose(visitor.colour_of(20, 28), expected("heuristic"), atol=2)
    drag(visitor, (0.5, 0.3), (0.1, 0.3))
    assert float(visitor.state()["split"]) == pytest.approx(0.1, abs=0.01)
    np.testing.assert_allclose(visitor.colour_of(20, 28), expected("reference"), atol=2)
    assert page.locator("#viewer button[aria-pressed=true]").first.text_content() == "Split"


def drag(visitor, start, end):
    """Drag over the canvas, between places from 0 to 1."""
    mouse, box = visitor.page.mouse, visitor.canvas().bounding_box()
    places = [(box["x"] + x * box["width"], box["y"] + y * box["height"]) for x, y in (start, end)]
    mouse.move(*places[0])
    mouse.down()
    mouse.move(*places[1], steps=8)
    mouse.up()


def test_maps_of_ratio_and_marks_have_their_colours(visitor, report):
    page = visitor.open(f"{SCENE}&mode=error")
    channels = report.channels[NOISY]
    choice = page.get_by_label("Map of the error")
    choice.select_option("log2_luminance")
    for x, y in ((20, 28), (4, 28), (40, 8)):
        textbook, physical = (rgb(channels, half, x, y) for half in ("heuristic", "reference"))
        red, _, blue = visitor.colour_of(x, y)
        assert (red > blue) == (log2_luminance_ratio([[textbook]], [[physical]]).item() > 0)
    assert "stops" in page.locator(".legend").text_content()
    choice.select_option("significant")
    colours = {0.0: (222, 226, 230), 0.5: (240, 201, 119), 1.0: (213, 94, 0)}
    for x, y in ((20, 28), (21, 28), (22, 28), (4, 28), (4, 20)):
        assert visitor.colour_of(x, y) == colours[channels["significant.Y"][y, x]]
    assert visitor.colour_of(20, 0) == (130, 136, 143)
    assert page.locator(".legend .key").count() == 4


def test_zoom_by_wheel_keeps_the_pixel_and_shows_squares(visitor, report):
    page = visitor.open(f"{SCENE}&mode=split&split=1")
    place = visitor.place_of(8, 28)
    visitor.canvas().hover(position=dict(zip("xy", place, strict=True)))
    page.evaluate(COUNTING)
    box = visitor.canvas().bounding_box()
    client = {"clientX": box["x"] + place[0], "clientY": box["y"] + place[1]}
    visitor.canvas().evaluate(TURNING, {"deltaY": -120, "ctrlKey": True, **client})
    page.wait_for_timeout(600)  # the gesture's end
    assert page.evaluate("window.replaced") == 1  # once for the whole gesture
    zoom, *centre = (float(visitor.state()[key]) for key in ("zoom", "x", "y"))
    assert zoom > 3 * visitor.canvas().bounding_box()["width"] / WIDTH
    assert visitor.inspected()["position"] == "Pixel 8, 28"
    x, y = visitor.place_of(8, 28, zoom=zoom, centre=centre)
    near, far = -0.4 * zoom, 0.4 * zoom
    corners = ((near, near), (near, far), (far, near), (far, far))
    (colour,) = {visitor.colour_at(x + dx, y + dy) for dx, dy in corners}
    value = rgb(report.channels[NOISY], "heuristic", 8, 28)
    expected = displayed(value, report.records[NOISY]["viewing"]["exposure"])
    np.testing.assert_allclose(colour, expected, atol=2)


@pytest.mark.parametrize("visitor", [{"viewport": {"width": 1200, "height": 500}}], indirect=True)
def test_the_wheel_scrolls_the_page_until_a_click_into_the_picture(visitor):
    page = visitor.open(f"{SCENE}&mode=error")
    page.evaluate("window.scrollTo(0, 300)")
    box = visitor.canvas().bounding_box()
    place = box["x"] + 200, max(box["y"], 0) + 100
    page.mouse.move(*place)
    page.mouse.wheel(0, -60)
    page.wait_for_timeout(300)
    assert page.evaluate("window.scrollY") < 300
    assert "zoom" not in visitor.state()
    page.mouse.click(*place)
    before = page.evaluate("window.scrollY")
    page.mouse.wheel(0, -120)
    page.wait_for_timeout(400)  # the gesture's end
    assert page.evaluate("window.scrollY") == before
    assert "zoom" in visitor.state()


def test_every_key_does_what_the_help_says(visitor):
    page = visitor.open(SCENE)
    keyboard = page.keyboard
    changes = [
        ("2", "mode", "split"), ("3", "mode", "error"), ("1", "mode", None), ("]", "t", "2.25"),
        ("[", "t", None), ("m", "map", "effects"), ("+", "zoom", True), ("0", "zoom", None),
    ]  # fmt: skip
    for key, name, value in changes:
        keyboard.press(key)
        found = visitor.state().get(name)
        assert (bool(found) if value is True else found) == value, key
    visitor.canvas().click(position=dict(zip("xy", visitor.place_of(10, 9, pane=0), strict=True)))
    assert visitor.state()["pixel"] == "10,9"
    keyboard.press("ArrowRight")
    keyboard.press("Shift+ArrowDown")
    assert visitor.state()["pixel"] == "11,19"
    keyboard.press("s")
    keyboard.press("Shift+ArrowRight")
    keyboard.press("ArrowDown")
    assert visitor.state()["box"] == "11,19,11,2"
    for left in ({"box", "pixel"}, {"pixel"}, set()):  # Escape by Escape
        keyboard.press("Escape")
        assert {"box", "pixel"} & set(visitor.state()) == left
    keyboard.press("n")
    visitor.wait_for_viewer(EXACT)
    keyboard.press("p")
    visitor.wait_for_viewer()
    keyboard.press("?")
    assert page.get_by_role("dialog").is_visible()
    keyboard.press("Escape")
    assert not page.get_by_role("dialog").is_visible()
    keyboard.press("o")
    page.wait_for_function("() => document.documentElement.dataset.view === 'overview'")
    assert visitor.state() == {}


def test_the_address_holds_the_view(visitor):
    view = f"{SCENE}&t=3.5&mode=error&map=significant&ev=-1.5&zoom=30&x=20.25&y=10&pixel=7,9"
    page = visitor.open(view)
    colour = visitor.colour_of(20, 10, zoom=30, centre=(20.25, 10))
    page.keyboard.press("]")
    page.keyboard.press("[")
    assert page.evaluate("location.hash") == view
    visitor.page = page.context.new_page()
    visitor.page.goto(page.url)
    visitor.wait_for_viewer()
    assert visitor.colour_of(20, 10, zoom=30, centre=(20.25, 10)) == colour
    assert visitor.inspected()["position"] == "Pixel 7, 9"
    nonsense = "&mode=x&ev=1e9&zoom=-3&pixel=a,b&split=&toString=1&x=NaN&t=2.1&on=9&map=?"
    visitor.open(f"{SCENE}{nonsense}")
    assert visitor.inspected()["position"].startswith("Worst pixel:")
    assert visitor.page.locator("#viewer [data-threshold]").input_value() == "2"
    visitor.open(f"{SCENE}&pixel=900,900")
    visitor.settle()
    assert visitor.inspected()["position"] == f"Pixel {WIDTH - 1}, {HEIGHT - 1}"


def test_a_link_to_a_region_selects_it(visitor, report):
    page = visitor.open(SCENE)
    page.locator(".scene.open .regions a").first.click()
    visitor.settle()
    region = report.records[NOISY]["regions"][0]
    assert visitor.state()["box"] == ",".join(map(str, box_of(region)))
    assert page.locator("#distribution h3").text_content() == "ΔE2000 in the selection, with noise"
