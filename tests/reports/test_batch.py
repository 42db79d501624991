"""Batches: scenes apart from each other, finished scenes, folders, and other files."""

import json
import os
import re
import subprocess
import sys
import time
from concurrent.futures import Future
from random import Random
from types import SimpleNamespace

import jsonschema
import pytest

from fotismos.comparisons.names import file_of
from fotismos.comparisons.options import Options
from fotismos.comparisons.processes.pool import Pool, Task
from fotismos.heuristic.errors import InputError
from fotismos.reports.files import results as result_files
from fotismos.reports.jobs import Job, Terminal
from fotismos.reports.page import page
from fotismos.reports.run import batch, scene
from tests.shared import records
from tests.shared.outputs import results
from tests.shared.programs import ROOT
from tests.shared.schemas import schema
from tests.shared.small_scene import IN_PYTHON, SCENE

ABORTS = """
import os, signal

def scene():
    os.kill(os.getpid(), signal.SIGABRT)
"""


@pytest.fixture
def folder(tmp_path):
    """A folder with two scenes."""
    place = tmp_path / "scenes"
    place.mkdir()
    for name in ("a", "b"):
        (place / f"{name}.xml").write_text(SCENE, encoding="utf-8")
    return place


def scenes_in(folder):
    return sorted(folder.iterdir())


@pytest.mark.guarantee("runs", "A scene that kills its process does not affect the others.")
@pytest.mark.thorough
def test_a_scene_that_kills_its_process_takes_no_other_along(run, apart, folder, tmp_path):
    (folder / "aa.py").write_text(ABORTS)
    (folder / "c.py").write_text(IN_PYTHON)
    out = tmp_path / "out"
    words = ("compare", *scenes_in(folder), "-o", out, "--spp", 2, "--resolution", "16x16")
    code, _, messages = run(*words)
    assert code == 1
    assert "1 of 4 scenes failed" in messages
    assert "SIGABRT" in messages
    assert all((out / name / "comparison.json").is_file() for name in "abc")
    assert not (out / "aa").exists()
    record = json.loads((out / "run.json").read_text(encoding="utf-8"))
    jsonschema.validate(record, schema("run"))
    failures = record["failures"]
    assert [failure["scene"] for failure in failures] == ["aa"]
    assert "SIGABRT" in (out / "index.html").read_text(encoding="utf-8")
    record = json.loads((out / "c/comparison.json").read_text(encoding="utf-8"))
    assert str(folder / "c.py") in record["command"]
    before = {path: path.stat().st_mtime_ns for path in out.glob("[ab]/*")}
    (folder / "aa.py").write_text(IN_PYTHON)
    assert run(*words)[0] == 0
    assert {path: path.stat().st_mtime_ns for path in out.glob("[ab]/*")} == before
    assert (out / "aa/comparison.json").is_file()


def _nested(depth):
    return SCENE.replace("</scene>", "<shape type='sphere'>" * depth + "</scene>")


ENTITIES = (
    f'<!ENTITY {b} "{f"&{a};" * 10}">' for a, b in zip("abcdefghi", "bcdefghij", strict=True)
)
BOMB = f'<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa">{"".join(ENTITIES)}]>'

HOSTILE = {
    "entities": (BOMB + SCENE.replace('value="0.2"/>', 'value="&j;"/>'), "could not parse"),
    "nesting": (_nested(100_000), "tags mismatch"),
    "itself": (
        SCENE.replace("</scene>", '<include filename="x.xml"/></scene>'),
        "maximum include recursion",
    ),
    "malformed": (SCENE[:300], "x.xml ends before its last element is closed"),
    "NaN": (SCENE.replace('"alpha" value="0.2"', '"alpha" value="nan"'), "alpha = nan"),
    "broken reference": (SCENE.replace('<bsdf type="diffuse"/>', '<ref id="nix"/>'), "nix"),
    "unclosed comments": ("<!--" * 300_000, "x.xml"),  # these two take hours if read badly
    "unclosed elements": ("<a" * 300_000, "x.xml"),
    "film": (
        SCENE.replace('value="24"', 'value="1000000"').replace('value="16"', 'value="1000000"'),
        "1000000x1000000 pixels is too large",
    ),
    "texture": (
        SCENE.replace(
            '<rgb name="diffuse_reflectance" value="0.2, 0.3, 0.5"/>',
            '<texture type="bitmap" name="diffuse_reflectance">'
            '<string name="filename" value="x.xml"/></texture>',
        ),
        "x.xml|[Bb]itmap|format",
    ),
}


