"""Checks of pictures from any renderer tell noise from drift, by command and over many runs."""

import hashlib
import json
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from PIL import Image
from scipy import ndimage, stats

from fotismos.comparisons.check.pictures import Repeats, check_pictures, picture_gate
from tests.benchmarks import gates
from tests.shared.outputs import write
from tests.shared.schemas import schema

TRUTH = gates.TRUTH[..., 0]


@pytest.fixture
def check(run, tmp_path, monkeypatch):
    """A function that checks repeats, of the truth times something, against a baseline of four."""
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(8)

    def checked(count, factor, *words):
        for path in tmp_path.glob("*.exr"):
            path.unlink()
        for number in range(count):
            noise = 1 + 0.02 * rng.standard_normal((*TRUTH.shape[:2], 1))
            write(tmp_path / f"{number}.exr", TRUTH * noise * factor)
        return run("check", "b", "--picture", "hall=?.exr", *words)

    code, printed, _ = checked(4, 1, "--update")
    assert (code, "smaller ones may be missed" in printed) == (0, True)
    return checked


@pytest.mark.guarantee("checks", "A constant change of a picture is named, with its factor.")
def test_repeats_pass_and_a_factor_fails_by_name(check):
    jsonschema.validate(json.loads(Path("b/hall.json").read_text()), schema("pictures"))
    assert [check(count, 1)[0] for count in (1, 2, 4)] == [0, 0, 0]
    code, printed, _ = check(2, 1.01322, "--json", "--junit", "j.xml")
    jsonschema.validate(json.loads(printed), schema("check"))
    (checked,) = json.loads(printed)["checks"]
    names = checked["picture"]["files"]
    assert len(names) == 2
    digests = [hashlib.sha256(Path(name).read_bytes()).hexdigest() for name in names]
    assert checked["picture"]["digests"] == digests
    cause = checked["causes"][0]
    value, half = map(float, cause.split("factor of ")[1].split(",")[0].split(" ± "))
    assert (code, abs(value - 1.01322) < 2 * half < 0.004) == (1, True)
    for path in ("out/check/index.html", "j.xml"):
        assert cause in Path(path).read_text()
    local = np.ones((*TRUTH.shape[:2], 1))
    local[16:32, 32:48] = 1.1
    assert "in 1 of 12 blocks, most in row 2, column 3" in check(3, local)[1]


def test_what_cannot_be_checked_ends_with_2(run, check, tmp_path):
    check(4, 1)
    write(tmp_path / "wide.exr", np.ones((8, 9, 3)))
    write(tmp_path / "nan.exr", np.full((48, 64, 3), np.nan))
    for place, factor in enumerate((1, 1.5, 1.5)):
        write(tmp_path / f"twin{place}.exr", TRUTH * factor)
    (tmp_path / "text.exr").write_text("no picture")
    for words, expected in {
        "--picture hall=wide.exr": "pictures of 9x8, 64x48",
        "--picture hall=nan.exr": "NaN or infinite",
        "--picture hall=twin?.exr": "give each its own seed",
        "--picture hall=text.exr": "not a readable EXR",
        "--picture hall=gone*.exr": "no file matches",
        "--picture hall=?.exr --picture roof=?.exr": "roof.json: No such file",
        "--picture hall=0.exr --update": "two repeats or more",
        "--picture hall=?.exr --update --spp 4": "--spp: pictures are not rendered",
        "": "Give --picture hall",
        "--update": "Give --picture hall",
    }.items():
        code, printed, messages = run("check", "b", *words.split())
        assert (code, expected in printed + messages) == (2, True), messages
        assert "Traceback" not in messages
    for name in ("equal0.exr", "equal1.exr"):
        write(tmp_path / name, TRUTH)
    assert "its own seed" in run("check", "c", "--update", "--picture", "e=equal?.exr")[1]
    Path("b/mine.json").write_text("{}")
    assert run("check", "b/mine.json", "--update", "--picture", "mine=?.exr")[0] == 2
    assert Path("b/mine.json").read_text() == "{}"
    (tmp_path / "b/hall.exr").write_bytes((tmp_path / "0.exr").read_bytes())
    assert check(4, 1)[0] == 2


