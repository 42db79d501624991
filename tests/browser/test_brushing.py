"""Rectangles in the picture and the threshold in the histogram: numbers, maps and links."""

import json

import numpy as np
import pytest

from tests.browser.conftest import EXACT, HEIGHT, NOISY, NOISY_ID, TOP, WIDTH

SCENE = f"#scene={NOISY_ID}&mode=error"


def numbers(page):
    """The panel's numbers by name."""
    cells = page.locator("#distribution td").all()
    return {cell.get_attribute("data-part"): cell.text_content() for cell in cells}


def figure(text):
    return float(text.split(" ")[0].replace(",", ""))


def values(report):
    """The map, and which of its pixels count: all but the first row."""
    map_ = report.channels[NOISY]["dE2000.Y"].astype(float)
    return map_, np.broadcast_to(np.arange(HEIGHT)[:, None] > 0, map_.shape)


@pytest.mark.guarantee("means", "A rectangle drawn in the picture gets its mean, share and cause.")
def test_a_rectangle_has_the_numbers_of_its_pixels_and_its_address(visitor, report):
    page = visitor.open(SCENE)
    box = visitor.canvas().bounding_box()
    places = [visitor.place_of(*pixel) for pixel in ((35, 20), (24, 6))]  # from any corner
    page.keyboard.down("Shift")
    page.mouse.move(box["x"] + places[0][0], box["y"] + places[0][1])
    page.mouse.down()
    page.mouse.move(box["x"] + places[1][0], box["y"] + places[1][1], steps=5)
    page.mouse.up()
    page.keyboard.up("Shift")
    visitor.settle()
    assert visitor.state()["box"] == "24,6,12,15"
    (map_, counted), inside = values(report), values(report)[0][6:21, 24:36]
    shown = numbers(page)
    assert figure(shown["mean"]) == pytest.approx(inside.mean(), rel=0.01)
    assert figure(shown["visible"]) == pytest.approx(100 * (inside > 2).mean(), rel=0.02)
    assert figure(shown["pixels"]) == pytest.approx(100 * inside.size / counted.sum(), rel=0.06)
    share = 100 * inside.sum() / map_[counted].sum()
    assert figure(shown["error"]) == pytest.approx(share, rel=0.01)
    visitor.page = page.context.new_page()
    visitor.page.goto(page.url)
    visitor.wait_for_viewer()
    assert numbers(visitor.page) == shown


def test_a_rectangle_tells_what_is_certain_to_differ_and_how_much_of_it_is_visible(visitor, report):
    page = visitor.open(f"{SCENE}&box=20,8,20,20&t=5")
    marked = report.channels[NOISY]["significant.Y"][8:28, 20:40] == 1
    both = marked & (values(report)[0][8:28, 20:40] > 5)
    told = numbers(page)
    for name, expected in (("certain", marked), ("both", both)):
        assert figure(told[name]) == pytest.approx(100 * expected.mean(), rel=0.02)
    assert 0 < both.sum() < marked.sum() < marked.size


def test_pixels_that_do_not_count_are_in_no_number(visitor, report):
    page = visitor.open(f"{SCENE}&box=0,0,{WIDTH},2")
    assert figure(numbers(page)["mean"]) == pytest.approx(values(report)[0][1].mean(), rel=0.01)
    visitor.open(f"{SCENE}&box=0,0,{WIDTH},1")
    visitor.settle()
    assert figure(numbers(page)["pixels"]) == 0


def test_the_cause_is_that_of_the_effects_or_of_the_regions(visitor, report):
    page = visitor.open(SCENE)
    effects = json.loads(page.locator("#page-data").text_content())["scenes"][0]["effects"]
    removed = dict(zip(effects["names"], effects["parts"], strict=True))
    first = max(removed, key=removed.get)
    said = numbers(page)["cause"]
    assert said.startswith(first)
    assert figure(said.removeprefix(first).strip()) == pytest.approx(100 * removed[first], rel=0.01)
    # In a rectangle, here the left half, by the effect that dominates in each pixel.
    letters = np.array(list(effects["map"])).reshape(effects["height"], effects["width"])
    rows = (np.arange(HEIGHT) + 0.5) / HEIGHT * effects["height"]
    columns = (np.arange(WIDTH) + 0.5) / WIDTH * effects["width"]
    letters = letters[rows.astype(int)][:, columns.astype(int)]
    map_, counted = values(report)
    shown = (map_ * counted)[:, : WIDTH // 2]
    parts = {
        name: 100 * shown[letters[:, : WIDTH // 2] == str(place)].sum() / shown.sum()
        for place, name in enumerate(effects["names"])
    }
    first = max(parts, key=parts.get)
    visitor.open(f"{SCENE}&box=0,0,{WIDTH // 2},{HEIGHT}")
    visitor.settle()
    said = numbers(page)["cause"]
    assert said.startswith(first)
    assert figure(said.removeprefix(first).strip()) == pytest.approx(parts[first], rel=0.01)
    for box, cause in (("10,6,4,4", "extended lights"), ("40,20,4,4", "unknown")):
        visitor.open(f"#scene={EXACT}&box={box}")
        visitor.settle()
        assert numbers(page)["cause"] == cause


def test_bars_are_parts_of_the_pixels_and_a_drag_over_them_moves_the_threshold(visitor, report):
    page, top = visitor.open(SCENE), TOP
    outline = page.locator("[data-part=some]").get_attribute("d")
    heights = [100 - float(part.split("h")[0]) for part in outline.split("V")[1:-1]]
    within = np.minimum(values(report)[0][1:], top * 0.9999)
    expected, _ = np.histogram(within, bins=40, range=(0, top))
    np.testing.assert_allclose(heights, 100 * expected / expected.max(), atol=0.8)
    chart = page.locator("#distribution svg")
    chart.scroll_into_view_if_needed()
    box = chart.bounding_box()
    y = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + 1, y)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] * 4.1 / top, y, steps=4)
    page.mouse.up()
    assert visitor.state()["t"] in ("4", "4.25")
    assert page.locator("#viewer [data-threshold]").input_value() == visitor.state()["t"]
