"""Where the pictures stand, how sharp they are, and that their words are whole."""

import pytest

from fotismos.reports.page import templating
from tests.browser.conftest import EXACT, NOISY_ID, PHONE

SCENE = f"#scene={NOISY_ID}"


@pytest.fixture(scope="module")
def run(chromium):
    """A function that runs a function of JavaScript with the scripts of some pictures."""
    folder = templating.TEMPLATES / "viewer"
    parts = ("page", "images", "viewport", "drawing")
    code = "\n".join((folder / f"{part}.js").read_text() for part in parts)
    tab = chromium.new_page()
    tab.set_content("<canvas></canvas>")
    yield lambda function, data=None: tab.evaluate(
        f"data => {{ {code}\n return ({function})(data); }}", data
    )
    tab.close()


@pytest.mark.parametrize("visitor", [{"viewport": {"width": 1440, "height": 900}}], indirect=True)
def test_one_picture_fits_into_the_window(visitor):
    for mode in ("split", "error"):
        visitor.open(f"#scene={EXACT}&mode={mode}")
        visitor.settle()
        box = visitor.canvas().bounding_box()
        assert 450 <= box["height"] <= 900 - box["y"]


@pytest.mark.parametrize("visitor", [PHONE], indirect=True)
def test_on_a_phone_the_pictures_come_before_the_controls(visitor):
    page = visitor.open(SCENE)
    controls = page.locator("#viewer .controls").first.bounding_box()
    assert visitor.canvas().bounding_box()["y"] < controls["y"]


@pytest.mark.parametrize("visitor", [{"viewport": {"width": 1920, "height": 1080}}], indirect=True)
def test_a_wide_window_is_used(visitor):
    for fragment in ("", SCENE):
        width = visitor.open(fragment).locator("main").bounding_box()["width"]
        assert width > 0.95 * 1920


STACKED = """size => {
  const viewport = new Viewport(...size);
  viewport.arrange(3, 1000, 0);
  return viewport.panes.map(pane => [pane.left, pane.top]);
}"""


def test_wide_films_stand_below_each_other_and_others_side_by_side(run):
    assert {left for left, _ in run(STACKED, [300, 100])} == {0}
    assert {top for _, top in run(STACKED, [100, 100])} == {0}


LABELLED = """([text, width]) => {
  const drawing = new Drawing(document.querySelector("canvas"));
  const lines = [];
  drawing.context.fillText = (line, left, top) =>
    lines.push([line, left + drawing.context.measureText(line).width, top]);
  drawing.label(text, { left: 0, top: 0, width, height: 200 }, false);
  return lines;
}"""


def test_a_label_that_is_too_long_for_its_picture_has_more_lines(run):
    text = "+ occlusion + interreflection"
    assert len(run(LABELLED, [text, 400])) == 1
    lines = run(LABELLED, [text, 120])
    assert " ".join(line for line, _, _ in lines) == text
    assert all(right <= 120 and top <= 200 for _, right, top in lines)
    assert len({top for _, _, top in lines}) == len(lines) > 1


SHARPENED = """() => {
  const code = value => VALUES.findIndex(one => one >= value);
  const plane = (size, at) =>
    Uint16Array.from({ length: size * size }, (_, p) => code(at(p % size)));
  const images = (size, at) => {
    const codes = Object.fromEntries(["heuristic", "reference"].flatMap(half =>
      ["R", "G", "B"].map(c => [`${half}.${c}`, plane(size, at)])));
    codes.dE2000 = codes.flags = plane(size, () => 0);
    return { width: size, height: size, block: 1, names: [], codes };
  };
  const scene = { width: 24, height: 24, exposure: 1 };
  // An edge between two pixels of the whole picture, inside of a pixel of the small one.
  const whole = new Painter(scene, images(24, x => (x < 11 ? 0.1 : 0.8)));
  const small = new Painter(scene, images(4, x => [0.05, 0.2083, 0.4, 0.4][x]), whole);
  const fine = sharpened(small, whole);
  return [9, 10, 11, 12].map(x => fine[3 * (24 * 12 + x)]);
}"""


def test_a_small_picture_is_as_sharp_as_the_whole_one(run):
    left, edge, beyond, right = run(SHARPENED)
    assert beyond - edge > 4 * max(edge - left, right - beyond)
    assert beyond - edge > 0.1
