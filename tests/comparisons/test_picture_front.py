"""An engine's settings on one front of error against given time, judged without a scene."""

import hashlib
import json
import shlex
from pathlib import Path

import jsonschema
import numpy as np
import pytest

import fotismos
from fotismos.comparisons.departure.criterion import share_above
from fotismos.comparisons.departure.tone_maps import TONE_MAPS
from fotismos.heuristic.errors import InputError
from tests.shared.patches import patches
from tests.shared.schemas import schema

HEIGHT, WIDTH = 48, 64
UNKNOWN = "The reference is one file, so its noise is unknown"


def view(seed=0):
    return patches(HEIGHT, WIDTH, boxes=5, size=12, seed=seed)


def noisy(image, count, size, seed=1):
    random = np.random.default_rng(seed)
    return [image * (1 + size * random.normal(size=image.shape)).clip(0) for _ in range(count)]


def darkened(image, share):
    """An image of which the left columns, a share of all, are darker."""
    other = np.array(image)
    other[:, : round(share * WIDTH)] *= 0.5
    return other


@pytest.fixture
def files(tmp_path, monkeypatch):
    """Repeats of a reference, and pictures of three settings, in the current folder."""
    monkeypatch.chdir(tmp_path)
    for place, image in enumerate(noisy(view(), 6, 0.005)):
        np.save(f"truth_{place}.npy", image)
    for place, image in enumerate(noisy(darkened(view(), 0.3), 4, 0.02, seed=2)):
        np.save(f"ssao_{place}.npy", image)
    np.save("rtao.npy", darkened(view(), 0.03))
    np.save("off.npy", darkened(view(), 0.6))
    return tmp_path


SSAO = ("--picture", "SSAO @ 1.2ms=ssao_*.npy")
RTAO = ("--picture", "RTAO @ 4ms=rtao.npy")
SLOW = ("--picture", "off @ 5ms=off.npy")
ALL = ("cost", "-r", "truth_*.npy", *SSAO, *RTAO, *SLOW, "--machine", "RTX 3060")


@pytest.mark.guarantee("runs", "An engine's settings need no scene: pictures may judge them.")
def test_the_command_puts_settings_on_one_front_without_a_scene(run, files):
    code, said, _ = run(*ALL)
    assert code == 0
    answer = "Fastest that looks right: RTAO, 4 ms (at most 5 % of the pixels exceed ΔE2000 2)."
    assert f"\n{answer}\n\nout/cost" in said
    assert "off does not pass at ΔE2000 10" in said
    assert "RTAO is faster and better." in said
    assert "truth_0, 64x48: judged by 6 reference pictures; the noise of their mean gives" in said
    assert "Given pictures: times as given, on RTX 3060\n" in said
    folder = files / "out/cost/truth_0"
    record = json.loads((folder / "cost.json").read_text())
    jsonschema.Draft202012Validator(schema("engine")).validate(record)
    settings = {one["method"]: one for one in record["engine"]["settings"]}
    assert [one["front"] for one in settings.values()] == [True, True, False]
    assert record["reference_picture"]["files"] == [f"truth_{n}.npy" for n in range(6)]
    for part in (record["reference_picture"], settings["SSAO"]["picture"]):
        digests = [hashlib.sha256(Path(name).read_bytes()).hexdigest() for name in part["files"]]
        assert part["digests"] == digests
    assert record["warnings"] == []
    assert "mitsuba" not in record["versions"]
    shown = (folder / "index.html").read_text()
    for words in ("Given pictures", "Reference", "SSAO", "times as given, on RTX 3060", answer):
        assert words in shown
    for words in ("Ladder", "Measured", "What each effect"):
        assert words not in shown
    assert shown.count("data:image/webp") == 4
    made = {path.name for path in folder.glob("cost*")}
    assert made == {"cost.json", "cost.svg", "cost-reference.png"} | {
        f"cost-picture-{n}.png" for n in (1, 2, 3)
    }
    # The command of the record does the same again.
    words = shlex.split(record["command"].split(" cost ")[1])
    assert run("cost", *words, "-o", "again")[0] == 0
    assert json.loads((files / "again/cost/truth_0/cost.json").read_text()) == record


def test_a_threshold_decides_what_looks_right(run, files):
    _, said, _ = run(*ALL, "--within", 10)
    assert "Fastest that looks right: RTAO" in said
    assert "above 10" in said
    shown = (files / "out/cost/truth_0/index.html").read_text()
    assert "above <small>10</small>" in shown
    assert "--within 10<" in shown
    np.save("rtao.npy", darkened(view(), 0.2))
    assert "\nNo setting is sure to look right (at most 5 % of the pixels" in run(*ALL)[1]


