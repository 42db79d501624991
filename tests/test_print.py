"""Figures for print: their formats and scales, and colours that survive print and eyes."""

import re

import colour
import numpy as np
import pytest

from comparisons.departure.metrics import METRICS
from reports.charts import figures
from reports.files import images, results
from tests import records

SRGB_VIEWING = (64 / np.pi * 0.2, 20.0)


def table_of(colormap):
    digits = bytes.fromhex(images.colour_table(colormap))
    return np.frombuffer(digits, np.uint8).reshape(-1, 3) / 255


def cam16ucs(encoded):
    """J'a'b' of sRGB colours, by colour-science and its own sRGB, not by the project's."""
    xyz = 100 * colour.sRGB_to_XYZ(encoded)
    white = 100 * colour.sRGB_to_XYZ(np.ones(3))
    model = colour.XYZ_to_CAM16(xyz, white, *SRGB_VIEWING, compute_H=False)
    return colour.models.JMh_CAM16_to_CAM16UCS(np.stack((model.J, model.M, model.h), axis=-1))


def seen_with_deuteranopia(encoded):
    """sRGB colours as by an eye without M cones (Machado et al. 2009)."""
    matrix = colour.matrix_cvd_Machado2009("Deuteranomaly", 1.0)
    linear = np.clip(colour.models.eotf_sRGB(encoded) @ matrix.T, 0, 1)
    return colour.models.eotf_inverse_sRGB(linear)


@pytest.mark.parametrize("seen", [np.asarray, seen_with_deuteranopia])
@pytest.mark.parametrize("colormap", [images.ERROR_COLOURS, "viridis"])
def test_the_lightness_of_an_error_map_rises_from_end_to_end(colormap, seen):
    lightness = cam16ucs(seen(table_of(colormap)))[:, 0]
    # One of 255 steps of a channel, to which the table is rounded, is about 0.4 in J'.
    assert np.all(np.diff(lightness) > -0.4)
    assert np.all(np.diff(lightness[::8]) > 0)
    assert lightness[-1] - lightness[0] > 60


@pytest.mark.parametrize("seen", [np.asarray, seen_with_deuteranopia])
def test_a_signed_map_tells_size_by_lightness_and_sign_by_hue(seen):
    places = cam16ucs(seen(table_of(images.SIGNED_COLOURS)))
    middle = places[127:129, 0].mean()
    assert np.all(middle - places[[0, -1], 0] > 50)
    below, above = places[:128][::-1], places[128:]
    for half in (below, above):  # from the middle outwards
        assert np.all(np.diff(half[::8, 0]) < 0)
    apart = np.linalg.norm(below - above, axis=1)
    # A just noticeable difference is about 1; from an eighth of the range on it is tenfold.
    assert np.all(apart[16:] > 10)


def test_a_scene_is_written_as_svg_and_pdf_with_its_number(tmp_path):
    figures.write_scene(tmp_path / "figures", "ball", records.comparison())
    found = {path.name: path for path in (tmp_path / "figures").iterdir()}
    found.pop(results.MARK)
    assert set(found) == {"ball.svg", "ball.pdf"}
    for path in found.values():
        content = path.read_bytes()
        assert content.startswith(b"%PDF") if path.suffix == ".pdf" else b"<svg" in content
    titles = [axes.get_title() for axes in figures.strip(records.comparison()).axes]
    assert titles[:3] == ["heuristic", "reference", "ΔE2000: mean 4.33 (noise 0.0532)"]


def test_every_strip_has_the_metrics_own_range():
    bar = figures.strip(records.comparison()).axes[-1]
    assert bar.get_ylim() == METRICS["dE2000"].map_range
    assert [label.get_text() for label in bar.get_yticklabels()] == ["0", "10", "≥ 20"]


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
