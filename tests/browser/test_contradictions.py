"""One quantity has one value on the page of a scene, wherever it stands."""

import pytest

from fotismos.comparisons.departure.metrics import LEADING
from fotismos.reports.terminal import words
from tests.browser.conftest import NOISY, NOISY_ID

SCENE = f"#scene={NOISY_ID}"

LABELLED = r"""() => {
  const whole = document.querySelector(".scene.open");
  const place = whole.querySelector("#inspector [data-value=position]").textContent.split(": ")[1];
  const terms = /at (\d+, \d+)/.exec(whole.querySelector("#terms h3").textContent)[1];
  const found = [];
  for (const row of whole.querySelectorAll("#inspector tr, #distribution tr, #terms .sum")) {
    if (!row.checkVisibility() || row.closest("thead")) continue;
    const [label, ...cells] = [...row.querySelectorAll("th, td:not(.text)")];
    const values = cells.map(cell => cell.textContent.trim()).join(" ");
    const where = row.closest("#terms") ? terms : row.closest("#inspector") ? place : "whole";
    found.push([`${where}: ${label.textContent.trim().toLowerCase()}`, values]);
  }
  return found;
}"""


def test_a_label_has_one_value_and_the_value_is_the_records(visitor, report):
    page = visitor.open(SCENE)
    found = {}
    for label, value in page.evaluate(LABELLED):
        assert found.setdefault(label, value) == value, label
    lead = report.records[NOISY]["metrics"][LEADING.name]
    (usual,) = (share["value"] for share in lead["visible"] if share["threshold"] == 2)
    pixel = page.locator("[data-value=position]").text_content().removeprefix("Worst pixel: ")
    assert found[f"{pixel}: δe2000"] == words.difference(lead["max"])
    assert found["whole: mean"] == words.difference(lead["mean"])
    assert found["whole: differ visibly"] == words.percent(usual)
    assert words.percent(usual) in page.locator(".scene.open h1").text_content()
    assert f"{pixel}: sum of the terms" in found  # the terms are those of the worst pixel
    visitor.unfold()
    row = page.locator(".scene.open .folded tr").filter(has_text=LEADING.label).first
    mean, *_, largest = row.locator("td").all_text_contents()[:4]
    assert mean.split()[0] == found["whole: mean"]
    assert largest == found[f"{pixel}: δe2000"]


@pytest.mark.parametrize("visitor", [{"viewport": {"width": 1440, "height": 900}}], indirect=True)
def test_all_maps_of_the_error_have_one_scale(visitor):
    page = visitor.open(f"{SCENE}&on=0")
    ends = page.locator(".legend .labels span:last-child, #distribution [data-part=end]")
    assert set(ends.all_text_contents()) == {f"≥ {LEADING.map_range[1]:g}"}
    page.locator("#live summary").click()
    said = f"up to {LEADING.map_range[1]:g} and more"
    assert said in page.locator("#live").text_content()
    visitor.open()
    assert said in page.locator("#overview").text_content()


def test_a_scene_that_the_page_does_not_have_is_named(visitor):
    page = visitor.page
    page.goto(f"{visitor.report.url}#scene=fig-99")
    assert "“fig-99”" in page.locator("#unknown:visible").text_content()
    assert page.locator(".bars").is_visible()
    visitor.open(SCENE)
    visitor.open("#t=3")
    assert not page.locator("#unknown").is_visible()


def test_numbers_stand_in_line_with_the_name_of_their_scene(visitor):
    page = visitor.open()
    row = page.locator(f".bars [data-scene='{NOISY_ID}']")
    middles = []
    for part in ("a", "[data-show=share]"):
        box = row.locator(part).bounding_box()
        middles.append(box["y"] + box["height"] / 2)
    assert abs(middles[0] - middles[1]) <= 1


def test_each_command_is_copied_by_its_button(visitor, report):
    page = visitor.open(SCENE)
    visitor.unfold()
    page.evaluate("navigator.clipboard.writeText = async text => { window.copied = text; }")
    buttons = page.locator(".scene.open [data-copy]")
    copied = []
    for button in buttons.all():
        button.click()
        page.wait_for_function("() => window.copied")
        copied.append(page.evaluate("window.copied"))
        page.evaluate("window.copied = ''")
    assert report.records[NOISY]["command"] in copied
    assert len(set(copied)) == len(copied) >= 1
