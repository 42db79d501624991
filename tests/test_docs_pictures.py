"""The first picture of the documentation: its numbers are those of the command."""

import importlib
import re

import numpy as np
import pytest
from PIL import Image

from tests.programs import ROOT


@pytest.fixture
def docs(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "docs")
    return importlib.import_module


def test_picture_and_caption_have_the_numbers_of_the_finding(docs):
    module, removed = docs("hero"), {"occlusion": 6.0, "interreflection": 2.0}
    pictures = {name: Image.new("RGB", (8, 8)) for name in module.PANELS}
    made = module.Hero(pictures, 8.0, 0.75, removed, "./run compare box")
    (caption,) = module.caption(made)
    parts = "`./run compare box`", "mean is 8", "75.0 % of", "occlusion 6", "interreflection 2"
    assert all(words in caption for words in parts)
    *panels, bars = module.picture(made).axes
    assert panels[2].get_title("left") == "ΔE2000, mean 8.00"
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
