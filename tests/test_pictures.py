"""Pictures of other renderers: read, placed, doubted in words, and compared."""

import json
import re

import mitsuba as mi
import numpy as np
import OpenEXR
import pytest
from PIL import Image

from comparisons.case import Request, open_case
from comparisons.compare import compare, prepare
from comparisons.comparison import PictureRecord
from comparisons.departure.metrics import METRICS
from comparisons.options import Options
from comparisons.pictures import picture_files, registration, suspicions
from comparisons.pictures.registration import TURNED
from heuristic.errors import InputError, NonFiniteError

SIDE = 64


def write(path, image, header=None, alpha=None):
    """Write an EXR as any program does: R, G and B without a layer."""
    channels = {c: np.ascontiguousarray(image[..., i], np.float32) for i, c in enumerate("RGB")}
    if alpha is not None:
        channels["A"] = np.ascontiguousarray(alpha, np.float32)
    attributes = {"type": OpenEXR.scanlineimage} | (header or {})
    with OpenEXR.File(attributes, channels) as file:
        file.write(str(path))
    return str(path)


@pytest.fixture(scope="module")
def cornell():
    """Two renderings of one scene: the reference with one seed, and the textbook's kernel."""
    mi.set_variant("llvm_ad_rgb")
    case = open_case("cornell-box", Request(resolution=(SIDE, SIDE), spp=512))
    ready = prepare(case.source, case.options)
    images = [np.array(half.render(5), float) for half in (ready.reference, ready.heuristic)]
    edges = registration.geometry_edges(ready.scene, SIDE, SIDE)
    return images[0], images[1], [edges, registration.picture_edges(images[1])]


def picture_of(scene, words, **more):
    asked = Request(image=words, spp=64, **more)
    case = open_case(scene, asked)
    return compare(case.source, case.options).record


# --- The same departure --------------------------------------------------------------------------


@pytest.mark.guarantee(
    "runs",
    "A picture from another run has that run's departure, to the file's precision.",
)
@pytest.mark.parametrize("scene", ["fig-8-9", "plastic-spheres"])
def test_a_picture_of_another_run_has_its_departure(run, tmp_path, monkeypatch, scene):
    monkeypatch.chdir(tmp_path)
    words = ("compare", scene, "--spp", 16, "--resolution", f"{SIDE}x48")
    assert run(*words, "-o", "own")[0] == 0
    file = f"own/{scene}/comparison.exr:heuristic"
    code, said, _ = run(*words, "--image", file, "-o", "theirs")
    assert code == 0
    assert said.splitlines()[1].startswith("shift ")
    first, second = (
        json.loads((tmp_path / out / scene / "comparison.json").read_text(encoding="utf-8"))
        for out in ("own", "theirs")
    )
    assert second["resolution"] == [SIDE, 48]
    for name in METRICS:
        found = first["metrics"][name]["mean"]
        assert second["metrics"][name]["mean"] == pytest.approx(found, rel=1e-6)
    assert second["picture"]["files"] == [file]
    assert second["heuristic"] == f"picture {file}"
    assert max(map(abs, second["picture"]["shift"])) < 0.3
    assert file in second["command"]
    page = (tmp_path / "theirs/index.html").read_text(encoding="utf-8")
    assert 0 < page.index("Its content lies") < page.index(f"Mean {METRICS['dE2000'].label}")


def test_a_png_has_it_to_its_bits(rgb, tmp_path):
    case = open_case("fig-8-9", Request(resolution=(SIDE, SIDE), spp=64))
    own = compare(case.source, case.options)
    shown = np.clip(picture_files.encoded(own.images.heuristic), 0, 1)
    Image.fromarray(np.round(shown * 255).astype(np.uint8)).save(tmp_path / "x.png")
    found = picture_of("fig-8-9", str(tmp_path / "x.png"), transfer="srgb")
    clipped = np.minimum(own.images.heuristic, 1)
    exact = picture_of("fig-8-9", write(tmp_path / "x.exr", clipped))
    means = [each.metrics["dE2000"].mean for each in (found, exact)]
    assert means[0] == pytest.approx(means[1], abs=0.1)
    linear = picture_of("fig-8-9", str(tmp_path / "x.png"), transfer="linear")
    assert abs(linear.metrics["dE2000"].mean - means[1]) > 1


def test_a_transfer_function_and_back():
    values = np.linspace(0, 1, 1001)
    np.testing.assert_allclose(picture_files.decoded(picture_files.encoded(values)), values,
                               atol=1e-7)  # fmt: skip
    assert picture_files.decoded(np.array([0.5]))[0] == pytest.approx(0.21404, abs=1e-5)


