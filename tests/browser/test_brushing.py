"""Rectangles in the picture and bands of the histogram: numbers, lights and links."""

import json

import numpy as np
import pytest

from tests.browser.conftest import EXACT, HEIGHT, NOISY, NOISY_ID, WIDTH

SCENE = f"#scene={NOISY_ID}&mode=error&boxes=0&top=20"
PHONE = {"viewport": {"width": 390, "height": 844}, "is_mobile": True, "has_touch": True}
LIT = (94, 240, 255)


def drag(visitor, start, end, shift=True):
    """Drag with the mouse from one pixel of the image to another."""
    page, box = visitor.page, visitor.canvas().bounding_box()
    places = [visitor.place_of(*pixel) for pixel in (start, end)]
    if shift:
        page.keyboard.down("Shift")
    page.mouse.move(box["x"] + places[0][0], box["y"] + places[0][1])
    page.mouse.down()
    page.mouse.move(box["x"] + places[1][0], box["y"] + places[1][1], steps=5)
    page.mouse.up()
    if shift:
        page.keyboard.up("Shift")
    visitor.settle()


def swipe(page, selector, start, end):
    """A finger that goes from one place of an element to another, in CSS pixels."""
    page.evaluate(
        """([selector, from, to]) => {
          const element = document.querySelector(selector);
          element.setPointerCapture = () => {};
          const box = element.getBoundingClientRect();
          const send = (type, [x, y]) => element.dispatchEvent(new PointerEvent(type, {
            pointerId: 1, pointerType: "touch", bubbles: true,
            clientX: box.left + x, clientY: box.top + y }));
          send("pointerdown", from);
          send("pointermove", from.map((value, axis) => (value + to[axis]) / 2));
          send("pointermove", to);
          send("pointerup", to);
        }""",
        [selector, start, end],
    )


def numbers(page):
    """The panel's numbers by name."""
    rows = page.locator("#distribution dl div").all()
    return {row.locator("dt").text_content(): row.locator("dd").text_content() for row in rows}


def chart(page):
    """Where the histogram is on the screen."""
    page.locator("#distribution svg").scroll_into_view_if_needed()
    return page.locator("#distribution svg").bounding_box()


def figure(text):
    return float(text.split(" ")[0].replace(",", ""))


def values(report, name="dE2000"):
    """A map as half floats, and which of its pixels count: all but the first row."""
    rounded = report.channels[NOISY][f"{name}.Y"].astype(np.float16)
    return rounded.astype(float), np.arange(HEIGHT)[:, None] > 0


@pytest.mark.guarantee(
    "means",
    "A rectangle drawn in the picture gets its mean, its share and its cause.",
)
def test_a_rectangle_has_the_numbers_of_its_pixels(visitor, report):
    page = visitor.open(SCENE)
    drag(visitor, (35, 20), (24, 6))  # from any corner
    assert visitor.state()["box"] == "24,6,12,15"
    map_, counted = values(report)
    inside = map_[6:21, 24:36]
    shown = numbers(page)
    assert figure(shown["Mean"]) == pytest.approx(inside.mean(), rel=0.005)
    assert figure(shown["Pixels"]) == inside.size
    share = 100 * inside.sum() / (map_ * counted).sum()
    assert figure(shown["Of the departure"]) == pytest.approx(share, rel=0.01)
    assert "selection" in page.locator("#distribution h3").text_content()


def test_pixels_that_do_not_count_are_in_no_number(visitor, report):
    page = visitor.open(f"{SCENE}&box=0,0,{WIDTH},2")
    assert figure(numbers(page)["Pixels"]) == WIDTH
    expected = values(report)[0][1].mean()
    assert figure(numbers(page)["Mean"]) == pytest.approx(expected, rel=0.006)
    visitor.open(f"{SCENE}&box=0,0,{WIDTH},1")
    visitor.settle()
    assert figure(numbers(page)["Pixels"]) == 0


