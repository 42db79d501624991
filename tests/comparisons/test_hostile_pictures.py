"""Pictures as they should not be: each is refused in one message, or compared with a caution.

Half of a file, content of another kind, values that no renderer means, sizes from one pixel on. A
warning of a library is an error here, and none may write to standard error by itself.
"""

import os
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from fotismos.comparisons import picture_files
from fotismos.comparisons.compare import compare_pictures
from fotismos.comparisons.names import matching
from fotismos.comparisons.options import Options
from fotismos.heuristic.errors import InputError, NonFiniteError

SIZE = (24, 32)
"""Height and width of a sound picture."""

PARTS = (0.0, 0.02, 0.1, 0.5, 0.9, 0.99)
"""Shares of a file that are left of it."""


def sound(shape=SIZE, seed=0):
    """Return a picture with nothing odd in it, (H, W, 3)."""
    return np.random.default_rng(seed).uniform(0.1, 0.8, (*shape, 3)).astype(np.float32)


def exr(path, channels, kind=OpenEXR.scanlineimage, **header):
    """Write an EXR file of channels (H, W), or RGB (H, W, 3)."""
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": kind, **header}
    with OpenEXR.File(header, channels) as file:
        file.write(str(path))


def pfm(path, image):
    height, width = image.shape[:2]
    rows = np.ascontiguousarray(image[::-1], "<f4").tobytes()
    path.write_bytes(f"PF\n{width} {height}\n-1.0\n".encode() + rows)


def hdr(path, image):
    """Write a Radiance picture, uncompressed."""
    height, width = image.shape[:2]
    mantissa, exponent = np.frexp(image.max(axis=-1))
    scale = mantissa * 256 / image.max(axis=-1)
    rgbe = np.empty((height, width, 4), np.uint8)
    rgbe[..., :3] = image * scale[..., None]
    rgbe[..., 3] = exponent + 128
    head = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n"
    path.write_bytes(head.encode() + rgbe.tobytes())


def bitmap(path, image):
    Image.fromarray((image * 255).astype(np.uint8)).save(path)


WRITERS = {
    ".exr": lambda path, image: exr(path, {"RGB": image}),
    ".png": bitmap,
    ".jpg": bitmap,
    ".hdr": hdr,
    ".pfm": pfm,
    ".npy": np.save,
}


def compared(image, reference, **options):
    """Compare files as the command does."""
    words = {"image": image, "reference": reference}
    words = {half: matching(map(str, names)) for half, names in words.items()}
    return compare_pictures(Options(**words, **options), "x").record


def of_arrays(folder, image, reference=None):
    """Compare an array with another, or with a sound one of its size."""
    np.save(folder / "image.npy", image)
    other = sound(image.shape[:2], seed=1) if reference is None else reference
    np.save(folder / "reference.npy", other)
    return compared([folder / "image.npy"], [folder / "reference.npy"])


def refusal(capfd, files, reference, **options):
    """Return the message by which files are refused; nothing else is written."""
    with pytest.raises((InputError, NonFiniteError)) as caught:
        compared(files, [reference], **options)
    written = capfd.readouterr()
    assert written.out == written.err == ""
    message = str(caught.value)
    assert message.endswith(".")
    assert ".." not in message.replace("...", "").replace("../", "")
    return message


@pytest.fixture
def reference(tmp_path):
    path = tmp_path / "reference.npy"
    np.save(path, sound(seed=1))
    return path


# --- Files -------------------------------------------------------------------------------------


