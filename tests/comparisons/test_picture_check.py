"""Checks of pictures from any renderer tell noise from drift, by command and over many runs."""

import hashlib
import json
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from PIL import Image
from scipy import ndimage, stats

from fotismos.comparisons.check.measured import Measured
from fotismos.comparisons.check.moved import check as checked_with
from fotismos.comparisons.departure.drift import Run
from fotismos.comparisons.pictures import Pictures
from fotismos.comparisons.records.check import PICTURE
from fotismos.reference import records
from fotismos.reports.ci import baselines, summary
from tests.benchmarks import gates
from tests.shared.outputs import write
from tests.shared.schemas import schema

TRUTH = gates.TRUTH[..., 0]


def header(path):
    """Return the record in a baseline's header."""
    return records.plain(baselines.read(Path(path)).baseline)


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
    jsonschema.validate(header("b/hall.exr"), schema("baseline"))
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
    printed = check(3, local)[1]
    assert "hall: failed. row 2, column 3: light +10 %" in printed
    assert "in 1 of 12 blocks, most in row 2, column 3" in printed


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
        "--picture hall=?.exr --picture roof=?.exr": "roof.exr: this is no baseline: No such file",
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
    for name in ("mine.json", "0.exr"):
        Path("b/mine.json").write_text("{}")
        mine = (tmp_path / name).read_bytes() if (tmp_path / name).exists() else b"{}"
        place = Path("b") / name
        place.write_bytes(mine)
        code, printed, _ = run("check", place, "--update", "--picture", "mine=?.exr")
        assert (code, "this is no baseline" in printed) == (2, False)
        assert place.read_bytes() == mine


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
        assert header("b/wall.exr")["options"] == {"over": "white", "transfer": "srgb"}
        (half,) = baselines.read(Path("b/wall.exr")).halves.values()
        assert half.mean.min() > 0.5  # of white, since the front is transparent and dark
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
            Run.of(0.4 + 0.05 * correlated(kind, rng) for _ in range(count)) for count in counts
        ]
        alarms += gates.ours(*sides)
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
            assert made["gate"]["visible"]["high"] == pytest.approx(share, abs=0.002)
    assert "of the pixels differ by more than ΔE2000 2, at most 5.00 % may: it fails." in printed
    page = Path("out/check/index.html").read_text()
    assert "picture, what moved: ΔE2000" in page
    assert "it fails" in page


def gate(before, after):
    """Return whether at most 5 % of the pixels of repeats differ by more than ΔE2000 2."""
    old, new = ({PICTURE: Pictures.of("p", images)} for images in (before, after))
    (half,) = checked_with(old, Measured(halves=new)).halves
    (found,) = summary.gates([half.comparison.record], 0.05, 2.0)
    return found


def test_many_repeats_decide_though_their_noise_is_visible():
    rng = np.random.default_rng(4)
    grey = np.full((48, 64, 3), 0.2)

    def repeats(level):
        return [level * grey + 0.005 * rng.normal(size=grey.shape) for _ in range(64)]

    for level, state in ((1.0, "pass"), (1.5, "fail")):
        found = gate(repeats(1.0), repeats(level))
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
    wrong = np.ones((48, 64, 1))
    wrong[:, :7] = 1.35
    for count, new in ((2, 1), (2, 2), (4, 4), (8, 1)):
        repeats = [image[..., 0] for image in draw(rng, count + new)]
        for factor, excluded in ((1.0, "fail"), (wrong, "pass")):
            found = gate(repeats[:count], [factor * image for image in repeats[count:]])
            assert found.state != excluded, (count, new, found)


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


@pytest.mark.guarantee("checks", "Of the same repeats, check and compare say the same.")
def test_ten_sets_of_repeats_have_the_share_and_the_decision_of_compare(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    decided = set()
    # Of two values, repeats may be equal by chance, which a check refuses.
    noises = [name for name in gates.NOISES if "two values" not in name]
    for number, noise in enumerate([*noises, noises[0]]):
        rng = np.random.default_rng(number)
        repeats = [image[..., 0] for image in gates.drawn(noise)(rng, 8)]
        wrong = np.ones((48, 64, 1))
        wrong[: 6 * (number % 4)] = 1.35
        for count, image in enumerate(repeats):
            name = f"old{count}.exr" if count < 4 else f"new{count}.exr"
            shown = image.clip(0) * (wrong if count >= 4 else 1)
            write(Path(name), shown.astype(np.float32))
        baseline = f"{number}/hall.exr"
        assert run("check", baseline, "--update", "--picture", "hall=old?.exr")[0] == 0
        words = ("--max-visible", "5%", "--json")
        code, printed, _ = run("check", baseline, "--picture", "hall=new?.exr", *words)
        (checked,) = json.loads(printed)["checks"]
        pictures = ("--image", "new?.exr", "--reference", "old?.exr", "-o", "c")
        expected, _, _ = run("compare", *pictures, "--max-visible", "5%")
        (file,) = Path("c").glob("*/comparison.json")
        compared = json.loads(file.read_text())
        (share,) = [v for v in compared["metrics"]["dE2000"]["visible"] if v["threshold"] == 2]
        assert checked["gate"]["visible"] == share
        assert (code, checked["gate"]["state"] == "pass") == (expected, expected == 0)
        decided.add(checked["gate"]["state"])
    assert decided >= {"pass", "fail"}
