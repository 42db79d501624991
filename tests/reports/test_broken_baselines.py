"""Baselines that somebody damaged: each is an error of its own, and never a pass."""

import json
import os
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from fotismos.heuristic.errors import InputError
from fotismos.reports.ci import baselines
from fotismos.reports.files import images
from tests.shared.small_baselines import FAST, change, changed_header


@pytest.fixture
def folder(baselines_folder):
    """The two small baselines, one of which seems to have moved."""
    change(baselines_folder / "fig-8-6b.exr")
    return baselines_folder


def rewritten(path, new, change):
    """Write an EXR with another text in its header, and its layers changed, to another file."""
    with OpenEXR.File(str(path), separate_channels=True) as file:
        text = file.header()["fotismos"]
        layers = {name: np.array(channel.pixels) for name, channel in file.channels().items()}
    text, layers = change(text, layers)
    OpenEXR.File({"type": OpenEXR.scanlineimage, "fotismos": text}, layers).write(str(new))


HEADERS = {
    "nul": lambda text: text.replace("fig-8-6a", "a\\u0000b"),
    "deep": lambda text: "[" * 200_000 + "]" * 200_000,
    "digits": lambda text: text.replace('"passes": 8', f'"passes": {"9" * 10_000}'),
    "json": lambda text: "{",
    "version": lambda text: text.replace('"record_version": 4', '"record_version": 9'),
    "passes": lambda text: text.replace('"passes": 8', '"passes": 1'),
    "more": lambda text: text.replace('"passes": 8', '"passes": 9'),
    "field": lambda text: text.replace('"passes"', '"x": 1, "passes"'),
    "pictures": lambda text: text.replace('"fig-8-6a"', "null"),
}


def with_value(value):
    def change(text, layers):
        layers["pass.reference.3.G"][2, 2] = value
        return text, layers

    return change


def break_all(folder):
    """Put baselines that are broken in many ways into a folder, and return their names."""
    before = set(folder.glob("*.exr"))
    whole = folder / "fig-8-6a.exr"
    for name, header in HEADERS.items():
        rewritten(whole, folder / f"{name}.exr", lambda text, layers, to=header: (to(text), layers))
    for name, value in (("nan", np.nan), ("infinite", np.inf), ("large", 1e35)):
        rewritten(whole, folder / f"{name}.exr", with_value(value))
    (folder / "text.exr").write_text("[]")
    (folder / "folder.exr").mkdir()
    (folder / "loop.exr").symlink_to("loop.exr")
    (folder / "gone.exr").symlink_to("nowhere.exr")
    (folder / "raises.py").write_text("raise SystemExit(0)")
    (folder / "garbage.exr").write_bytes(b"garbage" * 100)
    content = whole.read_bytes()
    for share in (10, 50, 90):
        (folder / f"cut{share}.exr").write_bytes(content[: share * len(content) // 100])
    os.mkfifo(folder / "fifo.exr")
    images.write_exr(folder / "saved.exr", {"pass.reference.0": np.ones((4, 4, 3))}, {})
    for scene in ("fig-0", "../nowhere.xml", "raises.py"):
        changed_header(whole, folder / f"scene-{Path(scene).stem}.exr", scene=scene)
    changed_header(whole, folder / "options.exr", options={"spp": "many"})
    (folder / "old.json").write_text("{")
    return {path.stem for path in {*folder.glob("*.exr"), *folder.glob("*.json")} - before}


@pytest.mark.guarantee(
    "checks", "A baseline that cannot be judged is exit code 2; the others are judged."
)
def test_each_baseline_is_judged_alone(run, folder, tmp_path):
    broken = break_all(folder)
    layers = dict.fromkeys(("", "beauty_pass"), np.ones((4, 4, 3)))
    images.write_exr(folder / "picture.exr", layers, {})  # is none
    parts = [OpenEXR.Part({}, {"RGB": np.ones((4, 4, 3), "f")}, name) for name in ("a", "b")]
    OpenEXR.File(parts).write(str(folder / "parts.exr"))  # nor is this
    code, printed, messages = run("check", folder, "-o", tmp_path / "out", "--json")
    assert code == 2
    statuses = {
        Path(check["baseline"]).stem: check["status"] for check in json.loads(printed)["checks"]
    }
    assert statuses == dict.fromkeys(broken, "error") | {
        "fig-8-6a": "passed", "fig-8-6b": "failed",
    }  # fmt: skip
    assert len(broken) > 25
    assert "Traceback" not in messages
    for name in ("options", "version", "nul", "deep", "digits", "nan", "garbage", "cut50"):
        assert f"{folder / name}.exr: " in messages
        with pytest.raises(InputError, match="--update --scene"):
            baselines.read(folder / f"{name}.exr")
    for name in ("fifo", "folder"):
        words = ("check", folder / f"{name}.exr", "--update", "--scene", "fig-8-6a", *FAST)
        code, _, messages = run(*words)
        assert (code, "not a regular file" in messages) == (2, True)
    assert (folder / "fifo.exr").is_fifo()
