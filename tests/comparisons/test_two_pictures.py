"""Two pictures without a scene, and a picture in place of a scene's reference."""

import json
import re
from pathlib import Path
from time import time

import numpy as np
import pytest
from PIL import Image
from scipy.ndimage import gaussian_filter

import fotismos
from fotismos.comparisons import compare, pictures
from fotismos.comparisons.case import open_case
from fotismos.comparisons.compare import compare_pictures
from fotismos.comparisons.departure import marks
from fotismos.comparisons.departure.colour import from_srgb, to_srgb
from fotismos.comparisons.departure.metrics import LEADING, METRICS
from fotismos.comparisons.departure.tone_maps import reinhard
from fotismos.comparisons.names import as_files
from fotismos.comparisons.options import Options
from fotismos.comparisons.picture_files import read_file
from fotismos.comparisons.prepared import prepare
from fotismos.heuristic.errors import InputError
from fotismos.reports import verdict
from tests.shared.patches import patches

SIDE = 64


def landscape(seed=0, side=SIDE):
    return patches(side, side, boxes=6, size=16, seed=seed)


def noisy(image, count, seed=1, size=0.1):
    random = np.random.default_rng(seed)
    factors = (1 + size * random.normal(size=image.shape) for _ in range(count))
    return [image * factor.clip(0) for factor in factors]


def record_of(image, reference, **options):
    """Return the record of two lists of arrays."""
    given = {"image": image, "reference": reference}
    arrays = {f"{half} {i}.npy": array for half in given for i, array in enumerate(given[half])}
    words = {half: tuple(name for name in arrays if name.startswith(half)) for half in given}
    with as_files(arrays):
        return compare_pictures(Options(**words, **options), "x").record