@pytest.mark.parametrize("bits", [8, 16])
def test_a_png_is_read_with_all_its_bits(rgb, tmp_path, bits):
    values = np.arange(48, dtype=np.uint32).reshape(4, 4, 3) * (2**bits // 50)
    kind = np.uint8 if bits == 8 else np.uint16
    mi.Bitmap(values.astype(kind)).write(str(tmp_path / "x.png"))
    found = picture_files.read(str(tmp_path / "x.png"), "linear")
    np.testing.assert_allclose(found, values / (2**bits - 1), atol=1e-7)


# --- Repeats -------------------------------------------------------------------------------------


def test_repeats_tell_the_pictures_noise(rgb, tmp_path, cornell):
    """Without a difference but noise, the floor is the departure; one file cannot tell."""
    clean = cornell[0]
    random = np.random.default_rng(3)
    files = [
        write(tmp_path / f"{number}.exr", clean * random.normal(1, 0.2, clean.shape).clip(0))
        for number in range(8)
    ]
    found = picture_of("cornell-box", tuple(files), seed=9)
    alone = picture_of("cornell-box", files[0], seed=9)
    several, one = (each.metrics["dE2000"] for each in (found, alone))
    assert found.picture.repeats == found.plan.passes == 8
    assert found.plan.spp == 64
    assert several.noise_floor > 0.7 * several.mean
    assert one.noise_floor < 0.7 * one.mean
    assert not any("one file" in words for words in found.warnings)
    assert any("one file" in words for words in alone.warnings)


def test_noise_of_repeats_is_not_marked_where_the_halves_have_none(rgb, tmp_path):
    """The plan of this scene is exact; pictures of it need not be."""
    case = open_case("lambert-sphere", Request(resolution=(32, 32), spp=64))
    clean = np.array(prepare(case.source, case.options).reference.render(5), float)
    random = np.random.default_rng(3)
    files = [
        write(tmp_path / f"{number}.exr", clean * random.normal(1, 0.3, clean.shape).clip(0))
        for number in range(8)
    ]
    found = picture_of("lambert-sphere", tuple(files))
    assert found.metrics["dE2000"].mean > 1
    assert found.significant.fraction < 0.1


# --- Where it lies -------------------------------------------------------------------------------


@pytest.mark.parametrize("x", [-3, -1, 0, 1, 2])
@pytest.mark.parametrize("y", [-2, 0, 1])
def test_a_shift_is_measured(cornell, x, y):
    reference, _, expected = cornell
    found = registration.measure(np.roll(reference, (y, x), (0, 1)), expected)
    assert (found.x, found.y) == (pytest.approx(x, abs=0.35), pytest.approx(y, abs=0.35))


@pytest.mark.parametrize("part", [0.25, 0.5, 0.75])
def test_part_of_a_pixel_is_measured(cornell, part):
    kernel = cornell[1]
    moved = (1 - part) * kernel + part * np.roll(kernel, 1, 1)
    found = registration.measure(moved, cornell[2])
    assert found.x == pytest.approx(part, abs=0.2)
    assert found.y == pytest.approx(0, abs=0.2)


def test_encoding_and_exposure_do_not_move_it(cornell):
    reference, _, expected = cornell
    plain = registration.measure(reference, expected)
    for other in (5 * reference, picture_files.encoded(reference), reference[..., ::-1]):
        found = registration.measure(other, expected)
        assert abs(found.x - plain.x) < 0.2
        assert abs(found.y - plain.y) < 0.2


def test_edges_that_tell_nothing_are_said_to(cornell):
    found = registration.measure(np.full((SIDE, SIDE, 3), 0.5), cornell[2])
    assert (found.x, found.y) == (None, None)
    record = PictureRecord(files=("x",), transfer=None, repeats=2, shift=None, edges=0.0,
                           ratio=(1.0, 1.0, 1.0))  # fmt: skip
    assert "do not show whether it is aligned" in next(
        suspicions.told(record, cornell[0], cornell[0], np.ones((SIDE, SIDE), bool))
    )


@pytest.mark.parametrize("how", TURNED)
def test_a_picture_that_is_turned_over_is_refused_by_its_edges(how):
    mi.set_variant("llvm_ad_rgb")
    case = open_case("fig-6-14", Request(resolution=(SIDE, SIDE), spp=64))
    ready = prepare(case.source, case.options)
    image = np.array(ready.heuristic.render(1), float)
    expected = [registration.geometry_edges(ready.scene, SIDE, SIDE)]
    registration.measure(image, expected)
    if how == "mirrored left to right":  # the triangle is symmetric
        registration.measure(TURNED[how](image), expected)
        return
    # Turned by 180 degrees it is the same as upside down, for the same reason.
    with pytest.raises(InputError, match="the picture is upside down: corrected, its edges"):
        registration.measure(TURNED[how](image), expected)


# --- What is odd, in words -----------------------------------------------------------------------

ODD = {
    "a missing pi": (lambda image: image * np.pi, "a missing division by pi"),
    "pi twice": (lambda image: image / np.pi, "a division by pi too many"),
    "exposure": (lambda image: image * 5, "times as bright as the reference: another exposure"),
    "white": (lambda image: image * [1, 0.9, 0.8], "another white"),
    "gamma": (picture_files.encoded, "sRGB-encoded: give --transfer srgb"),
    "gamma twice": (lambda image: image.clip(0) ** 2.2, "decoded twice"),
    "red and blue": (lambda image: image[..., ::-1], "channels look like blue, green, red"),
    "channels turned": (lambda image: np.roll(image, 1, 2), "channels look like green, blue, red"),
    "one pixel": (lambda image: np.roll(image, 1, 1), r"shifted by 1\.\d pixels to the right"),
    "two down": (lambda image: np.roll(image, 2, 0), r"and [12]\.\d pixels down"),
    "upside down": (lambda image: image[::-1], "looks upside down"),
    "mirrored": (lambda image: image[:, ::-1], "looks mirrored left to right"),
}


@pytest.mark.guarantee(
    "runs",
    "The comparison names each of twelve mistakes in how a picture was made.",
)
@pytest.mark.parametrize("name", ODD)
def test_a_mistake_in_a_picture_is_named(rgb, tmp_path, cornell, name):
    spoil, message = ODD[name]
    found = picture_of("cornell-box", write(tmp_path / "x.exr", spoil(cornell[0])))
    assert any(re.search(message, each) for each in found.picture.odd), found.picture.odd
    assert found.warnings[: len(found.picture.odd)] == found.picture.odd


@pytest.mark.parametrize("half", [0, 1])
def test_nothing_is_odd_about_a_right_picture(rgb, tmp_path, cornell, half):
    """The reference of another seed, and the kernel, whose shading is wrong but not its making."""
    found = picture_of("cornell-box", write(tmp_path / "x.exr", cornell[half]))
    assert [each for each in found.picture.odd if "one file" not in each] == []


def test_a_lamp_that_a_picture_clips_does_not_count_as_exposure():
    reference = np.array([[0.2, 0.3, 0.4], [40.0, 30.0, 20.0]])
    assert suspicions.ratios(reference.clip(0, 1), reference) == (1, 1, 1)
    assert suspicions.ratios(2 * reference, reference) == pytest.approx((2, 2, 2))


# --- Bad input -----------------------------------------------------------------------------------

GREY = np.full((8, 8, 3), 0.5)
NAN = np.where(np.arange(8)[None, :, None] == 3, np.nan, GREY)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda path: write(path, NAN), r"8 of 64 pixels, the first at .* = \(3, 0\), are NaN"),
        (lambda path: write(path, GREY - 0.6), "64 of 64 pixels, .* are negative. Colours outside"),
        (lambda path: write(path, GREY, alpha=np.full((8, 8), 0.5)), "alpha below 1"),
        (
            lambda path: write(path, GREY, {"chromaticities": (0.708, 0.292, 0.17, 0.797, 0.131,
                                                               0.046, 0.3127, 0.329)}),
            r"its primaries and white are \(0.708.*Convert it to BT.709",
        ),
        (
            lambda path: write(path, GREY, {"displayWindow": (np.array([0, 0], np.int32),
                                                              np.array([15, 15], np.int32))}),
            "it is cropped: its data window is 8x8 .* display window 16x16",
        ),
        (lambda path: path.write_bytes(b"no picture") and str(path), "not a readable EXR file"),
        (lambda path: f"{path}.tga", "pictures are .exr or .png files"),
        (lambda path: str(path), "there is no such file"),
        (lambda path: write(path, GREY) + ":beauty", "it has R, G and B but no layer 'beauty'"),
    ],
)  # fmt: skip
def test_what_is_no_picture_is_refused(rgb, tmp_path, make, message):
    with pytest.raises((InputError, NonFiniteError), match=f"(?s){message}"):
        picture_files.read(make(tmp_path / "x.exr"))


