"""The viewer of a scene: what it draws and prints is what the files hold."""

from itertools import product
from statistics import mean

import numpy as np
import pytest

from tests.browser.conftest import EXACT, HEIGHT, NOISY, NOISY_ID, WIDTH

SCENE = f"#scene={NOISY_ID}&boxes=0"


def displayed(linear, exposure, curve=lambda x: x):
    """8-bit sRGB of linear light (IEC 61966-2-1), after the exposure and a tone curve."""
    x = np.clip(curve(np.maximum(np.float64(linear) * exposure, 0)), 0, 1)
    return 255 * np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)


def rgb(channels, half, x, y):
    return np.array([channels[f"{half}.{colour}"][y, x] for colour in "RGB"])


def magma(value, top):
    from matplotlib import colormaps

    return 255 * np.array(colormaps["magma"](int(np.clip(256 * value / top, 0, 255)))[:3])


def read(text):
    """The number that a text of the inspector stands for, with its digits as it has them."""
    mantissa, _, power = text.replace("−", "-").partition(" × 10")
    superscripts = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
    return float(f"{mantissa}e{power.translate(superscripts) or 0}")


def test_the_inspector_prints_what_the_exr_holds(visitor, report):
    for pixel in ((30, 12), (4, 3), (0, 0), (47, 31), (17, 20)):
        visitor.open(f"{SCENE}&pixel={pixel[0]},{pixel[1]}")
        check_inspector(visitor.inspected(), report.channels[NOISY], *pixel)


def check_inspector(shown, channels, x, y):
    assert shown["position"] == f"{x}, {y}"
    for half in ("heuristic", "reference"):
        for index, value in enumerate(rgb(channels, half, x, y)):
            assert read(shown[f"{half}.{index}"]) == pytest.approx(value, rel=0.006)
    for name in ("dE2000", "dE_ITP", "dE_CAM16UCS", "ldr_flip"):
        if 0 < channels[f"{name}.Y"][y, x] < 0.01:
            assert shown[name] == "< 0.01"
            continue
        rounding = 0.006 if name == "dE2000" else 0.055
        assert read(shown[name]) == pytest.approx(channels[f"{name}.Y"][y, x], rel=rounding)
    square = product((x // 2 * 2, x // 2 * 2 + 1), (y // 2 * 2, y // 2 * 2 + 1))
    error = mean(max(map(float, rgb(channels, "reference_stderr", *place))) for place in square)
    assert read(shown["standard_error"]) == pytest.approx(error, rel=0.4)
    marked = {0.0: "no", 0.5: "undetermined", 1.0: "yes"}[channels["significant.Y"][y, x]]
    assert shown["significant"] == (marked if y else "not counted")


def test_the_inspector_follows_the_pointer_and_names_a_regions_effect(visitor, report):
    page = visitor.open(f"#scene={EXACT}")
    region = report.records[EXACT]["regions"][0]
    left, top = visitor.place_of(region["x"], region["y"])
    visitor.canvas().hover(position={"x": left, "y": top})
    shown = visitor.inspected()
    assert shown["position"] == f"{region['x']}, {region['y']}"
    assert shown["effect"] == "extended lights"
    left, top = visitor.place_of(0, 31)
    visitor.canvas().hover(position={"x": left, "y": top})
    assert visitor.inspected()["position"] == "0, 31"
    assert not page.locator("#inspector .effect").is_visible()


@pytest.mark.parametrize(
    ("tone", "curve"),
    [
        ("clip", lambda x: x),
        ("reinhard", lambda x: x / (1 + x)),
        ("filmic", lambda x: x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)),
    ],
    ids=["clip", "reinhard", "filmic"],
)
def test_exposure_and_tone_map_change_pixels_as_the_formulas_say(visitor, report, tone, curve):
    for stops in (-3, 0, 2.5):
        visitor.open(f"{SCENE}&mode=flicker&tone={tone}&ev={stops}")
        exposure = report.records[NOISY]["viewing"]["exposure"] * 2**stops
        for x, y in ((30, 12), (24, 14), (8, 28)):
            value = rgb(report.channels[NOISY], "heuristic", x, y)
            # Three digits of a value are up to 0.5 % off: under 1 level, and 1 for rounding.
            expected = displayed(value, exposure, curve)
            np.testing.assert_allclose(visitor.colour_of(x, y), expected, atol=2)


def test_the_divide_parts_textbook_from_physical_and_can_be_dragged(visitor, report):
    page = visitor.open(SCENE)
    exposure = report.records[NOISY]["viewing"]["exposure"]

    def expected(half):
        return displayed(rgb(report.channels[NOISY], half, 20, 28), exposure)

    np.testing.assert_allclose(visitor.colour_of(20, 28), expected("heuristic"), atol=2)
    box = visitor.canvas().bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 50)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] / 10, box["y"] + 50, steps=4)
    page.mouse.up()
    assert float(visitor.state()["split"]) == pytest.approx(0.1, abs=0.01)
    np.testing.assert_allclose(visitor.colour_of(20, 28), expected("reference"), atol=2)