@pytest.mark.guarantee("runs", "Half a file, or one of another kind, is refused in one message.")
@pytest.mark.parametrize("suffix", WRITERS)
def test_damaged_files_are_refused_in_one_message(suffix, tmp_path, reference, capfd, rgb):
    """Files that end too soon, noise, folders, and content of another kind, 77 in all."""
    path = tmp_path / f"x{suffix}"
    WRITERS[suffix](path, sound())
    assert compared([path], [reference]).pixels.counted == 24 * 32
    content = path.read_bytes()
    random = np.random.default_rng(3).bytes(3000)
    damaged = [content[: int(part * len(content))] for part in PARTS]
    for wrong in (*damaged, random, bytes(3000)):
        path.write_bytes(wrong)
        message = refusal(capfd, [path], reference)
        assert message.startswith(f"{path}: not a readable {suffix[1:].upper()} file: ")
    for other, write in WRITERS.items():
        # Pillow tells PNG from JPEG by the content, and both are sRGB.
        if other != suffix and {other, suffix} != {".png", ".jpg"}:
            write(tmp_path / f"other{other}", sound())
            (tmp_path / f"other{other}").rename(path)
            assert "not a readable" in refusal(capfd, [path], reference)
    path.unlink()
    path.mkdir()
    assert "it is not a regular file" in refusal(capfd, [path], reference)


GREY = np.ascontiguousarray(sound()[..., 0])  # the library writes strided arrays wrongly


@pytest.mark.parametrize("half", [False, True])
@pytest.mark.parametrize("name", ["ZIP", "PXR24", "B44", "DWAA"])
def test_a_compression_that_hides_what_was_not_finite_is_named(rgb, tmp_path, name, half):
    values = np.ones((64, 64, 3), np.float16 if half else np.float32)
    values[3, 3], values[40, 40] = np.nan, np.inf
    path = tmp_path / "x.exr"
    exr(path, {"RGB": values}, compression=getattr(OpenEXR, f"{name}_COMPRESSION"))
    hides = name == "DWAA" or (name == "B44" and half)
    if not hides:
        with pytest.raises(NonFiniteError, match="2 of 4096 pixels"):
            picture_files.read_file(str(path))
        return
    (said,) = picture_files.read_file(str(path)).notes
    assert said == (
        f"its compression {name} has losses: what was NaN or infinite may be an ordinary number"
    )


LAYERED = {f"beauty.{c}": GREY for c in "RGB"}
WITHOUT_COLOURS = (
    ({"Z": GREY}, "", "Give R, G and B, or Y. Z is depth, or grey as pyexr writes it: name it Y."),
    ({"A": GREY}, "", "its channels are A. Give"),
    ({"Y": GREY, "RY": GREY, "BY": GREY}, "", "are luminance and chroma, Y, RY and BY. Save it as"),
    ({"x.Y": GREY, "x.RY": GREY, "x.BY": GREY}, ":x", "are luminance and chroma, x.Y, RY and BY"),
    ({"x.Y": GREY}, "", "it has no channel R. Its layers are x: give"),
    ({"R": GREY, "G": GREY}, "", "its channels are G, R. Give"),
    (LAYERED, "", "Its layers are beauty: give"),
    (LAYERED, ":beuty", "did you mean beauty?"),
    ({"RGB": sound()}, ":beauty", "it has R, G and B but no layer 'beauty'"),
)


@pytest.mark.parametrize(("channels", "layer", "message"), WITHOUT_COLOURS)
def test_channels_that_are_no_colours_are_refused(
    channels, layer, message, tmp_path, reference, capfd
):
    exr(tmp_path / "x.exr", channels)
    assert message in refusal(capfd, [f"{tmp_path / 'x.exr'}{layer}"], reference)


@pytest.mark.parametrize("channel", "BA")
def test_channels_with_fewer_samples_are_refused_by_name(channel, tmp_path, reference, capfd):
    path = tmp_path / "x.exr"
    exr(path, {"RGB": sound(), "A": np.ones(SIZE, np.float32)})
    content = path.read_bytes()
    entry = f"{channel}\0".encode() + bytes([2, 0, 0, 0, 0, 0, 0, 0])
    place = content.index(entry) + len(entry)
    path.write_bytes(content[:place] + bytes([2, 0, 0, 0, 2, 0, 0, 0]) + content[place + 8 :])
    message = refusal(capfd, [path], reference)
    assert f"its channel {channel} has one value for 2x2 pixels. Save it with" in message