def test_a_hostile_scene_is_refused_in_one_message(run, tmp_path):
    path = tmp_path / "x.xml"
    for content, expected in HOSTILE.values():
        path.write_text(content, encoding="utf-8")
        code, printed, messages = run("compare", path, "-o", tmp_path / "out", "--spp", 2)
        assert (code, printed) == (2, "")
        assert messages.startswith("fotismos: error: ")
        assert re.search(expected, messages)
        assert "Traceback" not in messages
        assert [place.name for place in tmp_path.iterdir()] == ["x.xml"]


@pytest.mark.thorough
def test_a_script_that_ends_its_process_is_the_users_mistake(run, apart, tmp_path):
    out = ("-o", tmp_path / "out", "--spp", 2, "--resolution", "16x16")
    (tmp_path / "leaving.py").write_text("import os\nos._exit(0)\n")
    code, _, messages = run("compare", tmp_path / "leaving.py", *out)
    assert (code, "Remove os._exit from it" in messages) == (2, True)


def test_a_pipe_and_a_folder_are_no_scenes(run, tmp_path, monkeypatch):
    """A folder of results named as a built-in scene does not hide it."""
    os.mkfifo(tmp_path / "pipe.xml")
    for path, reason in ((tmp_path / "pipe.xml", "no such file"), (tmp_path, "neither a file")):
        code, _, messages = run("compare", path, "-o", tmp_path / "out")
        assert (code, reason in messages) == (2, True)
    (tmp_path / "fig-8-9").mkdir()
    monkeypatch.chdir(tmp_path)
    assert file_of("fig-8-9") is None


COUNT = re.compile(r"scenes: [12] of 2.*")
"""What a pipe gets every ten seconds."""


