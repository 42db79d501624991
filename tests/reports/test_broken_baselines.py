"""Baselines that somebody damaged: each is an error of its own, and never a pass."""

import json
import os
from pathlib import Path

import pytest

from fotismos.heuristic.errors import InputError
from fotismos.reports.ci import baselines
from tests.shared.small_baselines import FAST, change


@pytest.fixture
def folder(baselines_folder):
    """The two small baselines, one of which seems to have moved."""
    change(baselines_folder / "fig-8-6b.json")
    return baselines_folder


def other(folder, name, **changes):
    """Write one more baseline, with changes to the one that is whole."""
    data = json.loads((folder / "fig-8-6a.json").read_text()) | changes
    (folder / f"{name}.json").write_text(json.dumps(data))


def break_all(folder):
    """Put baselines that are broken in many ways into a folder, and return their names."""
    before = set(folder.glob("*.json"))
    whole = (folder / "fig-8-6a.json").read_text()
    for name, text in {
        "nul": whole.replace("fig-8-6a", "a\\u0000b"),
        "deep": "[" * 200_000 + "]" * 200_000,
        "digits": whole.replace('"passes": 16', f'"passes": {"9" * 10_000}'),
        "large": " " * 100_000_000,
    }.items():
        (folder / f"{name}.json").write_text(text)
    (folder / "bytes.json").write_bytes(whole.encode("utf-16"))
    (folder / "folder.json").mkdir()
    (folder / "loop.json").symlink_to("loop.json")
    (folder / "gone.json").symlink_to("nowhere.json")
    (folder / "raises.py").write_text("raise SystemExit(0)")
    (folder / "garbage.exr").write_bytes(b"garbage" * 100)
    (folder / "cut.exr").write_bytes((folder / "fig-8-6a.exr").read_bytes()[:300])
    for name in ("fifo.json", "fifo.exr"):
        os.mkfifo(folder / name)
    for scene in ("fig-0", "../nowhere.xml", "raises.py"):
        other(folder, f"scene-{Path(scene).stem}", scene=scene)
    for name in ("garbage", "cut", "fifo", "missing"):
        other(folder, f"exr-{name}", images=f"{name}.exr")
    other(folder, "version", record_version=9)
    other(folder, "options", options={"spp": "many"})
    return {path.stem for path in {*folder.glob("*.json")} - before}


@pytest.mark.guarantee(
    "checks", "A baseline that cannot be judged is exit code 2; the others are judged."
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