@pytest.mark.guarantee("runs", "Two pictures without a scene have no plan, price, effects, terms.")
def test_two_files_are_compared_without_a_scene(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    image = landscape()
    np.save("theirs.npy", image)
    np.save("mine.npy", 1.5 * image)
    code, said, _ = run("compare", "-r", "theirs.npy", "-t", "mine.npy", "--figures")
    assert code == 0
    assert "The picture is 1.5 times as bright as the reference" in said
    assert "After that, 0 % of the pixels differ visibly." in said
    record = json.loads((tmp_path / "out/mine/comparison.json").read_text())
    assert record["scene"] == "mine"
    absent = ("plan", "pairing", "price", "why", "variant", "integrator_given")
    assert [record[name] for name in absent] == [None] * len(absent)
    assert record["objects"] == record["materials"] == []
    assert record["picture"]["files"] == ["mine.npy"]
    assert len(record["picture"]["digests"][0]) == 64
    page = (tmp_path / "out/index.html").read_text()
    assert "<h3>Plan</h3>" not in page
    assert "Pairing:" not in page
    # The command of the record does the same again.
    words = record["command"].split(" compare ")[1].split()
    assert run("compare", *words, "-o", "again")[0] == 0
    again = json.loads((tmp_path / "again/mine/comparison.json").read_text())
    assert again["metrics"] == record["metrics"]


DATA = r'<script type="application/json" id="page-data">(.*?)</script>'


@pytest.fixture
def two(tmp_path, monkeypatch):
    """The words that compare two pictures of the current folder, one of which is turned."""
    monkeypatch.chdir(tmp_path)
    image = landscape()
    np.save("theirs.npy", image)
    np.save("mine.npy", image[::-1])
    return ("compare", "-r", "theirs.npy", "-t", "mine.npy")


def test_the_first_page_has_the_verdict_and_reloads_into_the_whole(run, two, monkeypatch):
    pages = []

    def finish(*first):
        pages.append(Path("out/index.html").read_text())
        return compare.finish(*first)

    monkeypatch.setattr("fotismos.reports.run.pictures.finish", finish)
    assert run(*two)[0] == 0
    pages.append(Path("out/index.html").read_text())
    first, whole = pages
    before, after = (json.loads(re.search(DATA, page)[1])["scenes"][0] for page in pages)
    for key in ("name", "shares", "verdicts", "mean", "images", "regions"):
        assert before[key] == after[key]
    begun, ended = (json.loads(re.search(DATA, page)[1])["written"] for page in pages)
    assert 0 < time() - begun / 1000 < 600
    assert ended is None
    assert ("In progress" in first, "In progress" in whole) == (True, False)
    for later in (
        "The picture looks upside down",
        f'<th scope="row">{METRICS["ldr_flip"].label}</th>',
    ):
        assert later not in first
        assert later in whole


@pytest.mark.parametrize(("bound", "code", "decision"), [(None, 0, "fail"), ("100%", 0, "pass")])
def test_a_quiet_command_prints_one_line_that_scripts_can_cut(run, two, bound, code, decision):
    """The decision is that of the gate, if there is one."""
    gate = ("--max-visible", bound) if bound else ()
    ended, said, _ = run(*two, "-q", *gate)
    share, mean, word = said.removesuffix("\n").split("\t")
    lead = json.loads(Path("out/mine/comparison.json").read_text())["metrics"]["dE2000"]
    (visible,) = [one["value"] for one in lead["visible"] if one["threshold"] == 2]
    assert (ended, word) == (code, decision)
    assert float(share) == pytest.approx(visible, rel=1e-5)
    assert float(mean) == pytest.approx(lead["mean"], rel=1e-5)


@pytest.mark.parametrize(("fault", "code"), [(InputError("late"), 2), (KeyboardInterrupt(), 130)])
def test_a_first_page_does_not_outlive_its_command(run, two, monkeypatch, fault, code):
    def finish(*first):
        assert Path("out/index.html").is_file()
        raise fault

    monkeypatch.setattr("fotismos.reports.run.pictures.finish", finish)
    assert run(*two)[0] == code
    assert not Path("out").exists()


@pytest.mark.parametrize(("first", "second"), [(8, 8), (8, 6), (3, 2), (5, 1), (1, 4)])
def test_repeats_of_any_number_give_the_noise(first, second):
    """The floor is that of the noise of both means; all repeats count in the mean."""
    image = landscape()
    record = record_of(noisy(image, first, 1), noisy(image, second, 2))
    error = 0.1 * np.sqrt((1 / first if first > 1 else 0) + (1 / second if second > 1 else 0))
    floors = [
        float(LEADING(image * (1 + error * draw), image).mean())
        for draw in np.random.default_rng(5).normal(size=(8, *image.shape))
    ]
    found = record.metrics["dE2000"].noise_floor
    assert found == pytest.approx(np.mean(floors), rel=0.25)
    assert record.picture.repeats == first
    assert any("one file" in words for words in record.warnings) == (1 in (first, second))


def test_every_repeat_counts_in_the_mean():
    images = [np.full((16, 16, 3), value) for value in (0.1, 0.2, 0.6)]
    with as_files({f"{i}.npy": image for i, image in enumerate(images)}):
        files = tuple(read_file(f"{i}.npy") for i in range(3))
    given = pictures.Pictures(names=("a", "b", "c"), files=files)
    for count in (2, 3):
        passes = [image[0, 0, 0] for image in given.passes(count)]
        parts = [images[number::count] for number in range(count)]
        assert passes == pytest.approx([np.mean([i[0, 0, 0] for i in part]) for part in parts])


def test_single_pictures_tell_a_difference_from_noise():
    """A change that is alike over a tile is certain; noise of each pixel is not, however large."""
    image = landscape()
    apart = record_of([1.3 * image], [image])
    assert apart.significant.certain
    for seed in range(5):
        first, second = noisy(image, 2, seed, 0.3)
        record = record_of([first], [second])
        assert record.metrics["dE2000"].mean > 3
        assert not record.significant.certain
    assert any("noise is unknown" in words for words in record.warnings)


@pytest.mark.parametrize("copies", [1, 4])
def test_the_noise_of_one_picture_beside_repeats_is_no_certain_difference(copies):
    """Copies of one file show no noise either."""
    image = landscape()
    apart = record_of([1.3 * image] * copies, noisy(image, 4, size=0.3))
    assert apart.significant.certain
    for seed in range(10):
        record = record_of(noisy(image, 1, seed, 0.3) * copies, noisy(image, 4, 100 + seed, 0.3))
        assert record.metrics["dE2000"].mean > 3
        assert not record.significant.certain
        assert record.significant.fraction == 0
        assert verdict.decision(record) == "undecided"


def discs(seed, width=32, height=24):
    """Return discs of low contrast."""
    random = np.random.default_rng(seed)
    y, x = np.mgrid[:height, :width]
    image = np.full((height, width, 3), 0.1)
    for _ in range(8):
        centre = random.uniform(0, (width, height))
        radius = random.uniform(2, 9)
        inside = np.hypot(x - centre[0], y - centre[1]) < radius
        image[inside] = random.uniform(0.1, 0.25, 3)
    return image


def test_noise_that_resampling_takes_away_is_no_other_size():
    for seed in range(9, 13):
        random = np.random.default_rng(seed)
        image = discs(seed)
        repeats = [image * random.gamma(25, 1 / 25, (24, 32, 1)) for _ in range(5)]
        record = record_of(repeats[:1], repeats[1:])
        assert "times as large" not in " ".join(record.agreement.mistakes)


@pytest.mark.parametrize("factor", [0.01, 1 / 30, 1 / 683, 0.1, 0.5, 2, 683])
def test_a_factor_is_named_however_small(factor):
    image = landscape()
    agreement = record_of([factor * image], [image]).agreement
    (sentence,) = agreement.mistakes
    assert f"is {factor:.3g} times as bright as the reference" in sentence
    assert agreement.ratio == pytest.approx([factor] * 3, rel=1e-4)


def test_a_factor_is_named_as_the_round_number_that_its_reading_allows():
    """8 bits know a factor to about a percent; a factor of 3 in floats is not pi."""
    image = 0.4 * landscape()
    codes = from_srgb(np.round(255 * to_srgb(0.5 * image)) / 255)
    for given, words in (
        (codes, "is 0.5 times as bright"),
        (3 * image, "is 3 times as bright as the reference: another exposure"),
        (np.pi * image, "is 3.14 times as bright as the reference: a missing division by pi"),
    ):
        assert words in record_of([given], [image]).agreement.mistakes[0]


TURNS = {
    "upside down": np.flipud,
    "mirrored left to right": np.fliplr,
    "turned by 180 degrees": lambda image: np.rot90(image, 2),
    "turned by 90 degrees clockwise": lambda image: np.rot90(image, -1),
    "turned by 90 degrees anticlockwise": np.rot90,
    "mirrored at the diagonal from top left": lambda image: np.swapaxes(image, 0, 1),
    "mirrored at the diagonal from top right": lambda image: np.rot90(image, 2).swapaxes(0, 1),
}


@pytest.mark.parametrize("how", TURNS)
def test_a_turned_picture_is_certain_to_differ(how):
    """Though it is one file, whose noise is unknown: no noise is a turn. Nor are values it."""
    image = discs(3, 48, 48)
    for values in (image, (2 * image) ** 0.7):
        record = record_of([TURNS[how](values)], [image])
        assert f"The picture looks {how}," in record.agreement.mistakes[0]
        assert "After that, 0 % of" in record.agreement.mistakes[-1]
        assert verdict.decision(record) == "fail"
        assert "Noise may explain" not in verdict.sentence(record)


def test_a_quarter_turn_of_a_wide_picture_is_named_with_its_size():
    with pytest.raises(InputError, match="one of them looks turned by 90 degrees"):
        record_of([np.rot90(discs(3))], [discs(3)])


@pytest.mark.parametrize("seed", range(3))
def test_a_factor_with_a_power_is_no_tone_map(seed):
    """Of codes of 8 bits, too; a tone map stays one."""
    image = 0.8 * landscape(seed)
    light = 1.2 * image
    shown = from_srgb(np.round(255 * to_srgb(light ** (1 / 1.8))) / 255)
    for picture in (light ** (1 / 1.8), shown):
        (sentence,) = record_of([picture], [image]).agreement.mistakes
        assert re.search(r"raised to the power 0\.5[56]\d? and multiplied by 1\.1[01]?:", sentence)
    (sentence,) = record_of([reinhard(4 * image)], [image]).agreement.mistakes
    assert "tone_map=reinhard`. It was given 4 times" in sentence


def test_pictures_of_different_scenes_are_called_that():
    """Without a shift, a factor or advice on samples; the same scene lit otherwise is the same."""
    for seed in range(4):
        image = discs(seed, 64, 48)
        record = record_of([discs(50 + seed, 64, 48)], [image])
        (sentence,) = record.agreement.mistakes
        assert "show different scenes, or different views" in sentence
        assert "More" not in verdict.about(record)
        slope = np.linspace(0.2, 2, 64)[:, None]
        record = record_of([image * slope], [image * slope[::-1]])
        assert "different scenes" not in " ".join(record.agreement.mistakes)


@pytest.mark.parametrize("factor", [1.3, 2])
@pytest.mark.parametrize("seed", range(3))
def test_a_smooth_picture_that_is_brighter_is_neither_shifted_nor_of_another_white(factor, seed):
    """In codes of 8 bits, whose steps make edges."""
    y, x = np.mgrid[:48, :64]
    random = np.random.default_rng(seed)
    image = np.full((48, 64, 3), 0.05)
    for _ in range(3):
        place = random.uniform(0, (64, 48))
        size = random.uniform(15, 35)
        bump = np.exp(-((x - place[0]) ** 2 + (y - place[1]) ** 2) / (2 * size**2))
        image += random.uniform(0.02, 0.1, 3) * bump[..., None]
    pair = [from_srgb(np.round(255 * to_srgb(part * image)) / 255) for part in (factor, 1)]
    (sentence,) = record_of(pair[:1], pair[1:]).agreement.mistakes
    assert f"is {factor:g} times as bright" in sentence


def test_equal_pictures_with_noise_show_no_difference_beyond_it():
    image = landscape()
    record = record_of(noisy(image, 4, 1, 0.07), noisy(image, 4, 2, 0.07))
    if verdict.decision(record) == "undecided":
        assert "x: undecided, no difference beyond noise" in verdict.headline([record])
    assert record.agreement.mistakes == ()


def test_a_change_fails_in_noise_that_is_as_large_and_noise_alone_is_undecided():
    image = landscape(side=128)
    changed = image.copy()
    changed[32:80, 32:80] *= 0.6
    reference = noisy(image, 4, size=0.15)
    for given, decision, said in (
        (changed, "fail", "differs visibly"),
        (image, "undecided", "x: undecided, no difference beyond noise"),
    ):
        record = record_of(noisy(given, 4, seed=2, size=0.15), reference)
        assert verdict.decision(record) == decision
        assert said in verdict.headline([record])


@pytest.mark.guarantee("marks", "Filtered noise of single pictures is not taken for a difference.")
def test_the_filtered_noise_of_single_pictures_is_no_certain_difference():
    """A Gaussian of up to 2 pixels makes neighbours alike; changes of a part are still found."""
    random = np.random.default_rng(4)
    everywhere = np.ones((96, 128), bool)
    part = np.ones((96, 128, 1))
    part[:64, :64] = 1.3
    false = found = 0
    for width in (0, 0.5, 1, 1.5, 2):
        for _ in range(40):
            noise = 0.3 * random.normal(size=(2, 96, 128, 3))
            first, second = (0.5 + gaussian_filter(each, (width, width, 0)) for each in noise)
            false += marks._is_even(first - second, everywhere)
            found += marks._is_even(first * part - second, everywhere)
    assert false <= 6  # of 200: three times the stated rate
    assert found >= 180


def test_a_mask_and_alpha_say_which_pixels_count(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    image = landscape()
    changed = image.copy()
    changed[:, :32] *= 3
    mask = np.zeros((SIDE, SIDE), np.uint8)
    mask[:, 32:] = 255
    Image.fromarray(mask).save("mask.png")
    np.save("a.npy", image)
    np.save("b.npy", changed)
    np.save("alpha.npy", np.concatenate([changed, mask[..., None] / 255.0], axis=-1))
    words = ("compare", "-r", "a.npy", "--max-visible", 0)
    assert run(*words, "-t", "b.npy")[0] == 1
    assert run(*words, "-t", "b.npy", "--mask", "mask.png", "-o", "masked")[0] == 0
    assert run(*words, "-t", "alpha.npy", "-o", "alpha")[0] == 0
    record = json.loads((tmp_path / "masked/b/comparison.json").read_text())
    assert record["pixels"] == {"counted": SIDE * SIDE // 2, "total": SIDE * SIDE}
    assert run(*words, "-t", "alpha.npy", "--over", "black", "-o", "over")[0] == 1


def test_a_mask_says_which_pixels_of_a_rendering_count(run, tmp_path, monkeypatch):
    """Without any picture; one of another size is refused."""
    monkeypatch.chdir(tmp_path)
    mask = np.zeros((16, 16), np.uint8)
    mask[4:8, 4:8] = 255
    Image.fromarray(mask).save("mask.png")
    words = ("compare", "fig-8-9", "--spp", 4, "--no-why", "--mask", "mask.png", "--resolution")
    assert run(*words, "16x16")[0] == 0
    record = json.loads((tmp_path / "out/fig-8-9/comparison.json").read_text())
    assert record["pixels"]["counted"] == 16
    code, _, error = run(*words, "8x8")
    assert code == 2
    assert "the mask has 16x16 pixels, and the pictures 8x8" in error
    # An empty variable of a shell names no mask, nor does a link that goes round.
    Path("round.png").symlink_to("round.png")
    for word, message in (("", "pictures are .exr or"), ("round.png", "there is no such file")):
        code, _, error = run("compare", "fig-8-9", "--mask", word, "--resolution", "16x16")
        assert code == 2
        assert message in error


def test_what_cannot_be_compared_is_refused():
    grey = np.full((8, 8, 3), 0.5)
    with pytest.raises(InputError, match="two pictures are needed"):
        record_of([grey], [])
    with pytest.raises(InputError, match="`spp`: this needs a scene"):
        record_of([grey], [grey], spp=4)


def test_commands_without_a_scene_or_pictures_say_what_is_missing(run):
    for words in (("compare",), ("compare", "-t", "a.npy"), ("compare", "-r", "a.npy")):
        code, _, error = run(*words)
        assert code == 2
        assert "give a scene, or two pictures, --reference and --image" in " ".join(error.split())


def test_how_pictures_are_read_is_not_said_without_any(run):
    for command, cure in (("compare", "--image or --reference"), ("fit", "--reference")):
        for option, value in (("--transfer", "srgb"), ("--over", "black")):
            code, _, error = run(command, "fig-8-9", option, value)
            assert code == 2
            assert f"{option}: it says how pictures are read. Give {cure}." in error


# --- A picture in place of the reference ---------------------------------------------------------


@pytest.mark.guarantee("runs", "A picture may replace the reference of a scene.")
def test_a_picture_replaces_the_reference_of_a_scene(run, tmp_path, monkeypatch):
    """The reference of an earlier run, given as a picture, is as far as it was there."""
    monkeypatch.chdir(tmp_path)
    words = ("compare", "plastic-spheres", "--spp", 16, "--resolution", "64x48")
    assert run(*words, "--no-why", "-o", "own")[0] == 0
    own = json.loads((tmp_path / "own/plastic-spheres/comparison.json").read_text())
    file = "own/plastic-spheres/comparison.exr:reference"
    code, said, _ = run(*words, "--reference", file)
    assert code == 0
    assert "Textbook shading differs visibly from the reference in" in said
    record = json.loads((tmp_path / "out/plastic-spheres/comparison.json").read_text())
    found, expected = (each["metrics"]["dE2000"]["mean"] for each in (record, own))
    assert found == pytest.approx(expected, rel=1e-3)
    assert record["plan"] is record["price"] is record["picture"] is None
    assert record["objects"] == own["objects"] != []
    assert record["reference_picture"]["files"] == [file]
    assert max(map(abs, record["agreement"]["shift"])) < 0.3


def test_a_notebook_compares_arrays():
    image = landscape()
    shown = fotismos.compare(image=1.5 * image, reference=noisy(image, 4, size=0.02))
    record = shown.comparison.record
    assert record.picture.files == ("image 1.npy",)
    assert record.reference_picture.repeats == 4
    assert "1.5 times as bright" in repr(shown)
    with pytest.raises(InputError, match="a scene of type NoneType"):
        fotismos.compare(image=image)


@pytest.mark.thorough
def test_parameters_are_fitted_to_a_picture_of_another_renderer(run, tmp_path, monkeypatch, rgb):
    """Of repeats of the scene's own reference they are those of a fit of the scene."""
    monkeypatch.chdir(tmp_path)
    case = open_case("fig-8-9", Options(resolution=(48, 48), spp=64))
    half = prepare(case.source, case.options).reference
    for seed in range(4):
        np.save(f"theirs_{seed}.npy", np.array(half.render(seed)))
    words = ("fit", "fig-8-9", "--form", "phong", "--json")
    fitted = {}
    for name, more in (
        ("scene", ("--resolution", "48x48")),
        ("pictures", ("--reference", "theirs_*.npy")),
    ):
        code, said, _ = run(*words, *more, "-o", name)
        assert code == 0
        fitted[name] = json.loads(said)[0]
    assert fitted["pictures"]["resolution"] == [48, 48]
    values = {}
    for name, record in fitted.items():
        (material,) = record["fits"][0]["materials"]
        values[name] = [parameter["fitted"] for parameter in material["parameters"]]
    assert values["pictures"] == pytest.approx(values["scene"], rel=0.02)
    assert run("fit", "fig-8-9", "--reference", "none.npy")[0] == 2


@pytest.mark.parametrize("count", [1, 4])
def test_a_blurred_picture_is_not_called_shifted(count):
    for seed in range(4):
        image = landscape(seed)
        blurred = gaussian_filter(image, (1.5, 1.5, 0))
        noise = 0.03 if count > 1 else 0.0
        record = record_of(noisy(blurred, count, 1, noise), noisy(image, count, 2, noise))
        assert "shifted" not in " ".join(record.agreement.mistakes)


@pytest.mark.parametrize("moved", [(0, 1), (-2, 0)])
def test_a_blurred_picture_that_is_shifted_is_said_to_be(moved):
    image = landscape(3)
    blurred = gaussian_filter(np.roll(image, moved, axis=(0, 1)), (1, 1, 0))
    record = record_of([blurred], [image])
    assert "shifted by" in " ".join(record.agreement.mistakes)