def test_the_cause_is_that_of_the_priced_effects_or_of_the_regions(visitor, report):
    page = visitor.open(f"{SCENE}&box=0,0,{WIDTH},{HEIGHT}")
    data = json.loads(page.locator("#page-data").text_content())
    effects = data["scenes"][0]["effects"]
    letters = np.array(list(effects["map"])).reshape(effects["height"], effects["width"])
    rows = (np.arange(HEIGHT) + 0.5) / HEIGHT * effects["height"]
    columns = (np.arange(WIDTH) + 0.5) / WIDTH * effects["width"]
    letters = letters[rows.astype(int)][:, columns.astype(int)]
    map_, counted = values(report)
    names = dict(enumerate(effects["names"]))
    parts = {
        names[place]: 100 * (map_ * counted)[letters == str(place)].sum() / (map_ * counted).sum()
        for place in names
    }
    first = max(parts, key=parts.get)
    assert numbers(page)["Cause"].startswith(first)
    said = figure(numbers(page)["Cause"].removeprefix(first).strip())
    assert said == pytest.approx(parts[first], rel=0.01)
    visitor.open(f"#scene={EXACT}&box=10,6,4,4")
    visitor.settle()
    assert numbers(page)["Cause"] == "extended lights"
    visitor.open(f"#scene={EXACT}&box=40,20,4,4")
    visitor.settle()
    assert numbers(page)["Cause"] == "unknown"


def test_the_address_brings_a_selection_to_somebody_else(visitor):
    page = visitor.open(SCENE)
    drag(visitor, (4, 4), (20, 20))
    before = numbers(page)
    link = page.get_by_role("link", name="Link to this").get_attribute("href")
    assert page.url.endswith(link)
    visitor.page = page.context.new_page()
    visitor.page.goto(page.url)
    visitor.wait_for_viewer()
    assert numbers(visitor.page) == before


def test_dragging_over_bars_lights_up_their_pixels(visitor, report):
    page = visitor.open(SCENE)
    box = chart(page)
    y = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + box["width"] * 0.26, y)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] * 0.74, y, steps=4)
    page.mouse.up()
    assert visitor.state()["band"] == "5,15"
    check_lights(visitor, report, 5, 15)
    map_, counted = values(report)
    lit = (map_ >= 5) & (map_ < 15) & counted
    said = page.locator("[data-part=lit]").text_content()
    assert f"{lit.sum():,} pixels" in said
    share = 100 * map_[lit].sum() / (map_ * counted).sum()
    assert figure(said.split("with ")[1]) == pytest.approx(share, rel=0.01)


def check_lights(visitor, report, low, high):
    """Lit pixels are near the light's colour, the others darker than in the map."""
    map_, _ = values(report)
    seen = {True: 0, False: 0}
    for x in range(2, WIDTH, 5):
        for y in (4, 9, 12, 17, 22):
            inside = bool(low <= map_[y, x] < high)
            red, green, blue = visitor.colour_of(x, y)
            assert (green > 140 and blue > 140) == inside, (x, y, map_[y, x], (red, green, blue))
            seen[inside] += 1
    assert min(seen.values()) > 3


def test_a_band_is_of_the_rectangle_where_there_is_one(visitor, report):
    page = visitor.open(f"{SCENE}&box=20,4,20,16&band=5,15")
    map_, _ = values(report)
    inside = map_[4:20, 20:40]
    lit = ((inside >= 5) & (inside < 15)).sum()
    assert f"{lit:,} pixels" in page.locator("[data-part=lit]").text_content()


def test_bars_are_parts_of_the_pixels_in_them(visitor, report):
    page = visitor.open(SCENE)
    outline = page.locator("[data-part=some]").get_attribute("d")
    heights = [100 - float(part.split("h")[0]) for part in outline.split("V")[1:-1]]
    map_, counted = values(report)
    expected, _ = np.histogram(np.minimum(map_[1:], 19.99), bins=40, range=(0, 20))
    np.testing.assert_allclose(heights, 100 * expected / expected.max(), atol=0.6)
    tallest = page.locator("[data-part=tallest]").text_content()
    assert figure(tallest.split(": ")[1]) == pytest.approx(
        100 * expected.max() / counted.repeat(WIDTH, axis=1).sum(), rel=0.01
    )


@pytest.mark.parametrize("visitor", [PHONE], indirect=True)
def test_fingers_select_and_brush_on_a_phone(visitor, report):
    page = visitor.open(SCENE)
    page.get_by_role("button", name="Select").tap()
    places = [list(visitor.place_of(*pixel)) for pixel in ((10, 5), (29, 24))]
    swipe(page, "#viewer canvas", *places)
    visitor.settle()
    assert visitor.state()["box"] == "10,5,20,20"
    inside = values(report)[0][5:25, 10:30]
    assert figure(numbers(page)["Mean"]) == pytest.approx(inside.mean(), rel=0.005)
    box = page.locator("#distribution svg").bounding_box()
    swipe(page, "#distribution svg", [2, 20], [box["width"] * 0.49, 20])
    visitor.settle()
    assert visitor.state()["band"] == "-Infinity,10"
    page.get_by_role("button", name="Clear").tap()
    assert not {"box", "band"} & set(visitor.state())
