"""The pictures of the documentation: their numbers are the record's and the kernel's."""

import importlib
import re
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from tests.programs import ROOT


@pytest.fixture
def docs(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "docs")
    return importlib.import_module


@pytest.fixture
def hero(docs):
    module = docs("hero")
    parts = {"occlusion": 6.0, "interreflection": 2.0}
    pictures = {name: Image.new("RGB", (8, 8)) for name in module.PANELS}
    return module, module.Hero(pictures, 8.0, 0.75, parts, "./run compare box")


def test_the_caption_has_the_numbers_of_the_finding(hero):
    module, made = hero
    (caption,) = module.caption(made)
    for words in (
        "`./run compare box`",
        "the mean is 8",
        "75.0 % of",
        "occlusion 6",
        "interreflection 2",
    ):
        assert words in caption


def test_the_first_picture_is_labelled_and_its_bar_is_as_long_as_the_mean(hero):
    module, made = hero
    figure = module.picture(made)
    panels = figure.axes[:3]
    assert [axes.get_title("left") for axes in panels] == [
        "Textbook shading", "Path traced", "ΔE2000, mean 8.00",
    ]  # fmt: skip
    bars = figure.axes[-1]
    written = [text.get_text() for text in bars.texts]
    assert written == ["What is missing", "occlusion 6.00", "interreflection 2.00"]
    widths = [bar.get_width() for bar in bars.patches[:2]]
    assert np.allclose(widths, [0.75 * module.BAR, 0.25 * module.BAR])


def test_the_readme_shows_the_picture_with_the_command_that_makes_its_numbers(docs):
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    (caption,) = re.findall(r"made by ./run docs -->\n\n(\*`.*)\n", text)
    assert f"`./run compare {docs('hero').SCENE}`" in caption
    with Image.open(ROOT / "docs/hero.webp") as picture:
        assert picture.width >= 900
    assert (ROOT / "docs/hero.webp").stat().st_size < 150_000


def test_the_lobes_are_those_of_the_equations(rgb, docs):
    module = docs("model_figures")
    views = np.radians(module.VIEWS)
    light = np.radians(module.INCIDENCE)
    reflected = np.maximum(np.cos(views - light), 0)
    assert np.allclose(module.seen(50.0, k_d=1.0), np.cos(light), atol=1e-6)
    assert np.allclose(module.seen(50.0, k_s=1.0, n=9), reflected**9, atol=1e-5)
    halved = np.maximum(np.cos((views - light) / 2), 0)
    blinn = module.seen(50.0, k_s=1.0, n=9, form="blinn")
    assert np.allclose(blinn, halved**9, atol=1e-5)


def test_every_comparison_of_the_models_has_its_map_below_with_the_legend(docs):
    one = SimpleNamespace(
        heuristic=np.zeros((4, 4, 3)), reference=np.ones((4, 4, 3)), maps={"dE2000": np.eye(4)}
    )
    figure = docs("model_figures").compared(["a", "b"], [one, one])
    *grid, legend = figure.axes
    labels = [axes.texts[0].get_text() for axes in grid[::2]]
    assert (len(grid), labels) == (6, ["textbook", "physical", "ΔE2000"])
    assert legend.get_yticklabels()[-1].get_text() == "≥ 20"
    assert np.ptp(grid[4].images[0].get_array()) > 0