def layered(path, *names):
    """Write an EXR of which every channel is the number of its name, such as ``beauty.R``."""
    channels = {name: np.full((8, 8), number, np.float32) for number, name in enumerate(names)}
    with OpenEXR.File({"type": OpenEXR.scanlineimage}, channels) as file:
        file.write(str(path))
    return str(path)


def test_a_layer_is_read_by_its_name_and_others_are_named(rgb, tmp_path):
    names = [f"{layer}.{c}" for layer in ("a", "beauty") for c in "RGB"]
    path = layered(tmp_path / "x.exr", *names)
    expected = np.broadcast_to([3.0, 4.0, 5.0], (8, 8, 3))
    np.testing.assert_array_equal(picture_files.read(f"{path}:beauty"), expected)
    with pytest.raises(InputError, match=rf"no channel R. .* a, beauty: give {path}:a"):
        picture_files.read(path)
    with pytest.raises(InputError, match=r"no layer 'beuty' \(did you mean beauty\?\)"):
        picture_files.read(f"{path}:beuty")


@pytest.mark.parametrize("layer", ["", ":beauty"])
def test_a_picture_without_colours_is_refused_by_its_channels(rgb, tmp_path, layer):
    path = layered(tmp_path / "x.exr", "Z", "Y", "beauty.G")
    with pytest.raises(InputError, match=r"its channels are Y, Z, beauty.G. Give R, G and B"):
        picture_files.read(path + layer)


