"""Term by term: the numbers at the pixel that is picked."""

import pytest

from tests.browser.conftest import EXACT, HEIGHT, NOISY_ID, WIDTH, WORST
from tests.shared import term_grids

SCENE = f"#scene={NOISY_ID}&mode=error"
PHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True}
GRID = term_grids.grid((WIDTH, HEIGHT), WORST)


def shown_rows(page):
    """Return the table's rows by name, as texts of their cells, in order; a light's go by it."""
    rows, light = {}, ""
    for line in page.locator("#terms tbody tr").all():
        name, *cells = (text.strip() for text in line.locator("th, td").all_text_contents())
        light = name if "light" in (line.get_attribute("class") or "") else light
        is_whole = name in ("ambient", "sum of the terms", "physical", light)
        rows[name if is_whole else f"{light} {name}"] = cells
    return rows


def values(cells):
    return [float(text.replace("< ", "")) for text in cells[1:]]


def pick(visitor, x, y, how):
    by_keys = how == "keys"
    first = visitor.place_of(x - 3, y - 10) if by_keys else visitor.place_of(x, y)
    act = visitor.canvas().tap if how == "touch" else visitor.canvas().click
    act(position=dict(zip("xy", first, strict=True)))
    if by_keys:
        visitor.canvas().focus()
        for key in (*["ArrowRight"] * 3, "Shift+ArrowDown"):
            visitor.page.keyboard.press(key)
    visitor.settle()


@pytest.mark.parametrize(
    ("visitor", "how"), [({}, "click"), ({}, "keys"), (PHONE, "touch")], indirect=["visitor"]
)
def test_the_terms_are_those_of_the_pixel(visitor, how):
    page = visitor.open(SCENE)
    for x, y in ((9, 14), (37, 22)):
        pick(visitor, x, y, how)
        expected = GRID.at(x, y)
        place = "at {}, {}, the nearest to ".format(*expected.pixel)
        place += f"{x}, {y}: {expected.material.name}"
        assert page.locator("#terms h3").text_content().endswith(place)
        rows = shown_rows(page)
        assert values(rows["sum of the terms"]) == pytest.approx(expected.total, rel=6e-3)
        assert values(rows["ambient"]) == pytest.approx(expected.ambient, rel=6e-3)
        for light in expected.lights:
            assert values(rows[f"{light.name} diffuse"]) == pytest.approx(light.diffuse, rel=6e-3)
            specular = values(rows[f"{light.name} specular"])
            assert specular == pytest.approx(light.specular, rel=1e-2, abs=1.1e-4)


def test_the_reference_is_that_of_the_pixel_of_the_terms(visitor, report):
    page = visitor.open(SCENE)
    pick(visitor, 37, 22, "click")
    x, y = GRID.at(37, 22).pixel
    pick(visitor, x, y, "click")
    texts = visitor.inspected()
    physical = shown_rows(page)["physical"]
    assert physical[1:] == [texts[f"reference.{channel}"] for channel in range(3)]
    assert texts["standard_error"] in physical[0]


def test_the_background_and_other_shading_say_that_there_are_no_terms(visitor):
    page = visitor.open(SCENE)
    pick(visitor, 20, 1, "click")
    assert "no surface is seen" in page.locator("#terms h3").text_content()
    assert list(shown_rows(page)) == ["physical"]
    visitor.open(f"#scene={EXACT}")
    assert "Flat shading" in page.locator("#terms .note").text_content()
    assert not page.locator("#terms table").is_visible()
