"""A page of one scene, from disk and in a notebook's frame."""

import pytest
from playwright.sync_api import expect

from fotismos.reports.notebook import HEIGHT, Shown
from fotismos.reports.page import page
from fotismos.reports.run import scene_files
from tests.browser.conftest import EXACT, exact

SEEN = "document.documentElement.dataset.view"


@pytest.fixture
def alone():
    """The page's text."""
    return page.render([scene_files.view_of(exact())])


@pytest.fixture
def tab(chromium):
    """A tab, and what is said in it."""
    tab = chromium.new_page()
    said = []
    tab.on("console", lambda message: said.append(message.text))
    tab.on("pageerror", lambda error: said.append(str(error)))
    yield tab
    tab.close()
    assert not said


def test_the_page_begins_with_the_scene_and_leads_to_the_overview(tab, alone, tmp_path):
    place = tmp_path / "index.html"
    place.write_text(alone)
    tab.goto(place.as_uri())
    assert tab.evaluate(SEEN) == "scene"
    tab.get_by_role("link", name="all scenes").click()
    tab.wait_for_function(f"() => {SEEN} === 'overview'")
    assert tab.locator(".bars tbody tr:visible").count() == 1
    tab.get_by_role("link", name=EXACT).first.click()
    tab.wait_for_function(f"() => {SEEN} === 'scene'")


def test_in_a_frame_all_fits_and_works_and_the_address_of_the_notebook_stays(tab, alone, tmp_path):
    notebook = tmp_path / "notebook.html"
    notebook.write_text(Shown(None, alone)._repr_html_())
    tab.set_viewport_size({"width": 960, "height": HEIGHT})
    tab.goto(notebook.as_uri())
    frame = tab.frames[1]
    frame.wait_for_function("() => document.querySelector('#viewer').dataset.ready")
    assert frame.evaluate(SEEN) == "scene"
    place = "(name) => document.querySelector(name).getBoundingClientRect()"
    assert frame.evaluate(f"() => ({place})('#viewer > canvas').width") > 800
    assert frame.evaluate(f"() => ({place})('#viewer .numbers').bottom") <= HEIGHT
    button = frame.get_by_role("button", name="Split")
    button.click()
    assert button.get_attribute("aria-pressed") == "true"
    frame.locator(".scene.open .regions a").first.click()
    expect(frame.locator("#distribution h3")).to_contain_text("selection")  # one frame later
    frame.get_by_role("link", name="all scenes").click()
    assert frame.evaluate(SEEN) == "overview"
    frame.get_by_role("link", name=EXACT).first.click()
    assert frame.evaluate(SEEN) == "scene"
    assert tab.url == notebook.as_uri()
