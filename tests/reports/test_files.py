"""Files of results: layers that two readers read back, pictures, and tables with all numbers."""

import csv
from io import BytesIO, StringIO

import mitsuba as mi
import numpy as np
import OpenEXR
import pytest
from PIL import Image

from fotismos.comparisons.departure import colour
from fotismos.comparisons.departure.metrics import METRICS, RATIO, drawn
from fotismos.reference.records import plain
from fotismos.reports import tables
from fotismos.reports.files import images
from tests.shared import records

CONTRACT = {
    *(f"{name}.{c}" for name in ("heuristic", "reference", "reference_stderr") for c in "RGB"),
    *(f"{name}.{c}" for name in "PN" for c in "XYZ"),
    *(f"{map_}.Y" for map_ in ("dE2000", "dE_ITP", "dE_CAM16UCS", "significant")),
}


@pytest.fixture
def layers():
    rng = np.random.default_rng(0)
    colours = {name: rng.normal(0, 3, (5, 7, 3)) for name in sorted(images.FULL_PRECISION)}
    maps = {name: 40 * rng.random((5, 7)) for name in ("dE2000", "dE_ITP", "dE_CAM16UCS")}
    return colours | maps | {"significant": rng.random((5, 7)) > 0.5}


def read(path):
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return dict(file.header()), {name: c.pixels.copy() for name, c in file.channels().items()}


def test_openexr_reads_back_what_was_written(tmp_path, layers):
    path = tmp_path / "comparison.exr"
    images.write_exr(path, layers, {"seed": "3", "fotismos": "1.0", "scene": "fig-8-9 <φ>"})
    header, channels = read(path)
    assert set(channels) == CONTRACT
    for name, image in layers.items():
        suffixes = "Y" if image.ndim == 2 else "XYZ" if name in images.VECTORS else "RGB"
        kind = np.float32 if name in images.FULL_PRECISION else np.float16
        for suffix, expected in zip(suffixes, np.moveaxis(np.atleast_3d(image), 2, 0), strict=True):
            np.testing.assert_array_equal(
                channels[f"{name}.{suffix}"], expected.astype(kind), strict=True
            )
    assert header["compression"] == OpenEXR.ZIP_COMPRESSION
    np.testing.assert_allclose(header["chromaticities"], colour.CHROMATICITIES, rtol=1e-6)
    assert (header["seed"], header["fotismos"]) == ("3", "1.0")
    assert header["scene"] == "fig-8-9 <φ>"
    # tev and Blender split a name at its last dot, and take a second one for a group.
    assert {name.count(".") for name in channels} == {1}
    assert [file.name for file in tmp_path.iterdir()] == ["comparison.exr"]


def test_mitsuba_splits_it_into_layers(tmp_path, layers):
    path, formats = tmp_path / "comparison.exr", mi.Bitmap.PixelFormat
    images.write_exr(path, layers, {})
    split = dict(mi.Bitmap(str(path)).split())
    assert split.keys() == layers.keys()
    for name, image in layers.items():
        is_vector, own = name in images.VECTORS, split[name]
        colour = formats.XYZ if is_vector else formats.RGB
        assert own.pixel_format() == (formats.Y if image.ndim == 2 else colour)
        np.testing.assert_allclose(np.array(own).squeeze(), image, rtol=2**-11)


def test_a_value_beyond_half_stays_finite(tmp_path):
    path, values = tmp_path / "large.exr", {"a": 70_000.0, "b": -65_504.0}
    images.write_exr(path, {name: np.full((2, 2), value) for name, value in values.items()}, {})
    channels = read(path)[1]
    assert [channels[f"{name}.Y"].dtype for name in values] == [np.float32, np.float16]
    assert [channels[f"{name}.Y"][0, 0] for name in values] == [*values.values()]


# --- Pictures --------------------------------------------------------------------------------


def pixels_of(picture):
    return np.asarray(picture.convert("RGB"))


def decode(png):
    with Image.open(BytesIO(png)) as image:
        return pixels_of(image)


def test_tonemap_is_the_srgb_curve():
    linear = np.array([[[-1.0, 0.0, 0.0031308], [0.21586, 0.5, 1.0], [1e6, 0.04, 0.002]]])
    # IEC 61966-2-1: 0.21586 is the linear value of 128/255.
    expected = [[[0, 0, 10], [128, 188, 255], [255, 56, 7]]]
    np.testing.assert_array_equal(pixels_of(images.tonemap(linear)), expected)
    np.testing.assert_array_equal(pixels_of(images.tonemap(linear / 8, exposure=8)), expected)


def test_error_map_spans_magma_and_stays_in_it():
    row = pixels_of(images.error_map([[0.0, 10.0, 20.0, 500.0, -1.0]], 20.0))[0]
    ends = "000004", "fcfdbf"
    assert [bytes(one).hex() for one in row[[0, 2, 3, 4]]] == [*ends, *ends[::-1]]
    assert row[0].sum() < row[1].sum() < row[2].sum()


def test_mask_map_has_four_colours():
    picture = pixels_of(images.mask_map([[1.0, 0.0, 0.5, 0.5]], [[True, True, True, False]]))
    colours = images.MARKED, images.UNMARKED, images.UNDETERMINED, images.UNCOUNTED
    np.testing.assert_array_equal(picture[0], colours)


def test_pictures_draw_a_map_over_its_printed_range():
    for name in (*drawn(), RATIO.name):
        top = RATIO.limit if name == RATIO.name else METRICS[name].map_range[1]
        made = images.pictures(records.images(1, 2, {name: np.array([[top, 0.99 * top]])}))
        assert set(made) == {"heuristic", "reference", "significant", *drawn(), RATIO.name}
        end, below = decode(made[name])[0]
        last = images.colour_table("RdBu_r" if name == RATIO.name else "magma")[-6:]
        assert bytes(end).hex() == last
        assert (below != end).any()


# --- Tables ----------------------------------------------------------------------------------


def two_records():
    other = records.data()
    other["scene"] = 'a "b", c | d'
    other["metrics"]["dE2000"]["mean"] = 99.5
    return [records.record(), records.of(other)]


def test_csv_holds_every_number_in_full():
    made = two_records()
    rows = list(csv.DictReader(StringIO(tables.metrics_csv(made))))
    assert len(rows) == 2 * len(made[0].metrics)
    for row in rows:
        (record,) = [each for each in made if each.scene == row["scene"]]
        metric = plain(record.metrics[row["metric"]])
        for name in ("mean", "p50", "p95", "max", "noise_floor"):
            assert float(row[name]) == metric[name]
        for name, value in metric["after_exposure"].items():
            assert float(row[f"after_exposure.{name}"]) == value
        for share in metric["visible"]:
            assert float(row[f"visible.{share['threshold']:g}"]) == share["value"]
        assert float(row["significant"]) == record.significant.fraction
    assert {row["visible.5"] for row in rows if row["metric"] == "rmse"} == {""}