def test_an_exr_may_be_grey(tmp_path, reference):
    """By a channel Y, in a layer or not, as other files of one channel."""
    exr(tmp_path / "x.exr", {"Y": GREY, "A": np.ones(SIZE, np.float32)})
    exr(tmp_path / "layer.exr", {"grey.Y": GREY})
    np.save(tmp_path / "x.npy", GREY)
    whole = compared([tmp_path / "x.npy"], [reference]).metrics["dE2000"].mean
    for name in ("x.exr", "layer.exr:grey"):
        found = compared([f"{tmp_path / name}"], [reference]).metrics["dE2000"].mean
        assert found == pytest.approx(whole, rel=1e-6)


def test_a_window_of_too_many_pixels_is_refused(tmp_path, reference, capfd):
    window = (np.array((0, 0), np.int32), np.array((200_000, 200_000), np.int32))
    exr(tmp_path / "x.exr", {"RGB": sound()}, displayWindow=window)
    message = refusal(capfd, [tmp_path / "x.exr"], reference)
    assert "its display window has 200001x200001 pixels, and at most" in message


def test_files_of_other_colours_or_windows_are_refused(tmp_path, reference, capfd):
    """Also several parts, objects of Python, and pipes."""
    colours = {"RGB": sound()}
    far = (np.array([50, 50], np.int32), np.array([81, 73], np.int32))
    exr(tmp_path / "primaries.exr", colours, chromaticities=(0.3,) * 8)
    exr(tmp_path / "window.exr", colours, displayWindow=far)
    samples = np.empty((1, 1), object)
    samples[0, 0] = np.array([0.1, 0.2], np.float32)
    deep = {"kind": OpenEXR.deepscanline, "compression": OpenEXR.ZIPS_COMPRESSION}
    exr(tmp_path / "deep.exr", {channel: samples for channel in "RGB"}, **deep)
    header = {"type": OpenEXR.scanlineimage}
    parts = [OpenEXR.Part(dict(header), dict(colours), name) for name in ("left", "right")]
    with OpenEXR.File(parts) as file:
        file.write(str(tmp_path / "parts.exr"))
    np.save(tmp_path / "objects.npy", np.array([None]), allow_pickle=True)
    Image.new("CMYK", (32, 24)).save(tmp_path / "inks.jpg")
    Image.fromarray(np.full((*SIZE, 4), 128, np.uint8)).save(tmp_path / "clear.png")
    os.mkfifo(tmp_path / "pipe.exr")
    for name, message in {
        "primaries.exr": "span no colours",
        "deep.exr": "it is deep, with several samples in a pixel. Flatten it.",
        "window.exr": "lies outside its display window",
        "parts.exr": "it has 2 parts, 'left', 'right'. Save the",
        "parts.exr:right": "it has 2 parts, 'left', 'right'",
        "objects.npy": "not a readable NPY file",
        "inks.jpg": "its colours are CMYK. Save it as RGB",
        "pipe.exr": "it is not a regular file",
        "x.tga": "pictures are .exr or .png or .jpg",
    }.items():
        assert message in refusal(capfd, [tmp_path / name], reference)
    for over in ("red", "1,2", "1,2,-3", "1,2,nan"):
        said = refusal(capfd, [tmp_path / "clear.png"], reference, over=over)
        assert f"over = {over} is not allowed" in said


def test_layers_are_those_of_exr_files(tmp_path, reference, capfd):
    for suffix in (".png", ".npy"):
        WRITERS[suffix](tmp_path / f"x{suffix}", sound())
        said = refusal(capfd, [f"{tmp_path / 'x'}{suffix}:beauty"], reference)
        assert "only EXR files have layers" in said


