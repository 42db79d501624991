"""Two commands in one output folder: the second says who is there; locks end with their owner."""

import errno
import json
import os
import signal
import subprocess
import sys

import pytest

from comparisons import atomic
from heuristic.errors import OutputError
from reports.files import holding, listing, ownership
from reports.run import output
from tests.programs import ROOT

HOLDS = """
import sys, time
import heuristic
from reports.files import ownership
from reports.run import output
with output.held(sys.argv[1], "fotismos compare a.xml") as folder:
    ownership.write(folder / "index.html", "theirs")
    print("held", flush=True)
    time.sleep(600)
"""


@pytest.fixture
def holder(tmp_path):
    """A process that holds the folder."""
    words = [sys.executable, "-c", HOLDS, tmp_path]
    with subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "held\n"
        yield process
        process.kill()


@pytest.mark.guarantee(
    "runs",
    "The second of two commands in one folder reports which process holds it.",
)
def test_the_second_command_says_who_holds_the_folder(run, scene_file, tmp_path, holder):
    before = {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
    for command in ("compare", "cost", "fit"):
        code, printed, messages = run(command, scene_file, "-o", tmp_path, "--resolution", "12x12")
        assert (code, printed) == (2, "")
        assert f"process {holder.pid} on {atomic.HOST}, since 2" in messages
        assert "fotismos compare a.xml" in messages
        assert "Wait until it ends, or choose another output folder with -o" in messages
        assert messages.count("\n") == 1
    assert {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()} == before
    with output.held(tmp_path / "other", "test"):
        pass


def test_the_lock_of_a_killed_process_is_gone_at_once(tmp_path, holder):
    os.kill(holder.pid, signal.SIGKILL)
    holder.wait()
    with output.held(tmp_path, "test") as folder:
        ownership.write(folder / "index.html", "ours")
        told = json.loads((folder / holding.LOCK).read_text(encoding="utf-8"))
    assert told["pid"] == os.getpid()


def test_a_process_that_a_command_starts_does_not_keep_its_lock(tmp_path):
    with output.held(tmp_path, "test") as folder:
        ownership.write(folder / "index.html", "ours")
        left = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    try:
        with output.held(tmp_path, "test"):
            pass
    finally:
        left.communicate()


def test_within_a_process_too_and_it_is_given_back_on_errors(tmp_path):
    with output.held(tmp_path, "first") as folder:
        ownership.write(folder / "index.html", "ours")
        with pytest.raises(OutputError, match="first"), output.held(tmp_path, "second"):
            raise AssertionError("both hold it")
        assert (folder / "index.html").is_file()
    with pytest.raises(KeyboardInterrupt), output.held(tmp_path, "third"):
        raise KeyboardInterrupt
    with output.held(tmp_path, "fourth"):
        pass


def test_a_lock_without_its_words_still_holds(tmp_path, holder):
    for content in (b"", b"{}", b"\xff", b'{"pid": 1}', b"[]", b"\0" * 100):
        (tmp_path / holding.LOCK).write_bytes(content)
        with pytest.raises(OutputError, match="another command"), output.held(tmp_path, "test"):
            raise AssertionError(content)


@pytest.mark.parametrize("code", sorted(holding.WITHOUT_LOCKS))
def test_without_locks_of_the_system_it_goes_on(tmp_path, monkeypatch, code):
    def fail(*_):
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr("fcntl.flock", fail)
    with output.held(tmp_path, "test") as folder:
        ownership.write(folder / "index.html", "ours")
    assert listing.read(tmp_path).made == {"index.html"}


def test_another_error_of_the_lock_is_one_message(tmp_path, monkeypatch):
    def fail(*_):
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    monkeypatch.setattr("fcntl.flock", fail)
    with pytest.raises(OutputError, match="Input/output error"), output.held(tmp_path, "test"):
        raise AssertionError


def test_where_nothing_is_made_no_lock_is_left(tmp_path):
    (tmp_path / "mine").touch()
    with output.held(tmp_path, "test") as folder:
        output.below(folder, "fit")
    assert [path.name for path in tmp_path.iterdir()] == ["mine"]


RACES = """
import sys
import heuristic
from heuristic.errors import OutputError
from pathlib import Path
from reports.files import ownership
from reports.run import output
folder, won = Path(sys.argv[1]), 0
for number in range(40):
    try:
        with output.held(folder, "race"):
            (folder / "within").open("x").close()
            (folder / "within").unlink()
            if number % 2:
                ownership.write(folder / "index.html", "page")
            won += 1
    except OutputError as error:
        assert "another command" in str(error), error
print(won)
"""


def test_two_that_race_are_never_both_within(tmp_path):
    """Also while the lock's file is deleted, as where nothing was made."""
    words = [sys.executable, "-c", RACES, tmp_path]
    racing = [
        subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        for _ in range(3)
    ]
    for process in racing:
        printed, messages = process.communicate(timeout=120)
        assert messages == ""
        assert int(printed) > 0
    assert (tmp_path / "index.html").is_file()
