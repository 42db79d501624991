"""The EXR file read back by two readers: OpenEXR's own and Mitsuba's."""

import mitsuba as mi
import numpy as np
import OpenEXR
import pytest

from heuristic.errors import InputError, OutputError
from reports.files import exr

CONTRACT = {
    *(f"heuristic.{c}" for c in "RGB"),
    *(f"reference.{c}" for c in "RGB"),
    *(f"reference_stderr.{c}" for c in "RGB"),
    *(f"P.{c}" for c in "XYZ"),
    *(f"N.{c}" for c in "XYZ"),
    *(f"{map_}.Y" for map_ in ("dE2000", "dE_ITP", "dE_CAM16UCS", "significant")),
}


@pytest.fixture
def layers():
    rng = np.random.default_rng(0)
    images = {name: rng.normal(0, 3, (5, 7, 3)) for name in sorted(exr.FULL_PRECISION)}
    maps = {name: 40 * rng.random((5, 7)) for name in ("dE2000", "dE_ITP", "dE_CAM16UCS")}
    return images | maps | {"significant": rng.random((5, 7)) > 0.5}


def read(path):
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return dict(file.header()), {name: c.pixels.copy() for name, c in file.channels().items()}


def test_openexr_reads_back_what_was_written(tmp_path, layers):
    path = tmp_path / "comparison.exr"
    exr.write(path, layers, {"seed": "3", "fotismos": "1.0", "scene": "fig-8-9 <φ>"})
    header, channels = read(path)
    assert set(channels) == CONTRACT
    for name, image in layers.items():
        for index, suffix in enumerate(exr._suffixes(name, image)):
            got = channels[f"{name}.{suffix}"]
            expected = image[..., index] if image.ndim == 3 else image
            if name in exr.FULL_PRECISION:
                assert got.dtype == np.float32
                np.testing.assert_array_equal(got, expected.astype(np.float32))
            else:
                assert got.dtype == np.float16
                np.testing.assert_allclose(got, expected, rtol=2**-11)
    assert header["compression"] == OpenEXR.ZIP_COMPRESSION
    np.testing.assert_allclose(header["chromaticities"], exr.BT709, rtol=1e-6)
    assert (header["seed"], header["fotismos"]) == ("3", "1.0")
    assert header["scene"] == "fig-8-9 <φ>"
    assert [file.name for file in tmp_path.iterdir()] == ["comparison.exr"]


def test_mitsuba_reads_it_too(tmp_path, layers):
    path = tmp_path / "comparison.exr"
    exr.write(path, layers, {"seed": "3"})
    bitmap = mi.Bitmap(str(path))
    names = [field.name for field in bitmap.struct_()]
    assert set(names) == CONTRACT
    pixels = np.array(bitmap)
    for name, suffix, index in (("heuristic", "G", 1), ("P", "Z", 2), ("reference", "R", 0)):
        got = pixels[..., names.index(f"{name}.{suffix}")]
        np.testing.assert_array_equal(got, layers[name][..., index].astype(np.float32))
    assert bitmap.metadata()["seed"] == "3"


def test_mitsuba_splits_it_into_layers(tmp_path, layers):
    path = tmp_path / "comparison.exr"
    exr.write(path, layers, {})
    formats = {
        **dict.fromkeys(("heuristic", "reference", "reference_stderr"), mi.Bitmap.PixelFormat.RGB),
        **dict.fromkeys(("P", "N"), mi.Bitmap.PixelFormat.XYZ),
        **dict.fromkeys(("dE2000", "dE_ITP", "dE_CAM16UCS"), mi.Bitmap.PixelFormat.Y),
        "significant": mi.Bitmap.PixelFormat.Y,
    }
    split = dict(mi.Bitmap(str(path)).split())
    assert {name: part.pixel_format() for name, part in split.items()} == formats
    for name in sorted(exr.FULL_PRECISION):
        np.testing.assert_array_equal(np.array(split[name]), layers[name].astype(np.float32))
    for name in ("dE2000", "dE_ITP", "dE_CAM16UCS"):
        np.testing.assert_allclose(np.array(split[name]).squeeze(), layers[name], rtol=2**-11)


def test_viewers_find_the_layers_by_the_only_dot_of_a_name(tmp_path, layers):
    """tev and Blender split a name at its last dot, and take a second one for a group."""
    path = tmp_path / "comparison.exr"
    exr.write(path, layers, {})
    with OpenEXR.File(str(path), separate_channels=True) as file:
        assert len(file.parts) == 1
        names = list(file.channels())
    assert {name.count(".") for name in names} == {1}
    found = {}
    for layer, channel in (name.split(".") for name in names):
        found.setdefault(layer, set()).add(channel)
    assert found["heuristic"] == found["reference"] == set("RGB")
    assert found["P"] == found["N"] == set("XYZ")
    assert found["dE2000"] == found["significant"] == {"Y"}


def test_a_value_beyond_half_stays_finite(tmp_path):
    path = tmp_path / "large.exr"
    exr.write(path, {"a": np.full((2, 2), 70_000.0), "b": np.full((2, 2), -65_504.0)}, {})
    channels = read(path)[1]
    assert channels["a.Y"].dtype == np.float32
    assert channels["b.Y"].dtype == np.float16
    assert channels["a.Y"].max() == 70_000.0
    assert channels["b.Y"].min() == -65_504.0


def test_layers_that_do_not_fit_are_refused(tmp_path):
    path = tmp_path / "out.exr"
    with pytest.raises(InputError, match=r"\(3, 3\)"):
        exr.write(path, {"a": np.zeros((2, 2)), "b": np.zeros((3, 3))}, {})
    with pytest.raises(InputError, match="shape"):
        exr.write(path, {"a": np.zeros((2, 2, 4))}, {})
    assert list(tmp_path.iterdir()) == []


def test_an_earlier_file_survives_a_failure(tmp_path, layers):
    path = tmp_path / "out.exr"
    exr.write(path, layers, {})
    before = path.read_bytes()
    with pytest.raises(InputError):
        exr.write(path, {"a": np.zeros((2, 2, 4))}, {})
    assert path.read_bytes() == before
    with pytest.raises(OutputError, match="absent"):
        exr.write(tmp_path / "absent" / "out.exr", layers, {})
