"""Colour spaces that PNG, JPEG and EXR files name, against colour-science and LittleCMS."""

import io
import struct
from contextlib import suppress

import colour
import numpy as np
import OpenEXR
import pytest
from PIL import Image, ImageCms, ImageOps

from fotismos.comparisons import colour_spaces
from fotismos.comparisons.departure.colour import from_srgb
from fotismos.comparisons.picture_files import read_file
from fotismos.heuristic.errors import InputError
from tests.shared.colour_files import (
    D50,
    chrm,
    curv,
    gama,
    iccp,
    matrix_profile,
    orientation,
    para,
    png,
    profile,
)

BT2020 = colour.RGB_COLOURSPACES["ITU-R BT.2020"]
P3 = colour.RGB_COLOURSPACES["Display P3"]
ADOBE = colour.RGB_COLOURSPACES["Adobe RGB (1998)"]
RANDOM = np.random.default_rng(1)
CODES = RANDOM.integers(40, 216, (6, 9, 3), dtype=np.uint8)
DEEP = RANDOM.integers(10_000, 55_000, (6, 9, 3), dtype=np.uint16)
SHOWN = CODES / 255
FINE = DEEP / 65535


def to_bt709(linear, space):
    """Return linear colours in BT.709 as colour-science converts them."""
    converted = colour.RGB_to_RGB(
        linear, space, "ITU-R BT.709", chromatic_adaptation_transform="Bradford"
    )
    return np.maximum(converted, 0)


def profile_of(space, curve, name="planted"):
    adapted = colour.adaptation.matrix_chromatic_adaptation_VonKries(
        colour.xy_to_XYZ(space.whitepoint), np.array(D50), transform="Bradford"
    )
    return matrix_profile(adapted @ space.matrix_RGB_to_XYZ, curve, name)


SRGB_CURVE = para(3, (2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045))
P3_PROFILE = profile_of(P3, SRGB_CURVE, "Display P3")
GREY_PROFILE = profile({"kTRC": curv([2.0])}, space="GRAY")
CHRM_2020 = chrm([*BT2020.primaries.ravel(), *BT2020.whitepoint])
WITH_P3 = "converted from its ICC profile, Display P3"
PQ_2020 = "read as its cICP chunk says: BT.2020, PQ, of which 203 cd/m² are 1"

PNGS = {
    "ICC": (png(CODES, {"iCCP": iccp(P3_PROFILE)}), (from_srgb(SHOWN), P3), WITH_P3),
    "deep ICC": (png(DEEP, {"iCCP": iccp(P3_PROFILE)}), (from_srgb(FINE), P3), WITH_P3),
    "cICP": (
        png(CODES, {"cICP": bytes([12, 13, 0, 1])}),
        (from_srgb(SHOWN), P3),
        "read as its cICP chunk says: Display P3, sRGB's curve",
    ),
    "PQ": (
        png(DEEP, {"cICP": bytes([9, 16, 0, 1])}),
        (colour.models.eotf_ST2084(FINE) / 203, BT2020),
        PQ_2020,
    ),
    "cHRM": (
        png(CODES, {"gAMA": gama(0.5), "cHRM": CHRM_2020}),
        (SHOWN**2, BT2020),
        "read with the gamma of its gAMA chunk, 0.5",
    ),
    "cICP before ICC": (
        png(CODES, {"cICP": bytes([9, 8, 0, 1]), "iCCP": iccp(P3_PROFILE)}),
        (SHOWN, BT2020),
        "read as its cICP chunk says: BT.2020, linear",
    ),
    "ICC before sRGB": (
        png(CODES, {"gAMA": gama(1), "iCCP": iccp(P3_PROFILE), "sRGB": b"\0"}),
        (from_srgb(SHOWN), P3),
        WITH_P3,
    ),
    "sRGB before gAMA": (
        png(CODES, {"gAMA": gama(1), "cHRM": CHRM_2020, "sRGB": b"\0"}),
        (from_srgb(SHOWN), colour.RGB_COLOURSPACES["ITU-R BT.709"]),
        "read as sRGB, as PNG files are",
    ),
}