def test_unusual_files_are_read(tmp_path, reference):
    """Tiles, half precision, grey, palettes and odd names change nothing."""
    tiled = {"kind": OpenEXR.tiledimage, "tiles": OpenEXR.TileDescription()}
    exr(tmp_path / "tiled.exr", {"RGB": sound()}, **tiled)
    exr(tmp_path / "half.exr", {"RGB": sound().astype(np.float16)})
    for name in ("ü 漢字.npy", "ref[1].npy", "a:b.npy", "line\nbreak.npy", "-r.npy", "a*.npy"):
        np.save(tmp_path / name, sound())
    whole = of_arrays(tmp_path, sound()).metrics["dE2000"].mean
    names = [path for path in tmp_path.iterdir() if path.stem not in ("image", "reference")]
    assert len(names) == 8
    for path in names:
        found = compared([path], [reference]).metrics["dE2000"].mean
        assert found == pytest.approx(whole, rel=1e-3)
    grey = Image.fromarray((GREY * 255).astype(np.uint8))
    kinds = {mode: grey.convert(mode) for mode in ("L", "LA", "P", "1", "RGBA")}
    kinds["I;16"] = Image.fromarray((GREY * 65535).astype(np.uint16))
    for mode, picture in kinds.items():
        path = tmp_path / f"{mode.replace(';', '')}.png"
        picture.save(path)
        assert compared([path], [reference]).picture.notes == ("read as sRGB, as PNG files are",)


def test_the_same_repeat_is_not_given_twice(tmp_path, reference, capfd):
    """By its name, another spelling, or a link; copies are cautioned."""
    path = tmp_path / "a.npy"
    np.save(path, sound())
    (tmp_path / "link.npy").symlink_to(path)
    for other in (path, f"{tmp_path}/../{tmp_path.name}/a.npy", tmp_path / "link.npy"):
        assert "is given 2 times" in refusal(capfd, [path, other], reference)
    copy = tmp_path / "copy.npy"
    copy.write_bytes(path.read_bytes())
    np.save(tmp_path / "b.npy", sound(seed=5))
    files = [path, copy, tmp_path / "b.npy"]
    words = compared(files, [reference]).warnings
    assert any("Of the picture's 3 repeats, only 2 differ" in said for said in words)
    words = compared(files[:2], [path]).warnings
    assert any("repeats are the same file, byte for byte" in said for said in words)
    assert any("a.npy is also the reference." in said for said in words)
    assert any("copy.npy and" in said and "are the same file" in said for said in words)


def test_masks_must_fit(tmp_path, reference, capfd):
    np.save(tmp_path / "image.npy", sound())
    masks = (
        (np.ones((10, 10)), "the mask has 10x10 pixels, and the pictures 32x24"),
        (np.zeros(SIZE), "no pixel counts: the mask is black"),
        (np.full(SIZE, np.nan), "768 of 768 pixels, .* are NaN or infinite"),
    )
    for mask, message in masks:
        np.save(tmp_path / "mask.npy", mask)
        words = {"mask": str(tmp_path / "mask.npy")}
        said = refusal(capfd, [tmp_path / "image.npy"], reference, **words)
        assert message.split(".*")[-1].strip() in said
    for word in ("none.npy", "none.txt", os.devnull):
        assert word in refusal(capfd, [tmp_path / "image.npy"], reference, mask=word)


# --- Values and sizes --------------------------------------------------------------------------


def one(value):
    """Return a sound picture with one value of another size."""
    image = sound().astype(float)
    image[3, 4, 1] = value
    return image


def with_alpha(alpha):
    return np.concatenate([sound(), np.full((*SIZE, 1), alpha)], axis=-1)


REFUSED = (
    (one(np.nan), r"1 of 768 pixels, the first at (x, y) = (4, 3), are NaN or infinite"),
    (one(-np.inf), "(4, 3), are NaN or infinite"),
    (one(-1.0), "(4, 3), are negative"),
    (one(1.1e18), "(4, 3), are above 1e+18"),
    (np.full((*SIZE, 3), np.nan), "768 of 768 pixels"),
    (with_alpha(0.0), "the pictures are transparent, everywhere"),
    (with_alpha(np.nan), "are NaN or infinite"),
    (sound((25, 32)), "): the last is 1.04 times as high as the first"),
    (sound((32, 24)), "one of them looks turned by 90 degrees"),
    (sound() > 0.5, "type bool is not a picture"),
    (np.float64(3), "is not a picture"),
    (np.ones((2, 3, 4, 3)), "is not a picture"),
    (np.ones((*SIZE, 2)), "is not a picture"),
    (np.ones((0, 3, 3)), "it has no pixels"),
)


