"""HDR, PFM and deep PNG files, as Mitsuba's library and Radiance have them."""

import subprocess
from contextlib import suppress
from pathlib import Path
from zlib import crc32

import mitsuba as mi
import numpy as np
import pyradiance
import pytest

from fotismos.comparisons import picture_formats
from fotismos.comparisons.picture_files import read_file
from fotismos.heuristic.errors import InputError, NonFiniteError

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


@pytest.mark.parametrize("size", SIZES)
def test_hdr_and_pfm_are_read_as_mitsubas_library_does(rgb, tmp_path, size):
    for path, read in (
        (tmp_path / "x.hdr", picture_formats.hdr),
        (tmp_path / "x.pfm", picture_formats.pfm),
    ):
        mi.Bitmap(light(*size)).write(str(path))
        np.testing.assert_array_equal(read(path), np.array(mi.Bitmap(str(path))))


@pytest.mark.parametrize("size", SIZES[:4])
def test_radiances_own_pictures_are_read(tmp_path, size):
    """A mantissa has 8 bits of the brightest channel."""
    image = light(*size)
    words = ["-r", "-h", "-H", "-df", "-y", str(size[0]), "+x", str(size[1])]
    made = subprocess.run([PVALUE, *words], input=image.tobytes(), capture_output=True, check=True)
    path = tmp_path / "x.hdr"
    path.write_bytes(made.stdout)
    assert (bytes([2, 2, *divmod(size[1], 256)]) in made.stdout) == (size[1] > 8)
    apart = np.abs(read_file(str(path)).image - image)
    assert (apart <= image.max(axis=-1, keepdims=True) / 128).all()


def test_pfm_has_an_order_of_bytes_and_a_scale(tmp_path):
    image = light(3, 4)[..., :1]
    path = tmp_path / "x.pfm"
    for order, scale in (("<f4", -1.0), (">f4", 1.0), (">f4", 2.5), ("<f4", -0.5)):
        path.write_bytes(f"Pf\n4 3\n{scale}\n".encode() + image[::-1].astype(order).tobytes())
        np.testing.assert_allclose(picture_formats.pfm(path), abs(scale) * image, rtol=1e-6)


def test_a_deep_png_may_have_a_clear_colour(rgb, tmp_path):
    """All 16 bits of it count."""
    codes = np.full((2, 3, 3), 1000, np.uint16)
    codes[1, 2] = 1001
    path = tmp_path / "x.png"
    mi.Bitmap(codes).write(str(path))
    content = path.read_bytes()
    place = content.index(b"IDAT") - 4
    chunk = b"tRNS" + np.full(3, 1001, ">u2").tobytes()
    framed = b"\0\0\0\6" + chunk + crc32(chunk).to_bytes(4, "big")
    path.write_bytes(content[:place] + framed + content[place:])
    alpha = picture_formats.deep_png(path)[..., 3]
    np.testing.assert_array_equal(alpha, [[65535] * 3, [65535, 65535, 0]])


HDR = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n"
HOSTILE = {
    "huge.hdr": (HDR + b"-Y 999999999 +X 999999999\nabc", "it ends too soon"),
    "digits.hdr": (HDR + b"-Y " + b"9" * 5000 + b" +X 3\nabc", "its header lacks"),
    "none.hdr": (HDR + b"-Y 0 +X 3\n", "it has no pixels"),
    "xyz.hdr": (HDR.replace(b"rgbe", b"xyze") + b"-Y 1 +X 1\nabcd", "its header lacks"),
    "turned.hdr": (HDR + b"+Y 1 +X 1\nabcd", "its header lacks"),
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
