"""Pictures of other renderers: read, placed, doubted in words, and compared."""

import json
import re
from operator import attrgetter

import colour
import mitsuba as mi
import numpy as np
import pytest
from PIL import Image
from PIL.PngImagePlugin import PngInfo
from scipy import ndimage

from fotismos.comparisons import alignment, picture_files, picture_mistakes
from fotismos.comparisons.case import open_case
from fotismos.comparisons.colour_spaces import PRIMARIES
from fotismos.comparisons.compare import compare
from fotismos.comparisons.departure.colour import from_srgb, to_srgb
from fotismos.comparisons.departure.mapped_sums import Light
from fotismos.comparisons.departure.metrics import METRICS
from fotismos.comparisons.departure.tone_maps import TONE_MAPS
from fotismos.comparisons.halves import PassSums
from fotismos.comparisons.options import Options
from fotismos.comparisons.picture_mistakes import Names, NoisyImage
from fotismos.comparisons.pictures import MappedPassSums, StillSums
from fotismos.comparisons.prepared import prepare
from fotismos.comparisons.steps import steps
from fotismos.heuristic.errors import InputError
from fotismos.reference.rendering.gbuffer import gbuffer
from tests.shared.outputs import write

SIDE = 64


def read(word, *how, **more):
    """The linear picture of a file."""
    return picture_files.read_file(word, *how, **more).image


def picture_of(scene, words, spp=64, **more):
    case = open_case(scene, Options(image=words, spp=spp, **more))
    return compare(case.source, case.options, then=steps(why=False)).record


@pytest.fixture(scope="module")
def cornell():
    """Two renderings of one scene: the reference with one seed, and the textbook's kernel."""
    mi.set_variant("llvm_ad_rgb")
    case = open_case("cornell-box", Options(resolution=(SIDE, SIDE), spp=512))
    ready = prepare(case.source, case.options)
    images = [np.array(half.render(5), float) for half in (ready.reference, ready.heuristic)]
    surface = gbuffer(ready.scene, (alignment.FINER * SIDE, alignment.FINER * SIDE))
    edges = alignment.geometry_edges(surface)
    return images[0], images[1], [edges, alignment.picture_edges(images[1])], ready.counted


# --- The same departure --------------------------------------------------------------------------