def test_a_single_reference_has_unknown_noise_in_terminal_page_and_record(run, files):
    """Noise may be all of the difference: the intervals begin at 0."""
    code, said, _ = run("cost", "-r", "truth_0.npy", *RTAO)
    assert code == 0
    (row,) = (line for line in said.splitlines() if line.startswith("RTAO  "))
    assert UNKNOWN in said
    assert "judged by one reference picture, whose noise is unknown" in said
    assert row.count(" 0 to ") == 2
    folder = files / "out/cost/truth_0"
    record = json.loads((folder / "cost.json").read_text())
    jsonschema.Draft202012Validator(schema("engine")).validate(record)
    assert record["noise_floor"] is None
    assert UNKNOWN in record["warnings"][0]
    shown = " ".join((folder / "index.html").read_text().split())
    assert UNKNOWN in shown
    assert "with the noise of the single reference" in shown
    assert "dotted:" not in shown


# -- Errors ----------------------------------------------------------------------------------------


def settings_of(reference, pictures, **options):
    """The settings of arrays, by their names."""
    record = fotismos.cost(reference=reference, pictures=pictures, **options)
    return {one.method: one for one in record.engine.settings}


def test_repeats_of_a_reference_take_its_noise_out_and_a_single_one_keeps_it():
    """Of a right picture nothing is left with repeats; intervals hold the error without noise."""
    right, wrong = view(), darkened(view(), 0.3)
    exact = settings_of(right, {"right @ 1ms": right, "wrong @ 2ms": wrong})
    assert exact["right"].error.value == 0
    truth = exact["wrong"].error.value
    held = 0
    for seed in range(5):
        repeats = noisy(right, 8, 0.06, seed)
        found = settings_of(repeats, {"right @ 1ms": right, "wrong @ 2ms": wrong})
        alone = settings_of(repeats[0], {"right @ 1ms": right})["right"].error.value
        assert found["right"].error.low == 0
        assert found["right"].error.value < 0.2 * alone
        held += found["wrong"].error.low <= truth <= found["wrong"].error.high
    assert held >= 4


def test_one_picture_and_one_reference_are_as_far_as_two_pictures_are():
    image, other = noisy(view(), 1, 0.1)[0], darkened(view(), 0.2)
    one = settings_of(image, {"a @ 1ms": other})["a"]
    two = fotismos.compare(image=other, reference=image).comparison.record
    compared = two.metrics["dE2000"]
    assert one.error.value == pytest.approx(compared.mean)
    assert one.p95 == pytest.approx(compared.p95)
    for share in one.visible:
        assert share.value == share_above(compared.visible, share.threshold).value
    assert one.agreement.ratio == pytest.approx(two.agreement.ratio)


def test_a_tone_map_shows_the_reference_as_the_pictures_are():
    light = 3 * view()
    shown = TONE_MAPS["agx"](light)
    pictures = {"a @ 1ms": shown}
    mapped = settings_of(noisy(light, 6, 0.02), pictures, tone_map="agx")["a"]
    assert mapped.error.value < 0.3
    assert mapped.picture.tone_map == "agx"
    assert settings_of(light, pictures)["a"].error.value > 5


def test_the_pixels_that_count_are_the_same_for_all_settings(run, files):
    """Those in the mask, and opaque in all pictures: a hole in one is left out of the others."""
    mask = np.zeros((HEIGHT, WIDTH))
    mask[:, 4:] = 1
    alpha = np.ones((HEIGHT, WIDTH, 1))
    alpha[:8] = 0
    np.save("mask.npy", mask)
    np.save("rtao.npy", np.concatenate([view(), alpha], axis=-1))
    assert run(*ALL, "--mask", "mask.npy")[0] == 0
    record = json.loads((files / "out/cost/truth_0/cost.json").read_text())
    assert record["pixels"] == {
        "counted": (HEIGHT - 8) * (WIDTH - 4),
        "total": HEIGHT * WIDTH,
    }
    np.save("mask.npy", mask[:, :8])
    code, _, error = run(*ALL, "--mask", "mask.npy")
    assert (code, "the mask has 8x48 pixels, and the pictures 64x48" in error) == (2, True)


def test_a_picture_that_equals_the_reference_is_named_and_drawn(run, files):
    code, said, _ = run("cost", "-r", "truth_0.npy", "--picture", "same @ 1ms=truth_0.npy")
    assert code == 0
    assert "same: truth_0.npy is also the reference." in said
    assert "same passes at ΔE2000 1; nothing given does better." in said
    chart = (files / "out/cost/truth_0/cost.svg").read_text()
    assert "same" in chart
    assert "NaN" not in chart


