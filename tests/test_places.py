"""Where results go: one folder is of one command and one scene, and the same one each time."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from random import Random

import pytest

from reports.commands import __path__ as commands
from reports.files import listing, ownership
from reports.run import output, places
from tests.programs import ROOT
from tests.small_scene import PLAIN

SMALL = ("--spp", 2, "--resolution", "12x12")

STUDY = """
[[part]]
scene = "lobe"
[part.parameters]
alpha = [0.2]
"""


def files(folder):
    """Return the contents of all files below a folder, except what every command writes again."""
    passing = {"run.json", "index.html", ".fotismos-lock", ".fotismos"}
    return {p: p.read_bytes() for p in folder.rglob("*") if p.is_file() and p.name not in passing}


def scenes(folder, *names):
    """Make scenes of these names."""
    made = [folder / name for name in names]
    for path in made:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(PLAIN, encoding="utf-8")
    return made


def assigned(folder, *wanted):
    """Return the folders for some scenes, each of which then has its result."""
    with output.held(folder, "test"):
        found = places.places(folder, list(map(str, wanted)))
        for place in found:
            with ownership.replacing_folder(folder / place) as new:
                (new / "result").write_text(found[place], encoding="utf-8")
    return list(found)


@pytest.mark.guarantee(
    "runs",
    "Commands on different scenes of the same name never replace each other's results.",
)
def test_commands_on_one_name_replace_nothing_of_each_other(run, tmp_path):
    """`study kitchen.toml`, `compare kitchen.xml`, and scenes called as a command or a file is."""
    out = tmp_path / "out"
    names = ("kitchen", "fit", "study", "tables", "run.json", "Fit")
    made = scenes(tmp_path, *(f"{name}.xml" for name in names))
    (tmp_path / "kitchen.toml").write_text(STUDY, encoding="utf-8")
    small = ("-q", "--resolution", "12x12")
    before = {}
    for words in (
        ("study", tmp_path / "kitchen.toml", "-q"),
        ("fit", made[0], made[1], "--form", "phong", "--spp", 4, *small),
        ("cost", made[0], "--rounds", 2, "--spp", 4, *small),
        ("compare", *made, "--spp", 2, *small),
        ("compare", made[0], "--spp", 2, "--seed", 0, *small),
    ):
        code, _, messages = run(*words, "-o", out)
        assert (code, messages) == (0, ""), words
        now = files(out)
        changed = {path for path, content in before.items() if now.get(path) != content}
        assert {path.parent.name for path in changed} <= {"tables"}, words
        before = now
    found = {str(path.parent.relative_to(out)) for path in out.rglob("*.json")}
    assert {"kitchen", "cost/kitchen", "fit/kitchen", "fit/fit-2"} <= found
    assert (out / "study/kitchen/kitchen.parquet").is_file()
    compared = {path.parent.name for path in out.glob("*/comparison.json")}
    assert compared == {"kitchen", "fit-2", "study-2", "tables-2", "run.json-2", "Fit-3"}


def test_scenes_of_one_name_have_a_folder_each_in_whatever_command(run, tmp_path):
    one, two = scenes(tmp_path, "a/x.xml", "b/x.xml")
    out = tmp_path / "out"
    for scene in (one, two):
        assert run("compare", scene, "-o", out, *SMALL)[0] == 0
    before = files(out)
    text = {name: (out / name / "comparison.json").read_text("utf-8") for name in ("x", "x-2")}
    assert str(one) in json.loads(text["x"])["command"]
    assert str(two) in json.loads(text["x-2"])["command"]
    for words in ((two, one), (one, two), (two,)):
        assert run("compare", *words, "-o", out, *SMALL)[0] == 0
        now = files(out).items()
        assert {each for each in now if each[0].parent.name != "tables"} <= before.items()


def test_no_command_name_is_a_scene_folder():
    for module in Path(next(iter(commands))).glob("*.py"):
        name = module.stem
        assert places.folder_name(name.upper()) != name.upper() or name.startswith("__")


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("tables", "tables-2"),
        ("FIGURES", "FIGURES-2"),
        ("index.html", "index.html-2"),
        (".fotismos", "fotismos"),
        ("..", "scene"),
        (".", "scene"),
        ("", "scene"),
        ("a/../b", "a-..-b"),
        ("a\nb", "a-b"),
        ("caf\udce9", "caf-"),
        ("-o", "-o"),
        ("x" * 300, "x" * 100),
        ("ä" * 300, "ä" * 50),
        ("x" * 99 + "ä", "x" * 99),
        ("..." + "." * 300, "scene"),
    ],
)
def test_a_name_is_plain_and_short(name, expected, tmp_path):
    assert places.folder_name(name) == expected
    with ownership.replacing_folder(tmp_path / expected) as new:
        (new / f"{expected}-histogram-dE2000.svg").touch()


def test_names_that_differ_in_case_or_composition_are_one(tmp_path):
    names = ("x.xml", "X.xml", "\u00e4.xml", "a\u0308.xml", "\u00c4.xml", "x.py", "X-2.xml")
    found = assigned(tmp_path / "out", *scenes(tmp_path, *names))
    assert found == ["x", "X-2", "ä", "ä-2", "Ä-3", "x-3", "X-2-2"]


def test_a_moved_project_finds_its_results_again(tmp_path):
    (scene,) = scenes(tmp_path / "project", "x.xml")
    assert assigned(tmp_path / "project/out", scene) == ["x"]
    shutil.move(tmp_path / "project", tmp_path / "moved")
    assert assigned(tmp_path / "moved/out", tmp_path / "moved/x.xml") == ["x"]
    assert assigned(tmp_path / "moved/out", *scenes(tmp_path, "x.xml")) == ["x-2"]


def test_a_link_and_a_way_round_are_the_same_scene(tmp_path, monkeypatch):
    (scene,) = scenes(tmp_path, "a/x.xml")
    (tmp_path / "b").mkdir()
    (tmp_path / "b/x.xml").symlink_to(scene)
    monkeypatch.chdir(tmp_path / "b")
    for word in (scene, "../a/x.xml", "x.xml", "./x.xml"):
        assert assigned(tmp_path / "out", word) == ["x"]


def test_a_scene_whose_folder_was_deleted_leaves_its_name(tmp_path):
    one, two = scenes(tmp_path, "a/x.xml", "b/x.xml")
    out = tmp_path / "out"
    assert assigned(out, one, two) == ["x", "x-2"]
    shutil.rmtree(out / "x")
    assert assigned(out, *scenes(tmp_path, "c/x.xml")) == ["x"]
    assert assigned(out, two, one) == ["x-2", "x-3"]


def test_a_result_of_an_earlier_version_is_its_scene_s(tmp_path):
    """Of such a folder nobody knows what it is of: the first that has its name takes it."""
    one, two = scenes(tmp_path, "a/x.xml", "b/x.xml")
    out = tmp_path / "out"
    out.mkdir()
    ownership.folder(out / "x")
    ownership.write(out / "x/comparison.json", "{}")
    (out / listing.MARK).write_text("x\n", encoding="utf-8")
    assert assigned(out, one) == ["x"]
    assert assigned(out, two) == ["x-2"]


@pytest.mark.parametrize("seed", range(20))
def test_whatever_the_order_a_folder_stays_its_scene_s(tmp_path, seed):
    """Random commands on scenes whose names collide, some of which end before they write."""
    random, out, owner = Random(seed), tmp_path / "out", {}
    stems = ("x", "X", "x-2", "fit", "fit-2", "x" * 120, "x" * 130)
    pool = scenes(tmp_path, *(f"{folder}/{stem}.xml" for folder in "abc" for stem in stems))
    for _ in range(25):
        chosen = [str(path) for path in random.sample(pool, random.randint(1, 5))]
        chosen += chosen[: random.random() < 0.2]
        with output.held(out, "test"):
            found = places.places(out, chosen)
            folded = {place.casefold() for place in found}
            assert len(found) == len(folded) == len(chosen)
            assert not folded & places.RESERVED
            for place, scene in found.items():
                known = owner.get(place.casefold())
                assert known in (None, scene)
                if random.random() < 0.8:
                    owner[place.casefold()] = scene
                    with ownership.replacing_folder(out / place) as new:
                        (new / "result").write_text(scene, encoding="utf-8")
        for place in out.glob("*/result"):
            assert owner[place.parent.name.casefold()] == place.read_text(encoding="utf-8")
        assert len({place.casefold() for place in os.listdir(out)}) == len(os.listdir(out))


ODD = ("a\nb", '{"gone": "x"}', "-o", "...", "\u2028", "x" * 250, "'\"$()")


def test_scenes_and_folders_of_odd_names_work(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    made = scenes(tmp_path, *(f"{name}.xml" for name in ODD))
    words = ("compare", *(f"./{path.name}" for path in made), "-o", "./\n{", *SMALL)
    assert run(*words)[0] == 0
    before = files(tmp_path / "\n{")
    assert len([path for path in before if path.name == "comparison.json"]) == len(ODD)
    assert run(*words)[0] == 0
    assert files(tmp_path / "\n{") == before


def test_a_folder_whose_name_is_not_in_utf8_is_written_to(scene_file):
    """Its name is printed as it is, also where the terminal is strict about UTF-8."""
    out = b"caf\xe9"
    done = subprocess.run(
        [
            sys.executable,
            "-P",
            "-m",
            "reports",
            "compare",
            scene_file,
            "-q",
            "-o",
            out,
            "--no-why",
            *map(str, SMALL),
        ],
        cwd=scene_file.parent,
        env=os.environ | {"PYTHONPATH": str(ROOT), "PYTHONIOENCODING": "utf-8:strict"},
        capture_output=True,
        check=False,
        timeout=120,
    )
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout == out + b"/index.html\n"
    record = scene_file.parent / os.fsdecode(out) / "run.json"
    assert r"caf\udce9" in record.read_text(encoding="utf-8")
    assert json.loads(record.read_bytes())["command"].endswith("12x12")


def test_a_scene_whose_name_is_not_in_utf8_is_one_message(run, tmp_path):
    (scene,) = scenes(tmp_path, "caf\udce9.xml")
    for command in ("compare", "cost", "fit"):
        code, printed, messages = run(command, scene, "-o", tmp_path / "out")
        assert (code, printed) == (2, "")
        assert r"caf\udce9.xml': Mitsuba cannot open this name, which is not in UTF-8" in messages
        assert messages.count("\n") == 1
