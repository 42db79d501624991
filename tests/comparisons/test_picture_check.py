"""Checks of pictures from any renderer tell noise from drift, by command and over many runs."""

import json
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from PIL import Image
from scipy import ndimage, stats

from fotismos.comparisons.check.pictures import Repeats, check_pictures
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
    cause = json.loads(printed)["checks"][0]["causes"][0]
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


def test_an_update_keeps_the_transfer_function(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for number in range(2):
        values = np.random.default_rng(number).integers(100, 120, (16, 16, 3), np.uint8)
        Image.fromarray(values).save(f"{number}.png")
    for words in (("--transfer", "srgb"), ()):
        assert run("check", "b", "--update", "--picture", "wall=?.png", *words)[0] == 0
        assert json.loads(Path("b/wall.json").read_text())["transfer"] == "srgb"


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


def test_a_change_is_still_caught_beside_noise_that_pixels_share():
    rng = np.random.default_rng(1)
    before = Repeats.of(0.4 + 0.02 * correlated("independent", rng) for _ in range(4))
    after = Repeats.of(0.404 + 0.02 * correlated("independent", rng) for _ in range(4))
    assert check_pictures(before, after, 0.01).moved
