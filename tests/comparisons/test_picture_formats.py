"""HDR, PFM and deep PNG files, as Mitsuba's library and Radiance have them."""

import subprocess
from contextlib import suppress
from pathlib import Path

import colour
import mitsuba as mi
import numpy as np
import pyradiance
import pytest

from fotismos.comparisons import picture_formats
from fotismos.comparisons.picture_files import read_file
from fotismos.heuristic.errors import InputError, NonFiniteError
from tests.shared.colour_files import png

PVALUE = Path(pyradiance.__file__).parent / "bin/pvalue"

SIZES = ((4, 5), (3, 7), (2, 8), (20, 300), (2, 33_000))
"""Heights and widths; rows of 8 to 32,767 pixels are packed."""


def light(height, width, seed=0):
    """Return a picture of a wide range, with a black row and a run, (H, W, 3)."""
    normal = np.random.default_rng(seed).normal(size=(height, width, 3))
    image = np.exp(4 * normal).astype(np.float32)
    image[0, : width // 2] = image[0, 0]
    image[-1] = 0
    return image


def test_pfm_is_read_as_mitsubas_library_does(rgb, tmp_path):
    path = tmp_path / "x.pfm"
    mi.Bitmap(light(4, 5)).write(str(path))
    np.testing.assert_array_equal(picture_formats.pfm(path), np.array(mi.Bitmap(str(path))))


def pvalue(*words, **more):
    return subprocess.run([PVALUE, *words], capture_output=True, check=True, **more).stdout


def radiances(path, shape):
    """Return the light of a picture (H, W, 3) as Radiance's own program prints it."""
    return np.frombuffer(pvalue("-o", "-h", "-H", "-df", path), "f4").reshape(*shape, 3)


@pytest.mark.parametrize("size", SIZES)
def test_hdr_is_read_as_radiance_does(rgb, tmp_path, size):
    """Written by Mitsuba's library, and by Radiance, to 8 bits of the brightest channel."""
    path = tmp_path / "x.hdr"
    image = light(*size)
    mi.Bitmap(image).write(str(path))
    files = [path.read_bytes()]
    if size[1] < 2**15:
        words = ["-r", "-h", "-H", "-df", "-y", str(size[0]), "+x", str(size[1])]
        files.append(pvalue(*words, input=image.tobytes()))
    for content in files:
        path.write_bytes(content)
        if size[1] != 8:  # Radiance packs rows from 9 pixels on, Mitsuba from 8
            is_packed = bytes([2, 2, *divmod(size[1], 256)]) in content
            assert is_packed == (8 < size[1] < 2**15)
        found = read_file(str(path))
        np.testing.assert_array_equal(found.image, radiances(path, size))
        assert found.notes == ("read half a step above its codes, as Radiance does",)
        half = image.max(axis=-1, keepdims=True) / 256
        assert (np.abs(found.image - image) <= 1.01 * half).all()


STEPS = {
    "x.hdr": 1 / 256,
    "x.png": 1 / 255,
    "deep.png": 1 / 65535,
    "half.exr": 0.7 * 2**-10,
    "single.exr": 0.0,
}
"""Mean distance of neighbouring values of light between 0.5 and 1, at most."""


@pytest.mark.parametrize("name", STEPS)
def test_reading_moves_no_mean_beyond_the_rounding_of_a_file(rgb, tmp_path, name):
    """Mitsuba cuts when it writes HDR: without half a step, light is 0.3 % too dark."""
    path = tmp_path / name
    image = np.random.default_rng(0).uniform(0.5, 0.99, (100, 100, 3)).astype(np.float32)
    shown = image
    if name.endswith(".png"):
        shown = np.round(image * (65535 if name == "deep.png" else 255))
        shown = shown.astype(np.uint16 if name == "deep.png" else np.uint8)
    shown = image.astype(np.float16) if name == "half.exr" else shown
    mi.Bitmap(shown).write(str(path))
    found = read_file(str(path), "linear")
    np.testing.assert_allclose(found.image.mean(), image.mean(), rtol=1e-4)
    np.testing.assert_allclose(found.rounding, STEPS[name] / 2, rtol=0.1)


HEADERS = {
    "exposures": (b"EXPOSURE=0.5\nEXPOSURE= 3e-1\n", "divided by its EXPOSURE, 0.15"),
    "colours": (b"COLORCORR=1 2 4\nCOLORCORR=.5 1 1\n", "divided by its COLORCORR, 0.5 2 4"),
    "of inputs": (b"\tEXPOSURE=7\n", None),
    "Photoshop's": (b"GAMMA=1\nPRIMARIES=0 0 0 0 0 0 0 0\n", None),
}


@pytest.mark.guarantee("runs", "A Radiance picture is read as the light before its exposures.")
@pytest.mark.parametrize("name", HEADERS)
def test_what_a_radiance_header_multiplied_is_undone(tmp_path, name):
    lines, note = HEADERS[name]
    path = tmp_path / "x.hdr"
    codes = np.random.default_rng(4).integers(128, 140, (3, 4, 4), dtype=np.uint8)
    path.write_bytes(HDR[:-1] + lines + b"\n-Y 3 +X 4\n" + codes.tobytes())
    found = read_file(str(path))
    np.testing.assert_allclose(found.image, radiances(path, (3, 4)), rtol=1e-5)
    assert found.notes[1:] == (() if note is None else (note,))


def test_primaries_of_a_radiance_header_are_converted(tmp_path):
    """As those of an EXR; Radiance's white is that of equal energy."""
    path = tmp_path / "x.hdr"
    line = b"PRIMARIES=.708 .292 .170 .797 .131 .046 .3127 .3290\n"
    codes = np.random.default_rng(4).integers(128, 256, (3, 4, 4), dtype=np.uint8)
    codes[..., 3] = 128
    path.write_bytes(HDR[:-1] + line + b"\n-Y 3 +X 4\n" + codes.tobytes())
    linear = (codes[..., :3] + 0.5) / 256
    expected = colour.RGB_to_RGB(linear, "ITU-R BT.2020", "ITU-R BT.709")
    found = read_file(str(path))
    np.testing.assert_allclose(found.image, np.maximum(expected, 0), atol=2e-4)
    assert found.notes[0] == "converted from BT.2020 to BT.709"


def test_pfm_has_an_order_of_bytes_and_a_scale(tmp_path):
    image = light(3, 4)[..., :1]
    path = tmp_path / "x.pfm"
    for order, scale in (("<f4", -1.0), (">f4", 1.0), (">f4", 2.5), ("<f4", -0.5)):
        path.write_bytes(f"Pf\n4 3\n{scale}\n".encode() + image[::-1].astype(order).tobytes())
        np.testing.assert_allclose(picture_formats.pfm(path), abs(scale) * image, rtol=1e-6)


@pytest.mark.parametrize(("channels", "bits"), [(1, 1), (1, 2), (1, 4), (1, 8), (1, 16), (3, 16)])
@pytest.mark.parametrize("is_there", [True, False])
def test_a_clear_colour_of_a_png_changes_alpha_only(tmp_path, channels, bits, is_there):
    """All bits of it count, and none above its depth."""
    largest = 2**bits - 1
    codes = np.random.default_rng(3).integers(0, largest + 1, (6, 9, channels))
    codes = codes.astype(np.uint16 if bits == 16 else np.uint8)
    codes[0, 0] = largest
    codes[0, 1] = largest - 1
    clear = np.full(channels, largest if is_there else 0, ">u2")
    if not is_there:
        codes = np.maximum(codes, 1)
    path = tmp_path / "x.png"
    path.write_bytes(png(codes, {"tRNS": clear.tobytes()}, bits))
    found = read_file(str(path), "linear", is_mask=True)
    expected = np.broadcast_to(codes / largest, (6, 9, 3))
    np.testing.assert_allclose(found.image, expected, atol=1e-6)
    np.testing.assert_array_equal(found.opaque, (codes != clear).any(axis=-1))
    np.testing.assert_allclose(found.rounding, 0.5 / largest, rtol=0.4)


HDR = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n"
HOSTILE = {
    "huge.hdr": (HDR + b"-Y 999999999 +X 999999999\nabc", "it ends too soon"),
    "digits.hdr": (HDR + b"-Y " + b"9" * 5000 + b" +X 3\nabc", "its header lacks"),
    "none.hdr": (HDR + b"-Y 0 +X 3\n", "it has no pixels"),
    "xyz.hdr": (HDR.replace(b"rgbe", b"xyze") + b"-Y 1 +X 1\nabcd", "its header lacks"),
    "turned.hdr": (HDR + b"+Y 1 +X 1\nabcd", "its order is .Y 1 .X 1, and rows are read from"),
    "columns.hdr": (HDR + b"+X 1 -Y 1\nabcd", "its order is .X 1 -Y 1"),
    "gamma.hdr": (HDR[:-1] + b"GAMMA=2.2\n\n-Y 1 +X 1\nabcd", "it is not linear"),
    "dark.hdr": (HDR[:-1] + b"EXPOSURE=0\n\n-Y 1 +X 1\nabcd", "its header has EXPOSURE=0"),
    "odd.hdr": (HDR[:-1] + b"COLORCORR=1 2\n\n-Y 1 +X 1\nabcd", "has COLORCORR=1 2"),
    "line.hdr": (HDR[:-1] + b"PRIMARIES=1 1 1 1 1 1 1 1\n\n-Y 1 +X 1\nabcd", "no colours"),
    "long run.hdr": (HDR + b"-Y 1 +X 9\n\2\2\0\x09" + b"\xff\1" * 4, "a run is longer"),
    "no run.hdr": (HDR + b"-Y 1 +X 9\n\2\2\0\x09" + bytes(40), "it ends too soon"),
    "old runs.hdr": (HDR + b"-Y 1 +X 2\n\x80\x80\x80\x80\1\1\1\2", "runs of the old kind"),
    "huge.pfm": (b"PF\n999999999 999999999\n-1.0\nabc", "it ends too soon"),
    "digits.pfm": (b"PF\n" + b"9" * 5000 + b" 1\n-1.0\nabc", "it has no kind, width"),
    "none.pfm": (b"PF\n0 3\n-1.0\n", "it has no pixels"),
    "scale.pfm": (b"PF\n1 1\n--e\n" + bytes(12), "could not convert"),
    "infinite.pfm": (b"PF\n1 1\n1e999\n" + bytes(12), "NaN or infinite"),
}


@pytest.mark.guarantee("runs", "HDR and PFM files with wrong sizes or runs are refused at once.")
@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_files_are_refused_in_one_message(tmp_path, name):
    content, message = HOSTILE[name]
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises((InputError, NonFiniteError), match=message):
        read_file(str(path))


@pytest.mark.parametrize("suffix", [".hdr", ".pfm", ".png"])
def test_no_damage_is_more_than_refused(rgb, tmp_path, suffix):
    """Files cut at any byte, and files with wrong bytes, are read, or refused in one message."""
    path = tmp_path / f"x{suffix}"
    image = light(5, 12)
    deep = (1000 * image.clip(0, 60)).astype(np.uint16)
    mi.Bitmap(deep if suffix == ".png" else image).write(str(path))
    content = path.read_bytes()
    damaged = [content[:length] for length in range(0, len(content) - 30, 3)]
    random = np.random.default_rng(2)
    for _ in range(300):
        wrong = bytearray(content)
        for place in random.integers(0, min(len(wrong), 120), 3):
            wrong[place] = random.integers(256)
        damaged.append(bytes(wrong))
    count = 0
    for wrong in damaged:
        path.write_bytes(wrong)
        with suppress(InputError, NonFiniteError):
            read_file(str(path))
            count += 1
    assert count < len(damaged) / 2
