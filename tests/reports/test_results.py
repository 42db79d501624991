"""What fotismos promises about the files of results: fresh, whole, and only its own replaced."""

import errno
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import fotismos.heuristic.program
from fotismos.comparisons import atomic
from fotismos.comparisons.study import running
from fotismos.heuristic.errors import InputError, OutputError
from fotismos.reports.files import results
from fotismos.reports.run import scene_files
from tests.shared import cost_records, records
from tests.shared.programs import ROOT
from tests.shared.small_scene import IN_PYTHON, SCENE

SMALL = ("--spp", 4, "--resolution", "12x8")

# --- Finished scenes -------------------------------------------------------------------------


def rendered(run, scene_file, out, *more):
    """Whether the same command renders again."""
    record = out / "my-scene/comparison.json"
    before = record.stat().st_mtime_ns if record.exists() else None
    assert run("compare", scene_file, *SMALL, "-o", out, *more)[0] == 0
    return record.stat().st_mtime_ns != before


@pytest.mark.guarantee(
    "runs", "A finished scene is rendered again once fotismos or its record changes."
)
def test_a_finished_scene_is_reused_only_while_all_is_as_it_was(
    run, scene_file, tmp_path, monkeypatch
):
    out = tmp_path / "out"
    assert [rendered(run, scene_file, out) for _ in range(2)] == [True, False]
    record = out / "my-scene/comparison.json"
    content = record.read_text()
    mean = str(json.loads(content)["metrics"]["dE2000"]["mean"])
    record.write_text(content.replace(mean, mean[::-1]))
    assert rendered(run, scene_file, out)
    assert mean[::-1] not in record.read_text()
    with monkeypatch.context() as patched:
        patched.setattr(
            fotismos.heuristic.program, "source_digest", lambda: "terms.diffuse, halved"
        )
        assert [rendered(run, scene_file, out) for _ in range(2)] == [True, False]
    for more in (("--fresh",), ("--seed", 1)):
        assert rendered(run, scene_file, out, *more)
    scene_file.write_text(SCENE.replace("0.2, 0.3, 0.5", "0.2, 0.3, 0.6"))
    assert rendered(run, scene_file, out, "--seed", 1)


def test_a_scene_in_python_is_never_reused(run, tmp_path):
    path = tmp_path / "my scene.py"
    path.write_text(IN_PYTHON)
    out = tmp_path / "out"
    assert [rendered(run, path, out) for _ in range(2)] == [True, True]


@pytest.fixture(scope="module")
def comparison():
    """A comparison that was not rendered."""
    return records.comparison()


