"""What fotismos replaces and clears away: its own results, and nothing else."""

import json
import os
import re
import subprocess
import sys
from random import Random

import pytest

from comparisons import atomic
from heuristic.errors import InputError
from reports.ci.checks import FILES
from reports.files import holding, listing, ownership
from reports.run import output
from tests.programs import python

HIDDEN = {listing.MARK, holding.LOCK}
SMALL = ("--spp", 2, "--resolution", "12x12")


def contents(folder):
    """Return everything below a folder: files with their bytes, folders, links."""
    return {
        path.relative_to(folder): (
            os.readlink(path) if path.is_symlink() else path.is_file() and path.read_bytes()
        )
        for path in sorted(folder.rglob("*"))
    }


def partial(folder, name, pid, host=atomic.HOST, kind="partial"):
    return folder / f".{name}.{host}.{pid}.fotismos-{kind}"


@pytest.fixture
def dead():
    """The number of a process that has ended."""
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    return ended.pid


@pytest.mark.parametrize(
    "name", ["my scene/note.txt", "my scene", "index.html", "run.json", "tables/metrics.csv"]
)
def test_compare_refuses_to_replace_what_it_did_not_make(run, scene_file, name):
    """A folder `my-scene` with textures, a page, a table: one message, nothing touched."""
    folder = scene_file.parent
    place = folder / name.replace("my scene", "my-scene")
    place.parent.mkdir(exist_ok=True)
    place.write_text("mine", encoding="utf-8")
    before = contents(folder)
    code, printed, messages = run("compare", scene_file, "-o", folder, *SMALL)
    assert (code, printed) == (2, "")
    assert "was not made by fotismos" in messages
    assert "-o" in messages
    assert contents(folder) == before


@pytest.mark.parametrize("command", ["cost", "fit"])
def test_other_commands_refuse_it_too(run, scene_file, command):
    folder = scene_file.parent
    place = folder / command / "my-scene"
    place.mkdir(parents=True)
    (place / "note.txt").write_text("mine", encoding="utf-8")
    before = contents(folder)
    code, _, messages = run(command, scene_file, "-o", folder, "--resolution", "12x12")
    assert code == 2
    assert "was not made by fotismos" in messages
    assert contents(folder) == before


def test_a_link_to_a_folder_of_the_user_is_not_replaced(run, scene_file, tmp_path_factory):
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    (elsewhere / "note.txt").write_text("mine", encoding="utf-8")
    (scene_file.parent / "my-scene").symlink_to(elsewhere)
    assert run("compare", scene_file, "-o", scene_file.parent, *SMALL)[0] == 2
    assert (elsewhere / "note.txt").read_text() == "mine"
    assert (scene_file.parent / "my-scene").is_symlink()


def test_an_earlier_result_is_replaced_and_what_others_put_there_is_kept(run, scene_file):
    out = scene_file.parent / "out"
    assert run("compare", scene_file, "-o", out, *SMALL)[0] == 0
    place = out / "my-scene"
    (place / "notes").mkdir()
    (place / "notes/mine.txt").write_text("mine", encoding="utf-8")
    (place / "mine.png").write_bytes(b"mine")
    first = json.loads((place / "comparison.json").read_text(encoding="utf-8"))
    assert run("compare", scene_file, "-o", out, *SMALL, "--seed", 5)[0] == 0
    second = json.loads((place / "comparison.json").read_text(encoding="utf-8"))
    assert (first["seed"], second["seed"]) == (0, 5)
    assert (place / "notes/mine.txt").read_text(encoding="utf-8") == "mine"
    assert (place / "mine.png").read_bytes() == b"mine"


def test_hidden_entries_of_others_are_left_as_they_are(tmp_path, dead):
    """Whatever they end with, and whatever is in them; so are the partial files of a live run."""
    for name in (".config.old", ".my.partial", ".a.12.partial", ".env.old.fotismos-old"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "mine").write_text("mine", encoding="utf-8")
    (tmp_path / ".env.old").write_text("mine", encoding="utf-8")
    partial(tmp_path, "a", os.getpid()).mkdir()
    partial(tmp_path, "a", dead, "another-machine").mkdir()
    partial(tmp_path, "b", dead, kind="old").mkdir()  # no mark in it: nobody's result
    before = contents(tmp_path)
    with output.held(tmp_path, "test"):
        pass
    assert contents(tmp_path) == before


def test_what_a_dead_run_left_is_cleared_away_and_restored(tmp_path, dead):
    partial(tmp_path, "a", dead).mkdir()
    partial(tmp_path, "index.html", dead).touch()
    for name in ("a", "b"):
        old = partial(tmp_path, name, dead, kind="old")
        old.mkdir()
        listing.confirm(old)
        (old / "comparison.json").write_text(f"old {name}")
    ownership.folder(tmp_path / "b")
    (tmp_path / "b/comparison.json").write_text("b")
    with output.held(tmp_path, "test"):
        pass
    assert {path.name for path in tmp_path.iterdir()} - HIDDEN == {"a", "b"}
    assert (tmp_path / "a/comparison.json").read_text() == "old a"
    assert (tmp_path / "b/comparison.json").read_text() == "b"


def test_a_failed_check_clears_away_its_own_pictures_alone(tmp_path):
    place = tmp_path / "a"
    ownership.folder(place)
    for name in ("check.json", "heuristic.png"):
        ownership.write(place / name, b"ours")
    (place / "reference.png").write_bytes(b"mine")
    with output.held(tmp_path, "test"):
        ownership.clear(place, FILES)
        assert [path.name for path in place.iterdir()] == ["reference.png"]
        (place / "reference.png").unlink()
        ownership.clear(place, FILES)
    assert not list(tmp_path.iterdir())


