"""The pictures of the points of the cost chart: hover, focus, click, touch."""

import pytest

from reports import glossary
from reports.files.images import tonemap
from reports.run import cost_files
from tests.browser.conftest import NOISY_ID
from tests.browser.test_page_at_large import PHONE, violations

SCENE = f"#scene={NOISY_ID}"


def level(study, place):
    """The byte of the made-up, even picture of a point."""
    picture = tonemap([*study.points.values()][place], study.record.viewing.exposure)
    return pytest.approx(picture.getpixel((6, 4))[0], abs=3)


def opened(visitor):
    page = visitor.open(SCENE)
    page.locator(".points").scroll_into_view_if_needed()
    page.wait_for_selector(".points[data-ready=yes]")
    return page


def marks(page):
    return page.locator(".scene.open .chart-figure:has(.points) .mark-symbol path")


def shown(page):
    """The middle of the picture shown, and the words beside it."""
    level = page.locator("[data-point=seen]").evaluate(
        """canvas => {
          const context = document.createElement("canvas").getContext("2d");
          context.drawImage(canvas, 0, 0);
          return context.getImageData(6, 4, 1, 1).data[0];
        }"""
    )
    return level, page.locator(".points [role=status]").inner_text()


def test_hover_shows_a_point_and_leaving_shows_the_kept_one(visitor, report):
    page = opened(visitor)
    assert shown(page)[0] == level(report.study, 0)
    marks(page).nth(2).hover()
    found, words = shown(page)
    assert found == level(report.study, 2)
    assert "full plan" in words
    assert "16 samples per pixel: 56.7 ms, mean ΔE2000 1.23" in words
    page.mouse.move(2, 2)
    assert "Phong kernel" in shown(page)[1]


def test_a_click_keeps_a_point(visitor, report):
    page = opened(visitor)
    marks(page).nth(1).click()
    page.mouse.move(2, 2)
    found, words = shown(page)
    assert found == level(report.study, 1)
    assert "4 samples per pixel" in words
    assert [mark.get_attribute("aria-pressed") for mark in marks(page).all()] == [
        "false", "true", "false",
    ]  # fmt: skip


def test_arrows_move_between_points_and_enter_keeps_one(visitor):
    page = opened(visitor)
    marks(page).nth(0).focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowRight")
    assert "16 samples per pixel" in shown(page)[1]
    page.keyboard.press("Enter")
    page.locator("h2:visible").first.focus()
    assert "16 samples per pixel" in shown(page)[1]
    assert page.locator(".mark-symbol path[tabindex='0']").count() == 1


@pytest.mark.parametrize("visitor", [PHONE], indirect=True)
def test_a_finger_beside_a_point_reaches_it(visitor):
    page = opened(visitor)
    marks(page).nth(2).scroll_into_view_if_needed()
    box = marks(page).nth(2).bounding_box()
    page.touchscreen.tap(box["x"] + box["width"] / 2 + 12, box["y"] + box["height"] / 2 + 8)
    assert "16 samples per pixel" in shown(page)[1]


def test_the_page_of_cost_shows_points_and_explains_terms(chromium, report, tmp_path):
    cost_files.write(tmp_path, report.study)
    page = chromium.new_page()
    complaints = []
    page.on("console", lambda message: complaints.append(message.text))
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.goto((tmp_path / "index.html").as_uri())
    page.wait_for_selector(".points[data-ready=yes]")
    page.locator(".chart-figure:has(.points) .mark-symbol path").nth(2).hover()
    found, words = shown(page)
    assert found == level(report.study, 2)
    assert "16 samples per pixel" in words
    page.get_by_role("columnheader", name="first run").hover()
    assert page.locator("#tip").inner_text() == glossary.meanings()["first run"]
    assert not violations(page)
    assert complaints == []
    page.close()