def test_side_by_side_has_three_panes_of_the_same_place(visitor, report):
    page = visitor.open(f"{SCENE}&mode=side&zoom=20&x=30.5&y=12.5&top=20")
    box = visitor.canvas().bounding_box()
    width = (box["width"] - 8) / 3
    channels, exposure = report.channels[NOISY], report.records[NOISY]["viewing"]["exposure"]
    centres = [(place * (width + 4) + width / 2, box["height"] / 2) for place in range(3)]
    halves = [
        displayed(rgb(channels, half, 30, 12), exposure) for half in ("heuristic", "reference")
    ]
    for centre, expected in zip(
        centres, [*halves, magma(channels["dE2000.Y"][12, 30], 20)], strict=True
    ):
        np.testing.assert_allclose(visitor.colour_at(*centre), expected, atol=2)
    visitor.canvas().hover(position={"x": centres[1][0], "y": centres[1][1]})
    assert visitor.inspected()["position"] == "30, 12"
    assert page.locator("[data-legend=dE2000]").is_visible()


def test_error_maps_have_their_colours_and_their_bar(visitor, report):
    page = visitor.open(f"{SCENE}&mode=error")
    channels = report.channels[NOISY]
    for name, top in (("dE2000", 20), ("dE_ITP", 60), ("dE_CAM16UCS", 20), ("ldr_flip", 1)):
        page.get_by_label("Map of the error").select_option(name)
        page.get_by_label("Range").select_option(str(top))
        expected = magma(channels[f"{name}.Y"][16, 30], top)
        np.testing.assert_allclose(visitor.colour_of(30, 16), expected, atol=3)
        bars = page.locator(".legend:visible")
        assert bars.count() == 1
        assert f"≥ {top}" in bars.text_content()
    page.get_by_label("Map of the error").select_option("log2_luminance")
    ratio = np.log2(
        (rgb(channels, "heuristic", 20, 28) @ [0.2126, 0.7152, 0.0722] + 1e-4)
        / (rgb(channels, "reference", 20, 28) @ [0.2126, 0.7152, 0.0722] + 1e-4)
    )
    red, _, blue = visitor.colour_of(20, 28)
    assert (red > blue) == (ratio > 0)
    page.get_by_label("Map of the error").select_option("significant")
    colours = {0.0: (222, 226, 230), 0.5: (240, 201, 119), 1.0: (213, 94, 0)}
    for x, y in ((20, 28), (21, 28), (22, 28), (23, 28), (24, 28)):
        assert visitor.colour_of(x, y) == colours[channels["significant.Y"][y, x]]
    assert visitor.colour_of(20, 0) == (130, 136, 143)


def test_zooming_enlarges_pixels_to_squares(visitor, report):
    page = visitor.open(f"{SCENE}&mode=flicker")
    left, top = visitor.place_of(8, 28)
    visitor.canvas().hover(position={"x": left, "y": top})
    page.keyboard.down("Control")
    for _ in range(6):
        page.mouse.wheel(0, -120)
    page.keyboard.up("Control")
    page.wait_for_timeout(400)  # the gesture's end
    state = visitor.state()
    zoom = float(state["zoom"])
    assert zoom > 3 * visitor.canvas().bounding_box()["width"] / WIDTH
    assert visitor.inspected()["position"] == "8, 28"  # what is under the pointer stays there
    centre = float(state["x"]), float(state["y"])
    x, y = visitor.place_of(8, 28, zoom=zoom, centre=centre)
    half = 0.4 * zoom
    corners = [visitor.colour_at(x + dx, y + dy) for dx in (-half, half) for dy in (-half, half)]
    assert len(set(corners)) == 1
    exposure = report.records[NOISY]["viewing"]["exposure"]
    expected = displayed(rgb(report.channels[NOISY], "heuristic", 8, 28), exposure)
    np.testing.assert_allclose(corners[0], expected, atol=2)


def test_dragging_pans_where_it_is_zoomed(visitor):
    page = visitor.open(f"{SCENE}&mode=error&zoom=40&x=24&y=16")
    box = visitor.canvas().bounding_box()
    page.mouse.move(box["x"] + 300, box["y"] + 200)
    page.mouse.down()
    page.mouse.move(box["x"] + 220, box["y"] + 240, steps=8)
    page.mouse.up()
    state = visitor.state()
    assert float(state["x"]) == pytest.approx(24 + 80 / 40, abs=0.3)
    assert float(state["y"]) == pytest.approx(16 - 40 / 40, abs=0.3)
    assert "pixel" not in state  # a drag marks nothing


def test_buttons_zoom_and_fit_and_a_click_marks_a_pixel(visitor):
    page = visitor.open(SCENE + "&mode=error")
    page.get_by_role("button", name="Zoom in").click()
    assert "zoom" in visitor.state()
    page.get_by_role("button", name="Fit").click()
    assert "zoom" not in visitor.state()
    left, top = visitor.place_of(10, 20)
    visitor.canvas().click(position={"x": left, "y": top})
    assert visitor.state()["pixel"] == "10,20"


