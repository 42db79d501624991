"""What holds for the whole page: its policy, without scripts, on paper, for everybody."""

import pytest

from tests.browser.conftest import NOISY_ID, VIEWS, violations


def test_the_policy_stops_what_is_not_the_pages_own(visitor):
    page = visitor.open()
    page.evaluate("""() => {
      const script = document.createElement("script");
      script.textContent = "window.injected = true";
      document.body.append(script);
      const image = document.createElement("img");
      image.src = "http://localhost:1/picture.png";
      document.body.append(image);
    }""")
    assert page.evaluate("window.injected") is None
    stopped = [text for text in visitor.complaints if "Content Security Policy" in text]
    assert len(stopped) == 2
    visitor.complaints.clear()
    visitor.requests.remove("http://localhost:1/picture.png")


@pytest.mark.parametrize(
    "visitor", [{"color_scheme": scheme} for scheme in ("light", "dark")], indirect=True
)
def test_axe_finds_no_violation(visitor):
    for fragment in VIEWS:
        page = visitor.open(fragment)
        if "scene=" in fragment:
            visitor.unfold()
        assert not violations(page), fragment
    page.keyboard.press("?")
    assert not violations(page)
    page.goto(visitor.report.url.replace("index", "details"))
    assert not violations(page)


@pytest.mark.parametrize("visitor", [{"java_script_enabled": False}], indirect=True)
def test_without_scripts_all_scenes_have_small_pictures_numbers_and_charts(visitor):
    page = visitor.page
    page.goto(visitor.report.url)
    assert page.locator(".scene:visible").count() == 2
    assert page.locator(".worst img:visible").count() == 6
    assert page.locator(".scene img:visible").count() >= 6
    assert page.locator(":is(canvas, .controls, .threshold):visible").count() == 0
    assert page.locator(".scene .chart svg:visible").count() == 1
    visitor.unfold()
    assert page.locator(".scene .effects:visible").count() == 2


def test_paper_gets_the_pictures_of_the_open_scene_and_no_controls(visitor):
    page = visitor.open(f"#scene={NOISY_ID}")
    page.emulate_media(media="print")
    visitor.settle()
    assert visitor.canvas().is_visible()
    assert visitor.colour_of(6, 20, pane=2) != visitor.colour_of(30, 12, pane=2)
    assert not page.locator("button:visible, nav.top:visible, [data-threshold]:visible").count()
    assert page.locator(".scene:visible").count() == 1
    visitor.open()
    assert page.locator(".scene:visible").count() == 0
    assert page.locator(".worst img:visible").count() == 6


@pytest.mark.parametrize("visitor", [{"viewport": {"width": 718, "height": 1000}}], indirect=True)
def test_paper_cuts_nothing_off_and_names_the_threshold(visitor):
    for fragment in ("", f"#scene={NOISY_ID}"):
        page = visitor.open(fragment)
        if fragment:
            visitor.unfold()
        page.emulate_media(media="print")
        visitor.settle()
        assert page.evaluate("document.documentElement.scrollWidth") <= 718
        said = page.locator(".threshold:visible").inner_text()
        assert " ".join(said.split()).endswith("differ by more than ΔE2000 2")
    page.goto(visitor.report.url.replace("index", "details"))
    assert page.evaluate("document.documentElement.scrollWidth") <= 718
