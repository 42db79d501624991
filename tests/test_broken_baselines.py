"""Baselines that somebody damaged: each is an error of its own, and never a pass."""

import copy
import json
import os
import random
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from heuristic.errors import InputError
from reports.ci import baselines, checks
from tests.small_baselines import FAST, change

WHOLE = Path(__file__).parent / "baselines/cornell-box-llvm_ad_rgb.json"
ODD = (
    None, True, "x", "", -1, 0, 1e308, -1e308, 10**400, 10**30, float("nan"), float("inf"), [], {},
    "é\ud800", "a\0b", [[[]]], 1e-320, -0.5,
)  # fmt: skip


def places(value, path=()):
    """Yield the path of everything inside some JSON."""
    items = value.items() if isinstance(value, dict) else enumerate(value)
    for key, inner in items:
        yield (*path, key)
        if isinstance(inner, (dict, list)):
            yield from places(inner, (*path, key))


def damaged(content, rng):
    """Return a baseline's bytes with something wrong: cut, flipped, or other values in it."""
    kind = rng.randrange(5)
    if kind == 0:
        return content[: rng.randrange(len(content))]
    if kind == 1:
        flipped = bytearray(content)
        for _ in range(rng.randint(1, 5)):
            flipped[rng.randrange(len(flipped))] = rng.randrange(256)
        return bytes(flipped)
    data = json.loads(content)
    for _ in range(rng.randint(1, 2)):
        found = [path for path in places(data) if kind != 4 or len(path) <= 2]
        *outer, last = rng.choice(found)
        inner = data
        for key in outer:
            inner = inner[key]
        act = rng.randrange(3)
        if act == 0:
            del inner[last]
        elif act == 1:
            inner[last] = copy.deepcopy(rng.choice(ODD))
        elif isinstance(inner, dict):
            inner["extra"] = rng.choice(ODD)
        else:
            inner.append(copy.deepcopy(inner[last]))
    return json.dumps(data).encode("utf-8", "surrogatepass")


def test_a_damaged_baseline_is_refused_or_holds_sane_numbers(tmp_path):
    path, whole, outcomes = tmp_path / "b.json", WHOLE.read_bytes(), Counter()
    for seed in range(300):
        path.write_bytes(damaged(whole, random.Random(seed)))
        try:
            found = baselines.read(path).baseline
        except InputError as error:
            message = str(error)
        else:
            message = None
        if message is not None:
            assert str(path) in message
            assert "--update --scene" in message
            outcomes["refused"] += 1
            continue
        quantities = found.measured().quantities()
        values, errors = np.array([(value, error) for *_, value, error in quantities]).T
        assert np.isfinite(values).all()
        assert np.isfinite(errors**4).all()
        assert (errors >= 0).all()
        assert 2 <= found.passes <= 1024
        found.text()
        outcomes["legal"] += 1
    assert outcomes["refused"] > 10 * outcomes["legal"] > 0


# --- One command over all of them ------------------------------------------------------------


@pytest.fixture
def folder(baselines_folder):
    """The two small baselines, one of which seems to have moved."""
    change(baselines_folder / "fig-8-6b.json")
    return baselines_folder


def other(folder, name, **changes):
    """Write one more baseline, with changes to the one that is whole."""
    data = json.loads((folder / "fig-8-6a.json").read_text()) | changes
    (folder / f"{name}.json").write_text(json.dumps(data))


def sparse(path, size):
    with path.open("wb") as file:
        file.truncate(size)


def break_all(folder):
    """Put baselines that are broken in many ways into a folder, and return their names."""
    before = {path.name for path in folder.glob("*.json")}
    whole = (folder / "fig-8-6a.json").read_text()
    (folder / "nul.json").write_text(whole.replace("fig-8-6a", "a\\u0000b"))
    (folder / "bytes.json").write_bytes(whole.encode("utf-16"))
    (folder / "deep.json").write_text("[" * 200_000 + "]" * 200_000)
    (folder / "digits.json").write_text(whole.replace('"passes": 16', f'"passes": {"9" * 10_000}'))
    sparse(folder / "large.json", 100_000_000)
    (folder / "folder.json").mkdir()
    os.mkfifo(folder / "fifo.json")
    (folder / "loop.json").symlink_to("loop.json")
    (folder / "gone.json").symlink_to("nowhere.json")
    other(folder, "version", record_version=9)
    other(folder, "scene", scene="fig-0")
    other(folder, "file", scene="../nowhere.xml")
    other(folder, "options", options={"spp": "many"})
    other(folder, "script", scene="raises.py")
    (folder / "raises.py").write_text("raise SystemExit(0)")
    for name, content in (("garbage", b"garbage" * 100), ("cut", None), ("fifo", "fifo")):
        picture = folder / f"picture-{name}.exr"
        if content == "fifo":
            os.mkfifo(picture)
        else:
            picture.write_bytes(content or (folder / "fig-8-6a.exr").read_bytes()[:300])
        other(folder, f"exr-{name}", images=picture.name)
    other(folder, "exr-missing", images="missing.exr")
    return {path.stem for path in folder.glob("*.json") if path.name not in before}