def test_what_is_no_png_is_refused(rgb, tmp_path):
    path = tmp_path / "x.png"
    path.write_bytes(b"no picture")
    with pytest.raises(InputError, match=r"x.png: not a readable PNG file"):
        picture_files.read(str(path), "srgb")


def test_a_png_needs_its_transfer_function(rgb, tmp_path):
    Image.fromarray(np.full((8, 8, 4), 128, np.uint8)).save(tmp_path / "x.png")
    with pytest.raises(
        InputError, match=r"a PNG does not state its transfer function.*--transfer srgb"
    ):
        picture_files.read(str(tmp_path / "x.png"))
    with pytest.raises(InputError, match="64 of 64 pixels have an alpha below 1"):
        picture_files.read(str(tmp_path / "x.png"), "srgb")


@pytest.mark.parametrize(
    ("shape", "more", "message"),
    [
        ((8, 12, 3), {}, "12x8 pixels, an aspect ratio of 1.5, and the scene's film .*x.*, 1"),
        ((8, 8, 3), {"resolution": (16, 16)}, "8x8 pixels, and --resolution 16x16 is requested"),
    ],
)
def test_another_size_is_refused(rgb, tmp_path, shape, more, message):
    with pytest.raises(InputError, match=message):
        picture_of("fig-8-9", write(tmp_path / "x.exr", np.full(shape, 0.5)), **more)


def test_repeats_are_alike_and_even(rgb, tmp_path):
    files = [write(tmp_path / f"{side}.exr", np.full((side, side, 3), 0.5)) for side in (8, 8, 9)]
    files[1] = write(tmp_path / "other.exr", GREY)
    with pytest.raises(InputError, match="pictures of 8x8, 9x9: give repeats of one size"):
        picture_of("fig-8-9", tuple(files))
    with pytest.raises(InputError, match="3 repeats: give one, or an even number"):
        picture_of("fig-8-9", (files[0], files[1], files[0]))
    with pytest.raises(InputError, match=r"noise = 1 and 2 repeats: .* Give --spp"):
        picture_of("fig-8-9", (files[0], files[1]), noise=1.0)


def test_a_picture_excludes_what_renders_again(run, tmp_path):
    file = write(tmp_path / "x.exr", GREY)
    with pytest.raises(InputError, match="heuristic blinn and image"):
        Options(heuristic="blinn", image=(file,))
    code, _, said = run("compare", "fig-8-9", "fig-8-8a", "--image", file)
    assert (code, "one scene" in said) == (2, True)


def test_a_changed_picture_is_compared_again(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = []
    for value in (0.5, 0.5, 0.25):
        write(tmp_path / "x.exr", np.full((16, 16, 3), value))
        code, _, said = run("compare", "fig-8-9", "--image", "x.exr", "--spp", 4, "-o", "out")
        assert (code, said) == (0, "")
        path = tmp_path / "out/fig-8-9/comparison.json"
        found.append((path.stat().st_mtime_ns, path.read_text(encoding="utf-8")))
    assert found[0] == found[1] != found[2]