# -- What is refused -------------------------------------------------------------------------------


def test_files_and_options_that_cannot_be_judged_are_refused(run, files):
    np.save("nan.npy", np.full((HEIGHT, WIDTH, 3), np.nan))
    np.save("black.npy", np.zeros((HEIGHT, WIDTH, 3)))
    np.save("clear.npy", np.zeros((HEIGHT, WIDTH, 4)))
    base = ("cost", "-r", "truth_*.npy")
    for words, reason in (
        (("cost", "-r", "none_*.npy", *RTAO), "none_*.npy: no file matches"),
        (("cost", "-r", "truth_0.npy", "-r", "truth_0.npy", *RTAO), "is given 2 times"),
        (
            (*base, "--picture", "a @ 1ms=nan.npy"),
            "nan.npy: 3072 of 3072 pixels, the first at (x, y) = (0, 0), are NaN",
        ),
        ((*base, "--picture", "a @ 1ms=clear.npy"), "no pixel counts"),
        ((*base, "--picture", "a=rtao.npy"), "has no time, which a front needs"),
        (("cost", "-r", "black.npy", "--picture", "a @ 1ms=black.npy"), "pictures are black"),
        ((*base, *RTAO, "--within", "2.1"), "2.1 is not a threshold of visible differences"),
        (("cost", *RTAO), "give a scene, or pictures, --reference and --picture"),
        (base, "give a scene, or pictures, --reference and --picture"),
        (
            (*base, *RTAO, "--at", "8x8", "--rounds", 3, "--kernel-time", "1ms", "--spp", 4),
            "--at, --kernel-time, --rounds, --spp: this needs a scene, and pictures have none.",
        ),
        (("cost", "fig-8-9", *RTAO, "--within", 3), "--within: it judges pictures without a scene"),
        (("cost", "fig-8-9", "-r", "off.npy"), "--reference is for pictures without a scene"),
    ):
        code, said, error = run(*words)
        assert (code, said) == (1 if "NaN" in reason else 2, ""), words
        assert reason in " ".join(error.split()), words
    assert not list((files / "out").glob("cost/*/cost.json"))
    # A picture that is black is judged, with a word on it.
    _, said, _ = run("cost", "-r", "truth_0.npy", "--picture", "a @ 1ms=black.npy")
    assert "a: The picture is black." in said


def test_python_takes_arrays_repeats_and_patterns(files):
    image = np.load("truth_0.npy")
    record = fotismos.cost(
        reference="truth_*.npy",
        pictures={
            "array @ 1ms": darkened(image, 0.1),
            "a=b: 1/2 @ 2 ms": noisy(image, 3, 0.01),
            "pattern @ 3ms": "ssao_*.npy",
            "path @ 4ms": Path("rtao.npy"),
        },
        machine="RTX 3060",
        name="room",
    )
    assert record.scene == "room"
    assert record.reference_picture.repeats == 6
    settings = {one.method: one for one in record.engine.settings}
    assert list(settings) == ["array", "a=b: 1/2", "pattern", "path"]
    assert [one.picture.repeats for one in settings.values()] == [1, 3, 4, 1]
    assert [one.seconds.value for one in settings.values()] == [1e-3, 2e-3, 3e-3, 4e-3]
    grey = np.full((8, 8, 3), 0.5)
    for name in ("a\0", "<b>*?[", "a" * 3000, "x.exr:layer"):
        assert list(settings_of(grey, {f"{name} @ 1ms": grey})) == [name]
    for pictures, options, reason in (
        ({"a": grey}, {}, "has no time"),
        ({"a @ 1ms": []}, {}, "has no picture"),
        ({"a @ 1ms": grey[0, 0]}, {}, r"an array of shape \(3,\) .* is not a picture"),
        ({"a @ 1ms": [grey, grey + 0.1, grey]}, {}, "3 repeats, of which only 2 differ"),
        ({"a @ 1ms": grey}, {"at": (8, 8), "spp": 4}, "`at`, `spp`: this needs a scene"),
        ({}, {}, "a scene of type NoneType"),
    ):
        with pytest.raises(InputError, match=reason):
            fotismos.cost(reference=grey, pictures=pictures, **options)


def test_a_black_picture_without_a_scene_may_be_allowed():
    black = np.zeros((8, 8, 3))
    found = settings_of(black, {"a @ 1ms": black}, allow_empty=True)["a"]
    assert "Both pictures are black, so their error means nothing." in found.agreement.odd