def _start(folder, out):
    words = [sys.executable, "-m", "fotismos.reports", "compare", *scenes_in(folder), "-o", out]
    words += ["--spp", "8", "--resolution", "16x16", "--no-why", "--workers", "1"]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    return subprocess.Popen(
        words, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


@pytest.mark.guarantee("runs", "A batch killed at any moment loses no finished scene.")
@pytest.mark.thorough
def test_a_batch_killed_at_random_moments_goes_on_to_the_results_of_a_whole_one(
    box_filtered, tmp_path
):
    random, begin = Random(50), time.perf_counter()
    whole = _start(box_filtered, tmp_path / "whole")
    assert all(map(COUNT.fullmatch, whole.communicate(timeout=300)[1].splitlines()))
    seconds, out, kept = time.perf_counter() - begin, tmp_path / "killed", {}
    for number in range(3):
        batch = _start(box_filtered, out)
        time.sleep(seconds * random.uniform(0.3, 0.9))
        batch.kill()
        batch.communicate()
        finished = {path: path.read_bytes() for path in out.glob("?/comparison.json")}
        assert kept.items() <= finished.items(), f"a result was lost by kill {number}"
        kept = finished
    last = _start(box_filtered, out)
    assert all(map(COUNT.fullmatch, last.communicate(timeout=300)[1].splitlines()))
    assert last.returncode == 0
    assert all(path.read_bytes() == content for path, content in kept.items())
    assert results(out) == results(tmp_path / "whole")


@pytest.fixture
def box_filtered(folder):
    """The folder with scenes of which every rendering is the same bit for bit."""
    for path in folder.iterdir():
        scene = SCENE.replace("</film>", '<rfilter type="box"/></film>')
        path.write_text(scene, encoding="utf-8")
    return folder


@pytest.mark.thorough
def test_values_for_placeholders_go_to_the_scenes_that_have_them(run, folder, tmp_path):
    with_one = SCENE.replace('name="alpha" value="0.2"', 'name="alpha" value="$roughness"')
    (folder / "b.xml").write_text(with_one, encoding="utf-8")
    size = ("--spp", 4, "--resolution", "8x8")
    words = ("compare", *scenes_in(folder), "-o", tmp_path / "out", *size)
    assert run(*words, "-D", "roughness=0.3")[0] == 0
    commands = {
        name: json.loads((tmp_path / f"out/{name}/comparison.json").read_text())["command"]
        for name in "ab"
    }
    assert "-D roughness=0.3" in commands["b"]
    assert "-D" not in commands["a"]
    code, _, messages = run(*words, "-D", "roughness=0.3", "-D", "rougness=0.3")
    assert code == 2
    assert "-D rougness: no scene has such a placeholder" in messages


@pytest.mark.thorough
def test_printed_commands_begin_as_the_program_was_started(run, folder, tmp_path, monkeypatch):
    monkeypatch.setenv("FOTISMOS_PROGRAM", "'./my run'")
    words = ("compare", folder / "a.xml", "-o", tmp_path / "out", "--spp", 4)
    assert run(*words)[0] == 0
    record = json.loads((tmp_path / "out/a/comparison.json").read_text(encoding="utf-8"))
    assert record["command"].startswith("'./my run' compare ")
    assert "'./my run' scenes" in run("compare", "nowhere.xml")[2]


@pytest.mark.parametrize("count", [1, 4, 40, 160])
def test_the_work_of_the_pages_of_a_run_is_linear_in_its_scenes(tmp_path, monkeypatch, count):
    """The first is there with the first picture; each scene is drawn once more when it is done."""
    drawn, shown = [], []
    draw, render = page.drawn_scene, page.render

    def drawing(view, *others):
        drawn.append(view.record.scene)
        return draw(view, *others)

    def rendering(views, **others):
        shown.append(len(views))
        return render(views, **others)

    monkeypatch.setattr(page, "drawn_scene", drawing)
    monkeypatch.setattr(page, "render", rendering)
    views = [records.view(records.data() | {"scene": f"s-{n}"}) for n in range(count)]
    with result_files.hold(tmp_path, "test") as folder:
        names = [view.record.scene for view in views]
        run = batch.Batch(folder, names, None, command="", within=2.0)
        for view in views:
            name = view.record.scene
            run.show(Task(name, print, ()), view)
            assert (folder / "index.html").exists()
            outcome = Future()
            outcome.set_result((view, {}))
            run.take(name, outcome)
        assert "the page reloads by itself" in (folder / "index.html").read_text() or count == 1
        run.write_page()
        assert "In progress" not in (folder / "index.html").read_text()
    assert len(drawn) == 2 * count
    assert sum(shown) <= 8 * count


def test_what_is_done_is_kept_if_the_hard_cases_fail(tmp_path):
    def compared(word, *_):
        return records.view(records.data() | {"scene": word}), {}

    def failing():
        raise InputError("no cases")

    subjects = batch.Subjects(("a", "b"), files=(("a", None), ("b", None)), compare=compared)
    cases = Task("hard cases", failing, (), is_counted=False)
    with Pool(0) as pool, pytest.raises(InputError, match="no cases"):
        batch.compare_all(pool, subjects, Job(Options()), Terminal(output=tmp_path), cases)
    page_of_all = (tmp_path / "index.html").read_text()
    assert "Interrupted: 2 of 2 scenes are done" in page_of_all
    assert "In progress" not in page_of_all
    assert (tmp_path / "tables/metrics.csv").is_file()


@pytest.mark.parametrize(
    ("decision", "patience", "samples"),
    [("undecided", 4, [16, 64]), ("undecided", 1, [16]), ("fail", 4, [16])],
)
def test_what_is_undecided_takes_more_samples_once(
    monkeypatch, tmp_path, decision, patience, samples
):
    taken = []

    def compare(source, options, *_, shown, **__):
        taken.append(options.spp)
        shown(None)
        return SimpleNamespace(record=records.view(records.data()).record, causes=None)

    monkeypatch.setattr(scene, "compare", compare)
    monkeypatch.setattr(scene, "_stages", lambda *_: {"metrics": 1.0})
    monkeypatch.setattr(scene.verdict, "decision", lambda *_: decision)
    for name in ("view_of", "write"):
        monkeypatch.setattr(scene.scene_files, name, lambda *_, **__: None)
    job = Job(Options(spp=16), patience=patience)
    _, spent = scene.compared("fig-8-9", tmp_path, "fig-8-9", job, print)
    assert (taken, spent["metrics"]) == (samples, len(samples))