@pytest.mark.guarantee(
    "checks",
    "A baseline that cannot be judged is an error with exit code 2; the others are judged.",
)
def test_each_baseline_is_judged_alone(run, folder, tmp_path):
    broken = break_all(folder)
    code, printed, messages = run("check", folder, "-o", tmp_path / "out", "--json")
    assert code == 2
    statuses = {
        Path(check["baseline"]).stem: check["status"] for check in json.loads(printed)["checks"]
    }
    assert statuses == dict.fromkeys(broken, "error") | {
        "fig-8-6a": "passed", "fig-8-6b": "failed",
    }  # fmt: skip
    assert len(broken) > 15
    assert "Traceback" not in messages
    for name in ("options", "version", "nul", "deep", "digits", "bytes"):
        assert f"{folder / name}.json: " in messages
        with pytest.raises(InputError, match="--update --scene"):
            baselines.read(folder / f"{name}.json")
    for name in ("fifo", "folder"):
        words = ("check", folder / f"{name}.json", "--update", "--scene", "fig-8-6a", *FAST)
        code, _, messages = run(*words)
        assert (code, "not a regular file" in messages) == (2, True)
    assert (folder / "fifo.json").is_fifo()


def test_whatever_goes_wrong_is_the_error_of_one(tmp_path):
    for raised in (MemoryError(), RecursionError("too deep"), KeyError("x"), InputError("bad")):

        def read(path, raised=raised):
            raise raised

        made, view = checks.judged(read, tmp_path / "b.json")
        assert (made.status, made.exit_code, view) == ("error", 2, None)
        assert str(raised) in made.message
    for raised in (KeyboardInterrupt, SystemExit):

        def leave(path, raised=raised):
            raise raised

        with pytest.raises(raised):
            checks.judged(leave, tmp_path / "b.json")


def test_a_number_that_is_not_one_is_never_a_pass(folder, tmp_path, monkeypatch):
    from comparisons.check import moved

    monkeypatch.setattr(moved, "sidak", lambda p, tests: np.full(len(p), np.nan))
    words = (folder / "fig-8-6a.json", 0.01, None, tmp_path / "out")
    made, _ = checks.judged(checks.examine_one, *words)
    assert made.status != "passed"


SCRIPT = """
from colours import GREY

def scene():
    return {
        "type": "scene",
        "integrator": {"type": "path"},
        "sensor": {"type": "perspective", "film": {"type": "hdrfilm", "width": 16, "height": 16}},
        "ball": {"type": "sphere", "center": [0, 0, 4],
                 "bsdf": {"type": "diffuse", "reflectance": GREY}},
        "lamp": {"type": "point", "position": [2, 2, 0], "intensity": 30.0},
    }
"""


def test_a_scene_in_python_is_checked_as_one_in_xml(run, tmp_path, monkeypatch):
    scenes = tmp_path / "scenes"
    scenes.mkdir()
    (scenes / "ball.py").write_text(SCRIPT)
    (scenes / "colours.py").write_text("GREY = 0.5\n")
    folder = tmp_path / "baselines"
    words = ("check", folder, "--update", "--scene", scenes / "ball.py", "--spp", 32)
    assert run(*words)[0] == 0
    assert json.loads((folder / "ball.json").read_text())["scene"] == "../scenes/ball.py"
    (tmp_path / "deeper/down").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "deeper/down")
    assert run("check", folder, "-o", tmp_path / "out")[0] == 0
    (scenes / "colours.py").write_text("GREY = 0.25\n# changed\n")
    assert run("check", folder, "-o", tmp_path / "out")[0] == 1
    (scenes / "colours.py").write_text("GREY = undefined\n")
    code, _, messages = run("check", folder, "-o", tmp_path / "out")
    assert (code, "NameError" in messages) == (2, True)