@pytest.mark.guarantee("runs", "Colours are converted from the space that a PNG or JPEG names.")
@pytest.mark.parametrize("name", PNGS)
def test_a_png_is_read_in_the_space_that_it_names(tmp_path, name):
    """The first of cICP, ICC profile, sRGB, gAMA with cHRM counts, as the specification says."""
    content, (linear, space), note = PNGS[name]
    path = tmp_path / "x.png"
    path.write_bytes(content)
    found = read_file(str(path))
    np.testing.assert_allclose(found.image, to_bt709(linear, space), rtol=1e-5, atol=3e-5)
    assert found.notes[0] == note
    assert found.is_encoded == (note != PQ_2020)
    codes = FINE if name in ("deep ICC", "PQ") else SHOWN
    assert read_file(str(path), "linear").image == pytest.approx(codes, abs=1e-6)


CURVES = {
    "a gamma": curv([2.2]),
    "a table": curv(np.linspace(0, 1, 1024) ** 2),
    "none": curv([]),
    "power": para(0, (1.8,)),
    "from a place": para(1, (2, 1.1, -0.1)),
    "raised": para(2, (2, 0.9, 0.05, 0.02)),
    "sRGB's": SRGB_CURVE,
    "two parts": para(4, (2, 0.9, 0.1, 0.5, 0.04, 0.01, 0.02)),
}


@pytest.mark.parametrize("name", CURVES)
def test_profiles_are_read_as_littlecms_does(tmp_path, name):
    """To its 8 bits, within BT.709 and below white."""
    codes = np.random.default_rng(2).integers(0, 256, (40, 40, 3), dtype=np.uint8)
    path = tmp_path / "x.jpg"
    made = profile_of(ADOBE, CURVES[name])
    Image.fromarray(codes).save(path, quality=100, icc_profile=made)
    with Image.open(path) as file:
        there = ImageCms.ImageCmsProfile(io.BytesIO(made))
        srgb = ImageCms.createProfile("sRGB")
        # Perceptual intent would move black.
        intent = ImageCms.Intent.RELATIVE_COLORIMETRIC
        expected = np.array(ImageCms.profileToProfile(file, there, srgb, intent))
    inside = ((expected > 0) & (expected < 255)).all(axis=-1)
    assert inside.sum() > 100
    found = read_file(str(path)).image[inside]
    shown = colour.models.eotf_inverse_sRGB(found) * 255
    assert np.abs(shown - expected[inside]).max() < 2


def test_a_profile_of_grey_is_read(tmp_path):
    path = tmp_path / "x.png"
    path.write_bytes(png(DEEP[..., :1], {"iCCP": iccp(GREY_PROFILE)}))
    found = read_file(str(path)).image
    np.testing.assert_allclose(found, np.repeat(FINE[..., :1] ** 2, 3, axis=2), rtol=1e-6)