def test_codes_of_a_display_are_not_taken_for_light(tmp_path, reference, capfd):
    """A colour of 0 to 255 is above white, where nothing differs: it would pass."""
    path = tmp_path / "codes.npy"
    np.save(path, np.full((*SIZE, 3), 200, np.uint8))
    assert "an array of uint8 is not linear light" in refusal(capfd, [path], reference)
    assert compared([path], [reference], transfer="linear").picture  # as the user says


def test_values_that_are_no_picture_are_refused(tmp_path, reference, capfd):
    for image, message in REFUSED:
        np.save(tmp_path / "x.npy", image)
        assert message in refusal(capfd, [tmp_path / "x.npy"], reference)


def test_black_pictures_have_no_mistake_but_a_caution(tmp_path):
    """From 0 to subnormal values; two black ones are refused."""
    for value in (0.0, 1e-310, 1e-40, 1e-20, 1e-6):
        black = np.full((*SIZE, 3), value)
        for image, other, named in (
            (black, sound(), "picture"),
            (sound(), black, "picture to compare with"),
        ):
            record = of_arrays(tmp_path, image, other)
            assert record.caution.startswith(f"The {named} is black")
            assert record.agreement.mistakes == ()
        with pytest.raises(InputError, match="both pictures are black"):
            of_arrays(tmp_path, black, black)


def test_large_and_small_values_are_compared(tmp_path):
    for image in (one(1e18), one(1e-40), one(-1e-4), 1e17 * sound(), np.full((*SIZE, 3), 1e10)):
        for other in (sound(seed=1), 1e17 * sound(seed=1), 1e-4 * sound(seed=1)):
            record = of_arrays(tmp_path, image, other)
            assert np.isfinite(record.metrics["dE2000"].mean)
            assert np.isfinite(record.agreement.ratio).all()


SHAPES = ((1, 1), (1, 2), (40, 1), (2, 2), (5, 7), (2, 300))


def test_small_pictures_are_compared_and_not_said_to_be_moved(tmp_path):
    """Chance aligns the edges of few pixels, also of equal pictures."""
    for shape in SHAPES:
        assert of_arrays(tmp_path, sound(shape), sound(shape)).agreement.mistakes == ()
        for seed in range(2, 5):
            record = of_arrays(tmp_path, sound(shape, seed))
            said = " ".join(record.agreement.mistakes)
            assert "shifted" not in said, (shape, seed)
            assert "times as large" not in said, (shape, seed)
        record = of_arrays(tmp_path, np.full((*shape, 3), 0.5), np.full((*shape, 3), 0.3))
        assert "1.67 times as bright" in record.agreement.mistakes[0]
        assert "Each picture is one colour" in record.caution


def test_repeats_of_a_single_pixel_have_noise(tmp_path):
    names = [f"{half}{number}.npy" for half in "ir" for number in range(4)]
    for seed, name in enumerate(names):
        np.save(tmp_path / name, sound((1, 1), seed))
    record = compared([tmp_path / "i*.npy"], [tmp_path / "r*.npy"])
    assert record.metrics["dE2000"].noise_floor > 0


def test_the_command_ends_with_one_message_or_a_page(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    np.save("reference.npy", sound())
    np.save("dot.npy", sound((1, 1)))
    np.save("dot 2.npy", sound((1, 1), 1))
    Path("empty.exr").touch()
    bad = ("empty.exr", "none_*.exr", "none.exr", "none.tif", ".", "dot.npy", "reference.npy:b")
    for word in bad:
        code, said, error = run("compare", "-r", "reference.npy", "-t", word, "-o", "out")
        assert code == 2, word
        assert said == ""
        assert error.startswith("fotismos: error: ")
        assert error.count("\n") == 1
        assert not Path("out").exists()
    assert run("compare", "-r", "dot.npy", "-t", "dot 2.npy", "--figures")[0] == 0
    assert Path("out/index.html").is_file()