@pytest.mark.parametrize("visitor", [{"has_touch": True}], indirect=True)
def test_two_fingers_zoom(visitor):
    page = visitor.open(SCENE + "&mode=error")
    page.evaluate("""() => {
      const canvas = document.querySelector("#viewer canvas");
      canvas.setPointerCapture = () => {};
      const box = canvas.getBoundingClientRect();
      const send = (type, pointerId, x, y) => canvas.dispatchEvent(new PointerEvent(type, {
        pointerId, pointerType: "touch", bubbles: true,
        clientX: box.left + x, clientY: box.top + y }));
      send("pointerdown", 1, 300, 200);
      send("pointerdown", 2, 400, 200);
      send("pointermove", 2, 500, 200);
      send("pointermove", 1, 200, 200);
      send("pointerup", 1, 200, 200);
      send("pointerup", 2, 500, 200);
    }""")
    fit = visitor.canvas().bounding_box()["height"] / HEIGHT
    assert float(visitor.state()["zoom"]) == pytest.approx(3 * fit, rel=0.05)
    assert "pixel" not in visitor.state()


def test_every_key_does_what_the_help_says(visitor):
    page = visitor.open(f"#scene={NOISY_ID}")
    keyboard = page.keyboard
    changes = [
        ("4", "mode", "error"), ("m", "map", "dE_ITP"), ("c", "top", "3"), ("3", "mode", "side"),
        ("t", "tone", "reinhard"), ("b", "best", "1"), ("b", "best", None),
        ("]", "ev", "0.5"), ("[", "ev", None), ("]", "ev", "0.5"),
        ("\\", "ev", None), ("r", "boxes", "0"), ("1", "mode", None), (".", "split", "0.52"),
        (",", "split", None),
    ]  # fmt: skip
    for key, name, value in changes:
        keyboard.press(key)
        assert visitor.state().get(name) == value, key
    keyboard.press("+")
    assert "zoom" in visitor.state()
    keyboard.press("0")
    assert "zoom" not in visitor.state()
    visitor.canvas().focus()
    keyboard.press("ArrowRight")
    first = [int(part) for part in visitor.state()["pixel"].split(",")]
    keyboard.press("Shift+ArrowDown")
    assert visitor.state()["pixel"] == f"{first[0]},{first[1] + 10}"
    keyboard.press("s")
    keyboard.press("Shift+ArrowRight")
    keyboard.press("ArrowDown")
    marked = visitor.state()["pixel"]
    assert visitor.state()["box"] == f"{marked},11,2"
    keyboard.press("Shift+ArrowUp")
    keyboard.press("ArrowLeft")
    assert visitor.state()["box"] == f"{marked},10,1"
    keyboard.press("Escape")
    keyboard.press("Escape")
    assert "box" not in visitor.state()
    assert "pixel" in visitor.state()
    keyboard.press("Escape")
    assert "pixel" not in visitor.state()
    keyboard.press("n")
    visitor.wait_for_viewer(EXACT)
    assert visitor.state()["scene"] == EXACT
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
    view = f"#scene={NOISY_ID}&mode=error&map=dE_ITP&tone=filmic"
    view += "&ev=-1.5&zoom=30&x=20.25&y=10&pixel=7,9"
    page = visitor.open(view)
    colour = visitor.colour_of(20, 10, zoom=30, centre=(20.25, 10))
    page.keyboard.press("]")
    page.keyboard.press("[")
    assert page.evaluate("location.hash") == view
    other = visitor.page.context.new_page()
    other.goto(page.url)
    other.wait_for_function("() => document.querySelector('#viewer').dataset.ready")
    visitor.page = other
    assert visitor.colour_of(20, 10, zoom=30, centre=(20.25, 10)) == colour
    assert visitor.inspected()["position"] == "7, 9"
    assert other.get_by_label("Tone map").input_value() == "filmic"


def test_nonsense_in_the_address_is_passed_over(visitor):
    nonsense = "&mode=x&ev=1e9&zoom=-3&pixel=a,b&split=&toString=1&x=NaN&pixel=900,900"
    visitor.open(f"#scene={NOISY_ID}{nonsense}")
    assert visitor.page.locator("#viewer button[aria-pressed=true]").first.text_content() == "Split"
    assert visitor.inspected()["position"] == "–"


def test_regions_are_boxed_in_the_image(visitor, report):
    visitor.open(f"#scene={NOISY_ID}&mode=flicker")
    region = report.records[NOISY]["regions"][0]
    x, y = region["x"] + region["width"] // 2, region["y"]
    left, top = visitor.place_of(x, y)
    zoom = visitor.canvas().bounding_box()["height"] / HEIGHT
    column = [visitor.colour_at(left, top - zoom / 2 + dy) for dy in (-1, 0, 1)]
    assert any(np.abs(np.subtract(colour, (94, 240, 255))).max() < 30 for colour in column)
