"""Figures for print: their formats and scales, and colours that survive print and eyes."""

import json
import re
from dataclasses import replace

import colour
import numpy as np
import pytest
from msgspec import structs

from comparisons.departure.metrics import METRICS, drawn
from comparisons.departure.statistics import histogram
from reports.charts import figures
from reports.files import images
from reports.run import results
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
@pytest.mark.parametrize("colormap", [images.ERROR_COLOURS, images.VALUE_COLOURS])
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


def comparison():
    made = records.comparison()
    histograms = {name: histogram(made.images.maps[name]) for name in drawn()}
    return replace(made, record=structs.replace(made.record, histograms=histograms))


def test_a_scene_is_written_as_svg_and_pdf_with_its_number(tmp_path):
    figures.write_scene(tmp_path / "figures", "ball", comparison())
    names = ["ball", *(f"ball-histogram-{metric}" for metric in drawn())]
    found = {path.name: path for path in (tmp_path / "figures").iterdir()}
    found.pop(results.MARK)
    assert set(found) == {f"{name}.{kind}" for name in names for kind in ("svg", "pdf")}
    for path in found.values():
        content = path.read_bytes()
        assert content.startswith(b"%PDF") if path.suffix == ".pdf" else b"<svg" in content
    titles = [axes.get_title() for axes in figures.strip(comparison()).axes]
    assert titles[:3] == ["heuristic", "reference", "ΔE2000: mean 4.33 (noise 0.0532)"]


def test_every_strip_has_the_metrics_own_range():
    bar = figures.strip(comparison()).axes[-1]
    assert bar.get_ylim() == METRICS["dE2000"].map_range
    assert [label.get_text() for label in bar.get_yticklabels()] == ["0", "10", "≥ 20"]


def test_a_strip_keeps_every_pixel():
    made = comparison()
    first = figures.strip(made).axes[0].images[0].get_array()
    expected = np.asarray(images.tonemap(made.images.heuristic, 0.5).convert("RGB"))
    np.testing.assert_array_equal(first, expected)


@pytest.mark.parametrize("kind", figures.FORMATS)
def test_files_hold_no_date_and_repeat(kind):
    made = comparison()
    first, second = (figures.drawn(figures.strip(made), kind) for _ in range(2))
    assert first == second
    assert not re.search(rb"20\d\d-\d\d-\d\d|CreationDate", first)


def test_departures_share_one_axis_whatever_the_scenes():
    one, other = records.record(), records.data()
    other["scene"] = "far"
    other["metrics"]["dE2000"] |= {"mean": 250.0, "noise_floor": 0.0}
    other = records.of(other)
    first, second = figures.departures([one]), figures.departures([one, other])
    assert first["encoding"]["x"] == second["encoding"]["x"]
    values = {(row["scene"], row["what"]): row["value"] for row in second["data"]["values"]}
    assert values["fig-8-9", "as it is"] == one.metrics["dE2000"].mean
    assert values["far", "as it is"] == 100
    assert values["far", "noise floor"] == 0.001
    json.dumps(second)