@pytest.mark.guarantee("runs", "A picture from another run has that run's departure.")
def test_a_picture_of_another_run_has_its_departure(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    scene = "plastic-spheres"
    words = ("compare", scene, "--spp", 16, "--resolution", f"{SIDE}x48", "--no-why")
    assert run(*words, "-o", "own")[0] == 0
    file = f"own/{scene}/comparison.exr:heuristic"
    code, said, _ = run(*words, "--image", file, "-o", "theirs")
    assert code == 0
    assert said.splitlines()[1].startswith("The content of the picture ")
    assert "The picture equals the textbook half to ΔE2000 0.01, away from edges." in said
    first, second = (
        json.loads((tmp_path / out / scene / "comparison.json").read_text())
        for out in ("own", "theirs")
    )
    assert second["resolution"] == [SIDE, 48]
    for name in METRICS:
        own = first["metrics"][name]["mean"]
        assert second["metrics"][name]["mean"] == pytest.approx(own, rel=1e-6)
    assert second["picture"]["files"] == [file]
    assert second["heuristic"] == f"picture {file}"
    assert max(map(abs, second["agreement"]["shift"])) < 0.3
    assert file in second["command"]
    page = (tmp_path / "theirs/index.html").read_text()
    assert "The content of the picture is not moved" in page


def test_every_kind_of_png_is_read_as_mitsubas_library_does(rgb, tmp_path):
    """Grey, colours and palettes, with alpha, with a transparent colour, of 1, 8 and 16 bits."""
    rng = np.random.default_rng(5)
    codes = rng.integers(0, 256, (6, 9, 4), dtype=np.uint8)
    whole = Image.fromarray(codes)
    for name, mode, more in (
        ("one", "1", {}),
        ("palette", "P", {}),
        ("clear palette", "P", {"transparency": 3}),
        ("grey", "L", {}),
        ("clear grey", "L", {"transparency": 3}),
        ("grey alpha", "LA", {}),
        ("colours", "RGB", {}),
        ("clear colour", "RGB", {"transparency": tuple(codes[0, 0, :3].tolist())}),
        ("alpha", "RGBA", {}),
    ):
        whole.convert(mode).save(tmp_path / f"{name}.png", **more)
    for channels in (1, 2, 3, 4):
        deep = rng.integers(0, 2**16, (6, 9, channels), dtype=np.uint16)
        mi.Bitmap(deep).write(str(tmp_path / f"{channels} of 16 bits.png"))
    whole.convert("L").save(tmp_path / "grey.jpg")
    files = sorted(tmp_path.iterdir())
    for path in files:
        pixels = np.array(mi.Bitmap(str(path)))
        values = np.atleast_3d(pixels / float(np.iinfo(pixels.dtype).max))
        count = 3 if values.shape[2] > 2 else 1
        alpha = values[..., count:] if values.shape[2] > count else np.ones((6, 9, 1))
        expected = np.broadcast_to(values[..., :count] * alpha + 1 - alpha, (6, 9, 3))
        found = read(str(path), "linear", over="white")
        np.testing.assert_allclose(found, expected, atol=1e-6, err_msg=path.name)
    assert len(files) == 14


def test_files_say_how_they_are_encoded(rgb, tmp_path):
    """By a chunk of a PNG, or by what its kind of file usually is; `transfer` decides otherwise."""
    codes = np.full((4, 4, 3), 128, np.uint8)
    shown = Image.fromarray(codes)
    code = 128 / 255
    for suffix, gamma, expected, note in (
        (".png", None, from_srgb(np.array(code)), "read as sRGB, as PNG files are"),
        (".jpg", None, from_srgb(np.array(code)), "read as sRGB, as JPG files are"),
        (".png", 1.0, code, "read with the gamma of its gAMA chunk, 1"),
        (".png", 0.45455, from_srgb(np.array(code)), "gAMA chunk, 0.45455"),
        (".png", 0.5, code**2, "gAMA chunk, 0.5"),
    ):
        path = tmp_path / f"x{suffix}"
        chunks = PngInfo()
        if gamma is not None:
            chunks.add(b"gAMA", round(gamma * 100_000).to_bytes(4, "big"))
        shown.save(path, **({"pnginfo": chunks} if suffix == ".png" else {"quality": 100}))
        found = picture_files.read_file(str(path))
        np.testing.assert_allclose(found.image, expected, atol=2e-3 if suffix == ".jpg" else 2e-6)
        assert note in found.notes[0]
        stated = picture_files.read_file(str(path), "linear")
        np.testing.assert_allclose(stated.image, code, atol=2e-3)
        assert stated.notes == ()


@pytest.mark.parametrize("name", ["BT.2020", "Display P3", "ACEScg", "ACES2065-1"])
def test_other_primaries_are_converted_by_their_chromaticities(rgb, tmp_path, name):
    """As colour-science converts its own spaces, whites adapted by Bradford's matrix."""
    names = {"BT.2020": "ITU-R BT.2020", "Display P3": "Display P3"}
    space = colour.RGB_COLOURSPACES[names.get(name, name)]
    linear = np.random.default_rng(2).uniform(0.2, 0.8, (8, 8, 3))
    expected = colour.RGB_to_RGB(
        linear, space, "ITU-R BT.709", chromatic_adaptation_transform="Bradford"
    )
    header = {"chromaticities": PRIMARIES[name]}
    found = picture_files.read_file(write(tmp_path / "x.exr", linear, header))
    assert np.abs(linear - expected).max() > 0.05
    np.testing.assert_allclose(found.image, np.maximum(expected, 0), atol=2e-3)
    assert found.notes == (f"converted from {name} to BT.709",)
    assert picture_files.read_file(str(tmp_path / "x.exr"), "linear").notes == found.notes


def test_a_data_window_is_put_into_its_display_window(rgb, tmp_path):
    """Around it the picture is black, and what lies outside the display window is not seen."""
    values = np.arange(1, 193).reshape(8, 8, 3) / 192
    for (left, top), size in (((0, 0), 16), ((-3, -2), 16), ((2, 3), 4), ((5, -1), 12)):
        corners = (left, top), (left + size - 1, top + size - 1)
        window = tuple(np.array(corner, np.int32) for corner in corners)
        path = write(tmp_path / "x.exr", values, {"displayWindow": window})
        found = picture_files.read_file(path)
        expected = np.zeros((size, size, 3))
        for y in range(size):
            for x in range(size):
                if 0 <= y + top < 8 and 0 <= x + left < 8:
                    expected[y, x] = values[y + top, x + left]
        np.testing.assert_allclose(found.image, expected, atol=1e-3)
        assert found.notes == ("its data window was put into its display window",)


def test_alpha_shows_the_colour_behind(rgb, tmp_path):
    """EXR's colours are premultiplied, a PNG's are not."""
    alpha = np.full((8, 8), 0.25)
    path = write(tmp_path / "x.exr", np.full((8, 8, 3), 0.2), alpha=alpha)
    assert read(path, over="black") == pytest.approx(0.2, abs=1e-3)
    assert read(path, over="white") == pytest.approx(0.2 + 0.75, abs=1e-3)
    assert read(path, over="0.1,0.1,0.1")[0, 0] == pytest.approx(0.275, abs=1e-3)
    Image.fromarray(np.full((8, 8, 4), 51, np.uint8)).save(tmp_path / "x.png")  # alpha 1/5
    front = float(from_srgb(np.array(0.2)))
    found = read(str(tmp_path / "x.png"), over="white")
    assert found == pytest.approx(0.2 * front + 0.8, abs=1e-6)


# --- Where it lies -------------------------------------------------------------------------------


def test_shifts_are_measured_to_a_fraction_of_a_pixel(cornell):
    reference, kernel, expected, _ = cornell
    for x, y in ((-3, 0), (-1, 1), (0, -2), (1, 1), (2, -2)):
        shift = alignment.measure(np.roll(reference, (y, x), (0, 1)), expected).shift
        assert shift == pytest.approx((x, y), abs=0.35)
    for part in (0.25, 0.5, 0.75):
        moved = (1 - part) * kernel + part * np.roll(kernel, 1, 1)
        shift = alignment.measure(moved, expected).shift
        assert shift == pytest.approx((part, 0), abs=0.2)


def test_a_shift_that_only_half_of_the_repeats_show_is_none(cornell):
    reference, _, expected, _ = cornell
    moved = np.roll(reference, 3, 1)
    place = alignment.measure(moved, expected)
    assert place.shift == pytest.approx((3, 0), abs=0.35)
    assert not alignment.is_doubtful(place, None, [moved] * 4, expected)
    assert not alignment.is_doubtful(place, None, [moved], expected)
    assert alignment.is_doubtful(place, None, [moved, reference] * 2, expected)


@pytest.mark.thorough
@pytest.mark.parametrize("scene", ["plastic-spheres", "narrow-band-lamp", "fig-8-9"])
def test_a_right_picture_that_is_shifted_is_said_to_be_shifted_by_that_alone(rgb, tmp_path, scene):
    case = open_case(scene, Options(resolution=(SIDE, SIDE), spp=256))
    image = np.array(prepare(case.source, case.options).reference.render(5), float).clip(0)
    for x, y, words in ((2, 0, "2 pixels to the right,"), (0, -1, "1 pixel up,")):
        moved = np.roll(image, (y, x), (0, 1))
        record = picture_of(scene, write(tmp_path / "x.exr", moved), resolution=(SIDE, SIDE))
        (sentence,) = record.agreement.mistakes
        assert f"are shifted by {words}" in sentence
        assert record.agreement.shift == pytest.approx((x, y), abs=0.25)


# --- What is odd, in words -----------------------------------------------------------------------


def mistakes(picture, cornell):
    """Return what is said of a picture."""
    reference, _, expected, counted = cornell
    sides = NoisyImage(picture), NoisyImage(reference)
    light = Light(mean=reference, standard_error=0 * reference)

    def locate(mend):
        return alignment.measure(mend(picture), expected)

    place = alignment.measure(picture, expected)
    found = picture_mistakes.find(*sides, counted, place, locate, False, Names(), light)
    return [mistake.sentence for mistake in found]


ODD = {
    "a missing pi": (lambda image: image * np.pi, "a missing division by pi"),
    "pi twice": (lambda image: image / np.pi, "a division by pi too many"),
    "exposure": (lambda image: image * 5, "times as bright as the reference: another exposure"),
    "white": (lambda image: image * [1, 0.9, 0.8], "another white"),
    "gamma": (to_srgb, "sRGB-encoded: write linear values"),
    "gamma twice": (lambda image: from_srgb(image.clip(0, 1)), "decoded twice"),
    "power": (lambda image: image.clip(0) ** 1.7, r"raised to the power 1\.[67]\d?"),
    "offset": (lambda image: image + 0.04, r"values are all 0\.0[34]\d* too high"),
    "red and blue": (lambda image: image[..., ::-1], "channels look like blue, green, red"),
    "channels turned": (lambda image: np.roll(image, 1, 2), "channels look like green, blue, red"),
    "one pixel": (lambda image: np.roll(image, 1, 1), r"shifted by 1 pixels? to the right, which"),
    "two down": (lambda image: np.roll(image, 2, 0), r"shifted by [12](\.5)? pixels down"),
    "upside down": (lambda image: image[::-1], "looks upside down"),
    "mirrored": (lambda image: image[:, ::-1], "looks mirrored left to right"),
}


@pytest.mark.guarantee("runs", "Each of fourteen mistakes in how a picture was made is named.")
def test_mistakes_in_a_picture_are_named(rgb, tmp_path, cornell):
    """And nothing of the reference of another seed, or the kernel, whose shading alone is wrong."""
    for name, (spoil, message) in ODD.items():
        words = mistakes(spoil(cornell[0]), cornell)
        assert any(re.search(message, each) for each in words), (name, words)
    assert mistakes(cornell[0], cornell) == mistakes(cornell[1], cornell) == []
    record = picture_of("cornell-box", write(tmp_path / "x.exr", cornell[0] * np.pi))
    (mistake,) = record.agreement.mistakes
    assert "a missing division by pi" in mistake
    assert record.warnings[0] == mistake


@pytest.mark.parametrize("error", [0.98, 1, 1.02])
def test_lumens_per_watt_are_named(rgb, cornell, error):
    """683 lm/W, the definition of the candela, either way; and no other factor of that size."""
    (said,) = mistakes(683 * error * cornell[0], cornell)
    assert "multiplied by 683 lumens per watt, as Blender's default export" in said
    assert "divided by 683 lumens" in picture_mistakes.reason_of(error / 683)
    for other in (600, 800, 1 / 600, 1 / 800, 5):
        assert picture_mistakes.reason_of(other) == "another exposure"


def test_a_lamp_that_a_picture_clips_does_not_count_as_exposure():
    reference = np.full((32, 32, 3), (0.2, 0.3, 0.4))
    reference[8:24, 8:32] = 40.0
    counted = np.ones((32, 32), bool)
    found = picture_mistakes.ratios(reference.clip(0, 1), reference, counted)
    assert found == pytest.approx((1, 1, 1))
    found = picture_mistakes.ratios(2 * reference, reference, counted)
    assert found == pytest.approx((2, 2, 2), rel=0.01)


# --- Bad input -----------------------------------------------------------------------------------


def test_a_picture_must_fit_its_scene(rgb, tmp_path):
    wide = write(tmp_path / "wide.exr", np.full((8, 12, 3), 0.5))
    first = write(tmp_path / "first.exr", np.full((8, 8, 3), 0.5))
    second = write(tmp_path / "second.exr", np.full((8, 8, 3), 0.5))
    for files, more, message in (
        (wide, {}, "12x8 pixels, an aspect ratio of 1.5, and the .* film .*x.*, 1"),
        (first, {"resolution": (16, 16)}, "8x8 pixels, and `resolution=16x16` is requested"),
        ((first, second), {"noise": 1.0, "spp": None}, "noise = 1 and 2 repeats: .* Give `spp`"),
    ):
        with pytest.raises(InputError, match=message):
            picture_of("fig-8-9", files, **more)


def test_a_changed_picture_is_compared_again(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = ("compare", "fig-8-9", "--image", "x.exr", "--spp", 4, "--no-why", "-o", "out")
    records = []
    for value in (0.5, 0.5, 0.25):
        write(tmp_path / "x.exr", np.full((16, 16, 3), value))
        assert run(*words)[::2] == (0, "")
        path = tmp_path / "out/fig-8-9/comparison.json"
        records.append((path.stat().st_mtime_ns, path.read_text()))
    assert records[0] == records[1] != records[2]


# --- Large pictures ------------------------------------------------------------------------------


def test_changes_are_tried_at_a_sample_of_the_same_blocks(monkeypatch):
    """All of them in a small picture, with partial blocks at its edges; else as many as allowed."""
    rng = np.random.default_rng(4)
    picture, other = rng.random((2, 67, 90, 3))
    counted = rng.random((67, 90)) < 0.8
    whole = picture_mistakes.Blocks.of(picture, other, counted)
    tried = picture_mistakes.Tiles.of(picture, other, counted).blocks(lambda image: image)
    np.testing.assert_allclose(tried.picture, whole.picture, rtol=1e-12)
    np.testing.assert_allclose(tried.other, whole.other, rtol=1e-12)
    monkeypatch.setattr(picture_mistakes, "MOST_BLOCKS", 20)
    some = picture_mistakes.Tiles.of(picture, other, counted).blocks(lambda image: image)
    assert len(some.picture) == 20
    near = np.abs(some.picture[:, None] - whole.picture).max(axis=-1).min(axis=1)
    np.testing.assert_allclose(near, 0.0, atol=1e-12)


@pytest.mark.parametrize(("right", "down"), [(0.5, 0.0), (-3.0, 1.5), (0.0, -2.5)])
def test_a_shift_is_that_of_scipy(right, down):
    image = np.random.default_rng(5).random((9, 14, 3))
    expected = ndimage.shift(image, (down, right, 0), order=1, mode="nearest")
    found = picture_mistakes._shifted(image, right=right, down=down)
    np.testing.assert_allclose(found, expected, atol=1e-12)


@pytest.mark.parametrize("name", [None, "aces"])
def test_single_pictures_are_what_the_sums_of_their_passes_are(name):
    rng = np.random.default_rng(6)
    picture, light = rng.random((2, 20, 24, 3)).astype(np.float32)
    counted = rng.random((20, 24)) < 0.7
    tone_map = name and TONE_MAPS[name]
    plain = PassSums(counted) if name is None else MappedPassSums(counted, tone_map)
    still = StillSums(counted, tone_map)
    for sums in (plain, still):
        for _ in range(2):
            sums.add(picture, light)
    expected = plain.images()
    found = still.images()
    for part in ("heuristic", "reference", "reference_stderr", "difference.mean",
                 "difference.standard_error", "difference.noise", "difference.third",
                 "difference.grouped.means", "difference.grouped.places"):  # fmt: skip
        values = (attrgetter(part)(images) for images in (found, expected))
        np.testing.assert_allclose(*values, atol=2e-7, err_msg=part)