def test_an_update_keeps_how_pictures_are_read(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for number in range(2):
        values = np.random.default_rng(number).integers(100, 120, (16, 16, 4), np.uint8)
        Image.fromarray(values).save(f"{number}.png")
    code, _, messages = run("check", "b", "--update", "--picture", "wall=?.png")
    assert code == 2
    assert "have an alpha below 1" in messages
    for words in (("--over", "white", "--transfer", "srgb"), ()):
        assert run("check", "b", "--update", "--picture", "wall=?.png", *words)[0] == 0
        made = json.loads(Path("b/wall.json").read_text())
        assert (made["over"], made["transfer"]) == ("white", "srgb")
        assert min(made["mean"]) > 0.5  # of white, since the front is transparent and dark
    assert run("check", "b", "--picture", "wall=?.png")[0] == 0


QUICK = ("Gaussian, 10 %", "filtered gamma", "two values at 5 pixels")


@pytest.mark.guarantee(
    "checks", "Pictures of any noise alarm no more often than stated; power is as printed."
)
@pytest.mark.parametrize(
    ("noise", "level", "rounds", "counts"),
    [*((name, 0.05, 3, (2,)) for name in QUICK)]
    + [pytest.param(name, 0.01, 20, gates.COUNTS, marks=pytest.mark.slow) for name in gates.NOISES],
)
def test_alarms_and_power_are_as_stated(noise, level, rounds, counts, monkeypatch):
    monkeypatch.setattr(gates, "LEVEL", level)
    for count in counts:
        alarms, power, _ = gates.measured(gates.drawn(noise), count, 100 * rounds, gates.ours)
        assert alarms[0, 0] * 100 * rounds <= stats.binom.ppf(0.999, 100 * rounds, level)
        assert power[:, 0].min() > 0.9
        assert "Gaussian" not in noise or np.abs(power[:, 1] - 0.95).max() < 0.03


def correlated(kind, rng, size=96):
    """Noise (size, size, 3) that pixels share in one of several ways."""
    free = rng.normal(size=(size, size, 3))
    match kind:
        case "a tile":
            return np.tile(rng.normal(size=(16, 16, 3)), (size // 16, size // 16, 1))
        case "columns":
            return 0.7 * (free + rng.normal(size=(1, size, 3)))
        case "a blur":
            return 30 * ndimage.gaussian_filter(free, (10, 10, 0), mode="wrap")
    return free


@pytest.mark.guarantee("checks", "Noise that pixels share raises no more alarms than other noise.")
@pytest.mark.parametrize("kind", ["independent", "a tile", "columns", "a blur"])
def test_noise_that_pixels_share_is_no_drift(kind):
    """At a significance of 1 %, four alarms of 60 come once in 500 suites."""
    alarms = 0
    for run in range(60):
        rng = np.random.default_rng(run)
        counts = [(4, 4), (8, 8), (2, 4), (4, 2)][run % 4]
        sides = [
            Repeats.of(0.4 + 0.05 * correlated(kind, rng) for _ in range(count)) for count in counts
        ]
        alarms += bool(check_pictures(*sides, 0.01).moved)
    assert alarms < 4


# --- A tolerance ---------------------------------------------------------------------------------


def of_gpu(path, share=0.0, error=0.0, seed=0):
    """Write a picture without noise, as another GPU makes it: rounded otherwise, partly wrong."""
    rng = np.random.default_rng(seed)
    codes = np.linspace(90, 200, 64 * 48 * 3).reshape(48, 64, 3) + rng.integers(0, 2, (48, 64, 3))
    wrong = np.arange(48 * 64).reshape(48, 64) < share * 48 * 64
    Image.fromarray((codes + error * wrong[..., None]).astype(np.uint8)).save(path)


@pytest.mark.guarantee(
    "checks", "A tolerance lets another GPU's rounding pass, and fails at what is visible."
)
def test_a_tolerance_judges_what_is_visible_in_place_of_drift(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    of_gpu("hall0.png")
    of_gpu("hall1.png")
    assert run("check", "b", "--update", "--picture", "hall=hall?.png")[0] == 0
    tolerant = ("--within", "2", "--max-visible", "5%")
    for share, error, code in (
        (0.0, 0, 0),
        (0.04, 40, 0),
        (0.06, 40, 1),
        (1.0, 2, 0),
        (1.0, 40, 1),
    ):
        of_gpu("new.png", share, error, seed=1)
        words = ("check", "b", "--picture", "hall=new.png")
        assert run(*words)[0] == 1  # any change is a drift
        ended, printed, _ = run(*words, *tolerant)
        assert ended == code, printed
        assert ("0 of 1 passed" in printed or "1 of 1 passed" in printed) is (code == 0)
        result, said, _ = run(*words, "--max-visible", "5", "--json")
        (made,) = json.loads(said)["checks"]
        assert (result, made["gate"]["state"]) == (code, "fail" if code else "pass")
        if error != 2:
            assert made["gate"]["visible"]["value"] == pytest.approx(share, abs=0.002)
            assert made["gate"]["visible"]["low"] == made["gate"]["visible"]["high"]
    assert "of the pixels differ by more than ΔE2000 2, at most 5.00% may: it fails." in printed
    page = Path("out/check/index.html").read_text()
    assert "ΔE2000 between them" in page
    assert "it fails" in page


def test_many_repeats_decide_though_their_noise_is_visible():
    rng = np.random.default_rng(4)
    grey = np.full((48, 64, 3), 0.2)

    def repeats(level):
        return Repeats.of(level * grey + 0.005 * rng.normal(size=grey.shape) for _ in range(64))

    for level, state in ((1.0, "pass"), (1.5, "fail")):
        found = picture_gate(repeats(1.0), repeats(level), 2.0, 0.05)
        assert found.state == state
        assert found.visible.low <= found.visible.value <= found.visible.high


@pytest.mark.guarantee(
    "checks", "A tolerance fails no unchanged picture, and passes none of which a tenth differs."
)
@pytest.mark.parametrize("noise", gates.NOISES)
def test_a_tolerance_is_not_fooled_by_noise(noise):
    """A tenth of the pixels is made a third brighter, which is ΔE2000 7 in the median."""
    draw = gates.drawn(noise)
    rng = np.random.default_rng(2)
    wrong = np.ones((48, 64, 1, 1))
    wrong[:, :7] = 1.35

    def single(repeats, place):
        shown = (getattr(repeats, name)[..., place] for name in ("mean", "variance", "correlation"))
        return Repeats(repeats.count, *shown)

    for count, new in ((2, 1), (2, 2), (4, 4), (8, 1)):
        repeats = draw(rng, count + new)
        before = Repeats.of(repeats[:count])
        after = Repeats.of(repeats[count:])
        changed = replace(after, mean=after.mean * wrong)
        for place in range(0, gates.BATCH, 5):
            same = picture_gate(single(before, place), single(after, place), 2.0, 0.05)
            assert same.state != "fail", (count, new, same)
            other = picture_gate(single(before, place), single(changed, place), 2.0, 0.05)
            assert other.state != "pass", (count, new, other)


def test_a_tolerance_that_judges_nothing_is_refused(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    of_gpu("hall0.png")
    of_gpu("hall1.png")
    picture = ("--picture", "hall=hall?.png")
    assert run("check", "b", "--update", *picture)[0] == 0
    for words, expected in (
        (("--within", "2"), "Give --picture"),
        (("--max-visible", "5", "--update", *picture), "without --update"),
        (("--within", "2.1", *picture), "2.1 is not a threshold"),
        (("--max-visible", "five", *picture), "'five' is not a percentage"),
        (("--max-visible", "101", *picture), "'101' is not a percentage"),
    ):
        code, printed, messages = run("check", "b", *words)
        assert (code, expected in printed + messages) == (2, True), messages


def test_an_update_writes_only_pictures_that_moved_and_says_what_did(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(0)
    light = rng.uniform(0.2, 0.8, (32, 32, 3))
    for name, factor in (("old", 1.0), ("new", 1.0), ("bright", 1.1)):
        for number in range(4):
            noisy = factor * light * rng.normal(1, 0.01, light.shape)
            write(Path(f"{name}{number}.exr"), noisy.astype(np.float32))
    picture = "check", "b", "--update", "--picture"
    assert run(*picture, "hall=old?.exr")[0] == 0
    kept = Path("b/hall.exr").read_bytes()
    code, said, _ = run(*picture, "hall=new?.exr")
    assert (code, Path("b/hall.exr").read_bytes()) == (0, kept)
    assert "0 of 1 baselines written" in said
    code, said, _ = run(*picture, "hall=bright?.exr")
    assert "1 of 1 baselines written" in said
    assert "what moved" in said
    assert Path("b/hall.exr").read_bytes() != kept