REFUSED = {
    "grey": ({"iCCP": iccp(GREY_PROFILE)}, "is for grey, and the picture has colours"),
    "tables": ({"iCCP": iccp(profile({"A2B0": bytes(99)}))}, "planted, has tables, which are not"),
    "inks": ({"iCCP": iccp(profile({}, space="CMYK"))}, "has no curves and primaries"),
    "damaged": ({"iCCP": iccp(P3_PROFILE[:200])}, "its ICC profile is damaged"),
    "packed wrongly": ({"iCCP": b"x\0\0abc"}, "its ICC profile is damaged"),
    "narrow": ({"cICP": bytes([1, 13, 0, 0])}, "a narrow range"),
    "HLG": ({"cICP": bytes([9, 18, 0, 1])}, "names the curve 18, and those read are 4, 5, 8, 13"),
    "camera": ({"cICP": bytes([1, 1, 0, 1])}, "names the curve 1,"),
    "primaries": ({"cICP": bytes([200, 13, 0, 1])}, "names primaries 200,"),
    "a line": ({"cHRM": chrm([0.3, 0.3] * 4)}, "span no colours"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_spaces_that_are_not_known_are_refused_by_name(tmp_path, name):
    """Unless `transfer` says how to read the file."""
    chunks, message = REFUSED[name]
    path = tmp_path / "x.png"
    path.write_bytes(png(CODES, chunks))
    with pytest.raises(InputError, match=message):
        read_file(str(path))
    assert read_file(str(path), "srgb").image == pytest.approx(from_srgb(SHOWN), abs=1e-6)


def test_no_damaged_profile_is_more_than_refused():
    """Also with any of its bytes wrong."""
    for made in (P3_PROFILE, GREY_PROFILE, profile_of(P3, CURVES["a table"])):
        for place in range(128, min(len(made), 700)):
            wrong = made[:place] + bytes([made[place] ^ 0x90]) + made[place + 1 :]
            for content in (wrong, made[:place]):
                with suppress(ValueError):
                    light = colour_spaces.of_profile(content, is_grey=True).light(SHOWN)
                    assert light.shape == SHOWN.shape


@pytest.mark.parametrize("number", range(1, 9))
def test_pictures_are_turned_as_their_exif_data_say(tmp_path, number):
    """As Pillow turns them."""
    path = tmp_path / "x.png"
    places = np.arange(54, dtype=np.uint8).reshape(6, 9, 1)
    path.write_bytes(png(places, {"eXIf": orientation(number)}))
    with Image.open(path) as file:
        order = np.array(ImageOps.exif_transpose(file))
    for codes, expected in ((CODES, SHOWN), (DEEP, FINE)):
        path.write_bytes(png(codes, {"eXIf": orientation(number)}))
        found = read_file(str(path), "linear")
        np.testing.assert_allclose(found.image, expected.reshape(-1, 3)[order], atol=1e-6)
        assert found.notes == (() if number == 1 else ("turned as its EXIF data say",))


def test_a_camera_may_name_adobe_rgb_without_a_profile(tmp_path):
    """By the interoperability index R03, in a folder of a folder of EXIF."""
    first = b"MM\0*" + struct.pack(">IHHHIII", 8, 1, 0x8769, 4, 1, 26, 0)
    second = struct.pack(">HHHIII", 1, 0xA005, 4, 1, 44, 0)
    third = struct.pack(">HHHI4sI", 1, 1, 2, 4, b"R03\0", 0)
    path = tmp_path / "x.jpg"
    code = (np.indices((16, 16)).sum(axis=0) * 6 + 30).astype(np.uint8)
    codes = np.stack([code, 255 - code, code // 2], axis=-1)
    Image.fromarray(codes).save(
        path, quality=100, subsampling=0, exif=b"Exif\0\0" + first + second + third
    )
    with Image.open(path) as file:
        shown = np.array(file) / 255
    found = read_file(str(path))
    np.testing.assert_allclose(found.image, to_bt709(shown ** (563 / 256), ADOBE), atol=1e-4)
    assert found.notes == ("converted from Adobe RGB, which its EXIF data name",)


def exr(path, **header):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **header}
    with OpenEXR.File(header, {"RGB": FINE.astype(np.float32)}) as file:
        file.write(str(path))


@pytest.mark.parametrize("name", colour_spaces.INTEROP_IDS)
def test_an_exr_may_name_its_space_by_an_identifier(tmp_path, name):
    """Of the Color Interop Forum, as colour-science has them; chromaticities go before it."""
    path = tmp_path / "x.exr"
    exr(path, colorInteropID=name)
    expected = to_bt709(FINE, colour.RGB_COLOURSPACES[name])
    np.testing.assert_allclose(read_file(str(path)).image, expected, atol=3e-4)
    primaries = (*BT2020.primaries.ravel(), *BT2020.whitepoint)
    exr(path, colorInteropID=name, chromaticities=primaries)
    np.testing.assert_allclose(read_file(str(path)).image, to_bt709(FINE, BT2020), atol=1e-5)


def test_an_exr_that_is_not_linear_is_refused(tmp_path):
    path = tmp_path / "x.exr"
    exr(path, colorInteropID="srgb_p3d65_scene")
    with pytest.raises(InputError, match="its colorInteropID srgb_p3d65_scene is not read"):
        read_file(str(path))
    exr(path, colorInteropID="unknown")
    assert read_file(str(path)).notes == ()