@pytest.mark.guarantee(
    "runs",
    "No file that fotismos did not make is replaced or removed, whatever the order of writes.",
)
@pytest.mark.parametrize("seed", range(8))
def test_random_writings_never_lose_what_is_not_ours(tmp_path, seed):
    """Files and folders of both kinds, written and replaced in any order, links included."""
    random, mine, ours = Random(seed), {}, set()
    names = [f"n{number}" for number in range(6)]
    for step in range(60):
        name, inner = random.choice(names), random.choice(names)
        place, action = tmp_path / name, random.randrange(5)
        if action == 0 and not place.exists() and not place.is_symlink():
            place.write_text(f"mine {step}")
            mine[place] = f"mine {step}"
        elif action == 1:
            place.mkdir(exist_ok=True) if not place.exists() and not place.is_symlink() else None
            if place.is_dir() and (place / inner) not in ours and not (place / inner).exists():
                (place / inner).write_text(f"mine {step}")
                mine[place / inner] = f"mine {step}"
        elif action == 2:
            try:
                ownership.write(place, "ours")
            except InputError:
                continue
            assert place not in mine
        else:
            try:
                with ownership.replacing_folder(place) as new:
                    if random.random() < 0.3:
                        raise KeyboardInterrupt
                    written = random.sample(names, 2)
                    for chosen in written:
                        (new / chosen).write_text("ours")
                assert not {place / chosen for chosen in written} & mine.keys()
                ours |= {place / chosen for chosen in written}
            except (InputError, KeyboardInterrupt):
                continue
        assert all(path.read_text() == text for path, text in mine.items())
    assert not [path for path in tmp_path.iterdir() if "fotismos-" in path.name]


def test_a_number_that_another_process_has_now_keeps_nothing(tmp_path):
    """The start of a process is in the name; without it, the number alone tells."""
    mine = atomic.beside(tmp_path / "a").name
    recycled = mine.replace(f".{os.getpid()}-", f".{os.getpid()}-1")
    alive = partial(tmp_path, "b", os.getppid())
    endless = partial(tmp_path, "c", "9" * 30)
    for name in (mine, recycled, alive.name, endless.name):
        (tmp_path / name).touch()
    with output.held(tmp_path, "test"):
        assert {path.name for path in tmp_path.iterdir()} - HIDDEN == {alive.name, endless.name}


KILLED = """
import os, signal, sys
from pathlib import Path
import heuristic
from reports.files import ownership
from reports.run import output

def ending(call):
    def instead(*words, **more):
        global count
        count += 1
        if count == at:
            os.kill(os.getpid(), signal.SIGKILL)
        return call(*words, **more)
    return instead

def produce(folder):
    for name in ("mkdir", "rename", "replace", "unlink", "rmdir", "open", "write"):
        setattr(os, name, ending(getattr(os, name)))
    with output.held(folder, "killed"):
        ownership.write(folder / "index.html", "ours")
        with ownership.replacing_folder(folder / "scene") as new:
            (new / "a.png").write_bytes(b"ours")
        ownership.write(output.below(folder, "fit") / "fit.json", "ours")

for at in range(1, 100):
    count, folder = 0, Path(sys.argv[1], str(at))
    folder.mkdir()
    child = os.fork()
    if not child:
        produce(folder)
        os._exit(0)
    if not os.waitpid(child, 0)[1]:
        break
print(at)
"""


@pytest.mark.guarantee(
    "runs",
    "A file that a user puts where a killed command was about to write stays the user's.",
)
def test_what_is_put_where_a_killed_run_was_about_to_write_is_not_ours(tmp_path):
    """Killed at every call that changes the disk; the user's file comes before the next run."""
    assert 15 < int(python("-c", KILLED, tmp_path).stdout) < 99
    for folder in tmp_path.iterdir():
        mine = [folder / name for name in ("index.html", "fit/fit.json")]
        mine = [path for path in mine if path.parent.is_dir() and not path.exists()]
        for path in mine:
            path.write_text("mine", encoding="utf-8")
        with output.held(folder, "next"):
            for path in mine:
                with pytest.raises(InputError, match="not made by fotismos"):
                    ownership.write(path, "ours")
            with ownership.replacing_folder(folder / "scene") as new:
                (new / "a.png").write_bytes(b"next")
        assert all(path.read_text(encoding="utf-8") == "mine" for path in mine)
        left = [path.name for path in folder.rglob("*") if "fotismos-" in path.name]
        assert left == [holding.LOCK], folder


def test_a_list_of_gigabytes_is_refused_unread(run, scene_file):
    out = scene_file.parent / "out"
    out.mkdir()
    with (out / listing.MARK).open("wb") as file:
        file.truncate(2**40)
    code, _, messages = run("compare", scene_file, "-o", out, *SMALL)
    assert code == 2
    assert re.search(r"\.fotismos: .* exceeds .* Move it away", messages)
    assert (out / listing.MARK).stat().st_size == 2**40


@pytest.mark.parametrize("line", [".", "..", "../mine", "/etc/passwd", "a/b", '"../mine\\n"'])
def test_a_list_never_leads_out_of_its_folder(tmp_path, line):
    out = tmp_path / "out"
    out.mkdir()
    said = [
        line,
        *(f'{{"{kind}": "{line}", "as": "1", "of": "x"}}' for kind in ("coming", "place")),
    ]
    (out / listing.MARK).write_text("".join(f"{each}\n" for each in said))
    assert listing.read(out) == listing.Listed()
    with output.held(out, "test"):
        pass
