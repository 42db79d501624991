"""Figures for print: their formats, scales and pixels."""

import re

import numpy as np
import pytest

from fotismos.reports.charts import figures
from fotismos.reports.files import images, results
from tests.shared import records


def test_a_scene_is_written_as_svg_and_pdf_with_its_number(tmp_path):
    figures.write_scene(tmp_path / "figures", "ball", records.comparison())
    found = {path.name: path for path in (tmp_path / "figures").iterdir()}
    found.pop(results.MARK)
    assert set(found) == {"ball.svg", "ball.pdf"}
    for path in found.values():
        content = path.read_bytes()
        assert content.startswith(b"%PDF") if path.suffix == ".pdf" else b"<svg" in content
    titles = [axes.get_title() for axes in figures.strip(records.comparison()).axes]
    assert titles[:3] == ["textbook", "physical", "ΔE2000: mean 4.33 (noise 0.0532)"]


def test_a_strip_keeps_every_pixel():
    made = records.comparison()
    first = figures.strip(made).axes[0].images[0].get_array()
    expected = np.asarray(images.tonemap(made.images.heuristic, 0.5).convert("RGB"))
    np.testing.assert_array_equal(first, expected)


@pytest.mark.parametrize("kind", figures.FORMATS)
def test_files_hold_no_date_and_repeat(kind):
    made = records.comparison()
    first, second = (figures.drawn(figures.strip(made), kind) for _ in range(2))
    assert first == second
    assert not re.search(rb"20\d\d-\d\d-\d\d|CreationDate", first)