def test_a_view_is_found_again_unless_anything_is_damaged(comparison, tmp_path):
    view = scene_files.write(results.own(tmp_path), "a", comparison, key="key")
    place, file = tmp_path / "a", tmp_path / "a/view.json"
    assert scene_files.load(place, "key") == view
    assert scene_files.load(place, "another") is scene_files.load(place, None) is None
    text = file.read_text()
    cuts = (text[:size] for size in range(0, len(text), len(text) // 20))
    for broken in ("", "[]", "{}", text.replace("thumbnails", "thumbnail"), *cuts):
        file.write_text(broken)
        assert scene_files.load(place, "key") is None
    file.write_text(text)
    (place / "comparison.exr").unlink()
    assert scene_files.load(place, "key") is None


def test_a_result_takes_the_place_of_all_of_an_earlier_one_and_of_nothing_else(
    comparison, tmp_path
):
    scene_files.write(results.own(tmp_path), "a", comparison, costs=cost_records.study("a"))
    (tmp_path / "a/mine.png").write_text("mine")
    assert (tmp_path / "a/cost.json").exists()
    view = scene_files.write(tmp_path, "a", comparison)
    assert not [*(tmp_path / "a").glob("cost*")]
    assert {*view.files} == {"comparison.json", "comparison.exr"}
    scene_files.remove(tmp_path / "a")
    assert {path.name for path in (tmp_path / "a").iterdir()} == {results.MARK, "mine.png"}


class EndedError(Exception):
    """The end of a process, at a moment."""


def test_the_record_is_removed_first_and_written_last(comparison, tmp_path, monkeypatch):
    """Whichever writing is the last one, an unfinished scene has no record."""
    folder, replace, count = results.own(tmp_path), Path.replace, 0
    scene_files.write(folder, "a", comparison)

    def stopping(path, target):
        nonlocal count
        count -= 1
        if count < 0:
            raise EndedError
        assert not (folder / "a/comparison.json").exists()
        return replace(path, target)

    for moment in range(100):
        count = moment
        with monkeypatch.context() as patched:
            patched.setattr(Path, "replace", stopping)
            try:
                scene_files.write(folder, "a", comparison, key="key")
            except EndedError:
                assert not (folder / "a/comparison.json").exists()
                assert scene_files.load(folder / "a", "key") is None
            else:
                break
    assert moment > 8
    assert scene_files.load(folder / "a", "key")


# --- Whose it is -----------------------------------------------------------------------------


@pytest.mark.guarantee("runs", "Your own files in an output folder are not overwritten or deleted.")
@pytest.mark.parametrize(
    ("name", "make"),
    [
        ("index.html", "link"), ("run.json", "pipe"), ("tables", "folder"), ("figures", "link"),
        ("my-scene", "file"), ("my-scene", "folder"), ("", "link"),
    ],
)  # fmt: skip
def test_what_others_made_is_one_message_and_stays(run, scene_file, tmp_path, name, make):
    place, other = tmp_path / "out" / name, tmp_path / "other"
    if name:
        (tmp_path / "out").mkdir()
    other.mkdir()
    (other / "mine.txt").write_text("mine")
    {
        "file": lambda: place.write_text("mine"),
        "folder": lambda: (place.mkdir(), (place / "mine.txt").write_text("mine")),
        "pipe": lambda: os.mkfifo(place),
        "link": lambda: place.symlink_to(other),
    }[make]()
    code, printed, messages = run(
        "compare", scene_file, "-o", tmp_path / "out", *SMALL, "--figures"
    )
    assert (code, printed) == (2, "")
    assert messages.startswith(f"fotismos: error: {place}: this ")
    fault = f"is a symbolic link, to '{other}'" if make == "link" else "was not made by fotismos"
    assert fault in messages
    assert not name or [path.name for path in (tmp_path / "out").iterdir()] == [name]
    assert make != "folder" or (place / "mine.txt").read_text() == "mine"
    assert [path.name for path in other.iterdir()] == ["mine.txt"]


@pytest.mark.guarantee(
    "runs", "A command deletes nothing of another one in a folder below its own."
)
def test_a_command_leaves_the_folder_of_another_one_alone(tmp_path):
    """A report in `out/report` and a compare in `out`: README's first two commands at once."""
    with results.hold(tmp_path / "out/report", "report") as inner:
        scene = results.own(results.own(inner) / "cornell-box")
        with results.hold(tmp_path / "out", "compare"):
            assert results.is_own(scene)
        assert results.is_own(scene)
        partial = inner / f".picture.1{atomic.PARTIAL}"
        others = inner / f"mine{atomic.PARTIAL}"
        for path in (partial, others):
            path.touch()
        with results.hold(tmp_path / "out", "compare"):
            pass
        assert partial.exists()
    with results.hold(tmp_path / "out/report", "report"):
        assert not partial.exists()
        assert others.exists()


def test_a_study_is_refused_before_it_computes(run, tmp_path, monkeypatch):
    study = tmp_path / "s.toml"
    study.write_text("[[part]]\nscene = 'lobe'\n[part.parameters]\nalpha = [0.1]\n")
    monkeypatch.setattr(running, "all_points", None)  # not to be called
    with results.hold_results(tmp_path / "out/study", [("s", study)], "another"):
        code, _, messages = run("study", study, "-o", tmp_path / "out")
    assert code == 2
    assert "another command writes there" in messages


@pytest.mark.guarantee("runs", "Files that you put into an output folder are never replaced.")
@pytest.mark.parametrize("name", ["index.html", "details.html", "run.json"])
def test_what_a_user_makes_later_stays(tmp_path, name):
    """In a folder that other commands use, after a run, and in place of a file of ours."""
    fault = f"{name}: this file was not made"
    with results.hold(tmp_path, "first") as out:
        results.write(results.own(out / "my-scene") / "comparison.json", "{}")
    (tmp_path / name).write_text("mine")
    with pytest.raises(InputError, match=fault), results.hold(tmp_path, "second"):
        pass
    (tmp_path / name).unlink()
    with results.hold(tmp_path, "third") as out:
        results.write(out / name, "ours")
    with results.hold(tmp_path, "fourth") as out:
        results.write(out / name, "ours again")
    (tmp_path / name).write_text("mine, in its place")
    with pytest.raises(InputError, match=fault), results.hold(tmp_path, "fifth"):
        pass
    assert (tmp_path / name).read_text() == "mine, in its place"


def test_a_file_made_while_a_command_runs_stays(tmp_path):
    with results.hold(tmp_path, "first") as out:
        (out / "index.html").write_text("mine")
        with pytest.raises(InputError, match=r"index\.html: this file was not made"):
            results.write(out / "index.html", "ours")
    assert (tmp_path / "index.html").read_text() == "mine"


def test_a_process_that_ends_while_a_file_is_replaced_does_not_lock_itself_out(
    tmp_path, monkeypatch
):
    replace = Path.replace
    for moment in ("before", "after"):

        def ending(path, target, moment=moment):
            if target.name != "index.html":
                return replace(path, target)
            if moment == "after":
                replace(path, target)
            raise EndedError

        with results.hold(tmp_path, "first") as out:
            results.write(out / "index.html", f"old {moment}")
            with monkeypatch.context() as patched:
                patched.setattr(Path, "replace", ending)
                with pytest.raises(EndedError):
                    results.write(out / "index.html", f"new {moment}")
        with results.hold(tmp_path, "second") as out:
            results.write(out / "index.html", "newer")


@pytest.mark.parametrize("mark", ["{", "{}", '{"index.html": 5}', '{"index.html": ["x"]}', "{[}"])
def test_a_damaged_mark_makes_nothing_ours(tmp_path, mark):
    (tmp_path / ".fotismos").write_text(mark)
    (tmp_path / "index.html").write_text("mine")
    fault = "index.html: this file was not made"
    with pytest.raises(InputError, match=fault), results.hold(tmp_path, "test"):
        pass
    assert (tmp_path / "index.html").read_text() == "mine"


def test_a_folder_of_version_0_3_is_taken_over(tmp_path):
    (tmp_path / ".fotismos").touch()
    (tmp_path / "index.html").write_text("of 0.3")
    with results.hold(tmp_path, "test") as out:
        results.write(out / "index.html", "new")
    assert (tmp_path / "index.html").read_text() == "new"


@pytest.mark.parametrize("command", ["compare", "cost", "report"])
def test_an_output_folder_has_a_name(run, command):
    scenes = [] if command == "report" else ["fig-8-9"]
    code, _, messages = run(command, *scenes, "-o", "")
    assert code == 2
    assert "it is empty. Name a folder" in messages


PAIRS = """
import random, sys, time
from pathlib import Path
from fotismos.heuristic.errors import OutputError
from fotismos.reports.files import results
top, seed, rounds = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
rng = random.Random(seed)
refused = 0
for number in range(rounds):
    time.sleep(rng.uniform(0, 0.01))
    kind = rng.choice(["out", "out/report", "cost", "fit", "fit"])
    name = rng.choice("ab")
    try:
        if kind.startswith("out"):
            with results.hold(top / kind, "compare") as folder:
                (name,) = results.assigned(folder, [(f"{name}-{seed}", None)])
                time.sleep(rng.uniform(0, 0.01))
                results.write(folder / name / "comparison.json", kind)
                results.write(folder / "index.html", str(number))
                assert (folder / name / "comparison.json").read_text() == kind
        else:
            with results.hold_results(top / "out" / kind, [(name, None)], kind) as (place,):
                time.sleep(rng.uniform(0, 0.01))
                results.write(place / "index.html", kind)
                results.write(place / f"{kind}.json", kind)
                assert (place / "index.html").read_text() == kind
    except OutputError as error:
        assert "another command writes there" in str(error), error
        refused += 1
print(rounds - refused)
"""


@pytest.mark.thorough
@pytest.mark.guarantee("runs", "Commands that run at once lose nothing, and are not refused late.")
def test_commands_that_run_at_once_lose_nothing(tmp_path):
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    words = [sys.executable, "-P", "-c", PAIRS, str(tmp_path)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    processes = [
        subprocess.Popen([*words, str(seed), "60"], env=environment, **pipes) for seed in range(4)
    ]
    for process in processes:
        printed, messages = process.communicate()
        assert (process.returncode, messages) == (0, "")
        assert int(printed) > 20  # the others were refused before they wrote anything


HOLD = """
import sys
from fotismos.reports.files import results
with results.hold(sys.argv[1], "fotismos compare mine.xml"):
    print("held", flush=True)
    sys.stdin.read()
"""


@pytest.mark.guarantee("runs", "Two commands never write to one folder.")
def test_two_commands_in_one_folder_are_refused(tmp_path):
    words = [sys.executable, "-P", "-c", HOLD, str(tmp_path)]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen(words, env=environment, text=True, **pipes) as other:
        assert other.stdout.readline() == "held\n"
        said = rf"process {other.pid} on .*: fotismos compare mine\.xml\)\. Wait"
        with pytest.raises(OutputError, match=said), results.hold(tmp_path, "second"):
            pass
        other.kill()  # the lock ends with its process
    with results.hold(tmp_path, "third") as out:
        results.write(out / "index.html", "")


# --- Names -----------------------------------------------------------------------------------


def test_a_folder_belongs_to_one_scene_also_later(tmp_path):
    out = results.own(tmp_path / "out")
    files = [tmp_path / name / "x.xml" for name in ("a", "b", "c")]
    first = results.assigned(out, [("x", files[0]), ("x", files[1]), ("x", None)])
    assert first == ["x", "x-2", "x-3"]
    for name in first:
        results.write(out / name / "comparison.json", "{}")
    assert results.assigned(out, [("x", files[2]), ("x", files[1])]) == ["x-4", "x-2"]
    assert results.assigned(out, [("x", None), ("x", None)]) == ["x-3", "x-5"]
    (out / "y").mkdir()
    (out / "y/mine.txt").write_text("mine")
    with pytest.raises(InputError, match="y: this folder was not made by fotismos"):
        results.assigned(out, [("y", None)])


def test_names_of_folders_are_plain_and_free(tmp_path):
    names = {
        "my scene": "my-scene", "../../evil": "-..-evil", "a/b\nc": "a-b-c", "..": "scene",
        "cost": "cost-2", "Tables": "Tables-2", "index.html": "index.html-2",
        "u\u0308": "\u00fc", "x" * 300: "x" * 100, "\udcff": "-",
    }  # fmt: skip
    out = results.own(tmp_path / "out")
    for number, (name, place) in enumerate(names.items()):
        alone = results.own(tmp_path / f"out-{number}")
        assert results.assigned(alone, [(name, None)]) == [place]
    results.assigned(out, [(name, None) for name in names])
    made = {"out", *(f"out-{number}" for number in range(len(names)))}
    assert {path.name for path in tmp_path.iterdir()} == made


# --- Disks -----------------------------------------------------------------------------------


def test_what_a_user_names_is_written_in_place_of_a_file_or_into_a_device(tmp_path):
    """Never in place of a device or a link, which `/dev/stdout` is."""
    (tmp_path / "file").write_text("old")
    (tmp_path / "link").symlink_to("file")
    atomic.put(tmp_path / "link", "new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "file").read_text() == "new"
    (tmp_path / "full").symlink_to("/dev/full")
    with pytest.raises(OutputError, match="No space left"):
        atomic.put(tmp_path / "full", "too much")
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OutputError, match="pipe: No such device"):
        atomic.put(tmp_path / "pipe", "nobody reads it")
    with pytest.raises(OutputError, match="too long"):
        atomic.put(tmp_path / ("x" * 300), "no file")


@pytest.mark.guarantee("runs", "If a write fails, the earlier file stays whole.")
@pytest.mark.parametrize("call", ["write_bytes", "replace"])
def test_a_write_that_fails_leaves_the_earlier_file(call, tmp_path, monkeypatch):
    atomic.write(tmp_path / "a", "old")

    def fails(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patched:
        patched.setattr(Path, call, fails)
        with pytest.raises(OutputError, match=r"a: No space left on device\. Free some space"):
            atomic.write(tmp_path / "a", "new")
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("a", "old")]


def test_an_entry_is_its_content_under_its_key_or_nothing(tmp_path):
    entry = atomic.Entry(tmp_path / "r.json", "key")
    entry.save({"rows": [1, 2.5, None, "ü"]})
    assert entry.load() == {"rows": [1, 2.5, None, "ü"]}
    assert atomic.Entry(entry.path, "another").load() is None
    whole = entry.path.read_bytes()
    flipped = (whole[:i] + bytes([whole[i] ^ 1]) + whole[i + 1 :] for i in range(len(whole)))
    cut = (whole[:i] for i in range(len(whole)))
    for damaged in (b"[]", b"3", b"\xff\xfe", whole + b" ", *flipped, *cut):
        entry.path.write_bytes(damaged)
        assert entry.load() is None
    entry.path.unlink()
    os.mkfifo(entry.path)
    assert entry.load() is None
    with pytest.raises(OutputError, match=r"not a regular file.* `output`"):
        entry.save({})
