"""Batches: scenes apart from each other, finished scenes, folders, and what is no scene."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from reports import cli
from tests.test_cli import SCENE

ROOT = Path(__file__).parents[1]

ABORTS = """
import os, signal

def scene():
    os.kill(os.getpid(), signal.SIGABRT)
"""

GOOD = """
import mitsuba as mi

def scene():
    return mi.cornell_box()
"""


@pytest.fixture
def run(monkeypatch, capsys):
    """Run the command line in this process; returns exit code, output and messages."""

    def command(*words):
        monkeypatch.setattr(sys, "argv", ["fotismos", *map(str, words)])
        code = 0
        try:
            cli.main()
        except SystemExit as leaving:
            code = leaving.code
        return code, *capsys.readouterr()

    return command


@pytest.fixture
def folder(tmp_path):
    """A folder with two scenes."""
    place = tmp_path / "scenes"
    place.mkdir()
    for name in ("a", "b"):
        (place / f"{name}.xml").write_text(SCENE, encoding="utf-8")
    return place


def test_a_finished_scene_is_not_rendered_again(run, folder, tmp_path, monkeypatch):
    words = ("compare", folder / "a.xml", "-o", tmp_path / "out", "--spp", 4)
    assert run(*words)[0] == 0
    page = (tmp_path / "out/index.html").read_text(encoding="utf-8")
    files = {p: p.read_bytes() for p in (tmp_path / "out/a").iterdir()}
    rendered = []

    def instead(source, *_):
        rendered.append(source.name)
        raise KeyboardInterrupt

    monkeypatch.setattr("comparisons.compare.compare", instead)
    assert run(*words)[0] == 0
    assert not rendered
    assert {p: p.read_bytes() for p in (tmp_path / "out/a").iterdir()} == files
    again = (tmp_path / "out/index.html").read_text(encoding="utf-8")
    assert page.count("data:image/png") == again.count("data:image/png") > 4
    for other in (("--fresh",), ("--seed", 1), ("--noise", 9), ("--figures",)):
        assert run(*words, *other)[0] == 130
    (folder / "a.xml").write_text(SCENE.replace("0.2, 0.3, 0.5", "0.2, 0.3, 0.6"))
    assert run(*words)[0] == 130
    assert rendered == ["a"] * 5


def test_a_view_is_found_again_as_it_was_written(run, folder, tmp_path, monkeypatch):
    from reports import finished, output

    written = []
    keep = output.write_scene

    def spy(*words):
        written.append((words[-1], keep(*words)))
        return written[-1][1]

    monkeypatch.setattr(output, "write_scene", spy)
    run("compare", folder / "a.xml", "-o", tmp_path / "out", "--spp", 4)
    (key, view), place = written[0], tmp_path / "out/a"
    found = finished.load(place, key)
    assert found == view | {"charts": [], "record": json.loads(json.dumps(view["record"]))}
    assert finished.load(place, key + "x") is None
    text = (place / "view.json").read_text(encoding="utf-8")
    for broken in ("", "[]", "{}", text[:-20], text.replace('"planes"', '"plains"')):
        (place / "view.json").write_text(broken, encoding="utf-8")
        assert finished.load(place, key) is None


def test_what_a_killed_run_left_is_cleared_away_and_restored(tmp_path):
    from reports import output

    (tmp_path / ".a.12.partial").mkdir()
    (tmp_path / ".index.html.12.partial").touch()
    for name in (".a.old", "b", ".b.old"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "comparison.json").write_text(name)
    output.recover(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "b"]
    assert (tmp_path / "a/comparison.json").read_text() == ".a.old"
    assert (tmp_path / "b/comparison.json").read_text() == "b"
