"""Processes that work is given to: deaths, time limits, process groups, and what is told."""

import os
import signal
import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

import pytest

from comparisons.processes.pool import Pool
from comparisons.processes.worker import Task, end_after_task
from heuristic.errors import InputError, LostProcessError
from tests.programs import ROOT


def add(*numbers):
    return sum(numbers)


def process():
    return os.getpid()


def count(total, progress):
    for done in range(total):
        progress("counting", done, total)
    return total


def die_of(number):
    os.kill(os.getpid(), number)


def refuse(message):
    raise InputError(message)


def stop(kind):
    raise kind


def note_once(path):
    with path.open("a") as file:
        file.write("once\n")


def leave_behind(path):
    """Start a process that outlives this one, and never return."""
    child = subprocess.Popen(["/bin/sh", "-c", "sleep 1000; true"])
    path.write_text(f"{os.getpid()} {child.pid}")
    time.sleep(1000)


def is_alive(pid):
    """Tell whether a process runs; one that ended and was not asked for does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def ends(*pids):
    until = time.monotonic() + 10
    while any(map(is_alive, pids)) and time.monotonic() < until:
        time.sleep(0.02)
    return not any(map(is_alive, pids))


def do(pool, *tasks):
    """Return what came of each task: a value, or what it raised."""
    found = {}
    for task, outcome in pool.each(tasks):
        found[task.name] = outcome.exception() or outcome.result()
    return found


@pytest.mark.parametrize("processes", [0, 1, 2])
def test_tasks_are_done_and_report_their_progress(processes):
    told = []
    with Pool(processes) as pool:
        found = do(
            pool,
            Task("sum", add, (1, 2)),
            Task("count", count, (3,), lambda *words: told.append(words)),
            Task("wrong", refuse, ("no such thing",)),
        )
    assert (found["sum"], found["count"]) == (3, 3)
    assert told == [("counting", done, 3) for done in range(3)]
    assert isinstance(found["wrong"], InputError)
    assert str(found["wrong"]) == "no such thing"


def test_one_process_does_task_after_task_once_it_is_prepared(tmp_path):
    path = tmp_path / "prepared"
    with Pool(1, partial(note_once, path)) as pool:
        found = do(pool, *(Task(name, process, ()) for name in "abc"))
        found |= do(pool, Task("d", process, ()))
    assert len(set(found.values())) == 1
    assert os.getpid() not in found.values()
    assert path.read_text() == "once\n"


def test_a_task_that_kills_its_process_takes_no_other_along():
    with Pool(1) as pool:
        found = do(
            pool,
            Task("aborting", die_of, (signal.SIGABRT,)),
            Task("killed", die_of, (signal.SIGKILL,)),
            Task("leaving", os._exit, (7,)),
            Task("dividing", divmod, (1, 0)),
            Task("sum", add, (1, 2)),
        )
    assert found.pop("sum") == 3
    assert all(isinstance(error, LostProcessError) for error in found.values())
    messages = {name: str(error) for name, error in found.items()}
    assert messages["aborting"] == "aborting: its process died of SIGABRT in native code."
    assert messages["killed"].startswith("killed: its process was killed (SIGKILL)")
    assert messages["leaving"] == "leaving: its process ended with exit code 7."
    assert messages["dividing"].startswith("dividing: ZeroDivisionError: ")


def die_once(path):
    if not path.exists():
        path.write_text("")
        die_of(signal.SIGKILL)
    return "done"


@pytest.mark.guarantee("runs", "A killed process loses nothing: another one does its task.")
def test_a_process_that_somebody_kills_loses_nothing(tmp_path):
    with Pool(2) as pool:
        tasks = [Task("equal", die_once, (tmp_path / str(i // 2),)) for i in range(6)]
        results = [outcome.result() for _, outcome in pool.each(tasks)]
    assert results == 6 * ["done"]


def close_all():
    os.closerange(0, 100)
    time.sleep(1000)


@pytest.mark.parametrize("kind", [KeyboardInterrupt, SystemExit, GeneratorExit])
def test_whatever_a_task_raises_is_its_own_failure(kind, capfd):
    with Pool(1) as pool:
        found = do(pool, Task("raising", stop, (kind,)), Task("sum", add, (1, 2)))
    assert str(found["raising"]).startswith(f"raising: {kind.__name__}")
    assert found["sum"] == 3
    assert capfd.readouterr() == ("", "")


def test_a_process_that_closed_all_its_files_is_ended():
    begin = time.monotonic()
    with Pool(1, limit_s=60) as pool:
        found = do(pool, Task("closing", close_all, ()), Task("sum", add, (1, 2)))
    assert isinstance(found["closing"], LostProcessError)
    assert found["sum"] == 3
    assert time.monotonic() - begin < 50


def leave_daemon(path, number):
    """Start a process in a session of its own, whose parent is gone."""
    script = f"setsid sh -c 'echo $$ >{path}; exec sleep 1000' &"
    subprocess.run(["/bin/sh", "-c", script])
    while not path.exists() or not path.read_text():
        time.sleep(0.01)
    if number:
        os.kill(os.getpid(), number)


@pytest.mark.parametrize("number", [0, signal.SIGKILL])
def test_a_session_of_its_own_does_not_outlive_the_pool(number, tmp_path):
    with Pool(1) as pool:
        do(pool, Task("leaving", leave_daemon, (tmp_path / "daemon", number)))
    assert ends(int((tmp_path / "daemon").read_text()))


def make_temporary(number):
    tempfile.mkdtemp()
    if number:
        os.kill(os.getpid(), number)
    return tempfile.mkstemp()[1]


@pytest.mark.parametrize("number", [0, signal.SIGKILL])
def test_temporary_files_go_with_their_process(number, tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with Pool(1) as pool:
        found = do(pool, Task("making", make_temporary, (number,)))["making"]
        assert isinstance(found, LostProcessError if number else str)
        if not number:
            assert Path(found).is_relative_to(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_what_a_task_prints_is_no_result(capfd):
    with Pool(1) as pool:
        do(pool, Task("talking", os.write, (1, b"native code")), Task("python", print, ("words",)))
    assert capfd.readouterr() == ("", "native codewords\n")


def test_an_idle_process_that_died_is_replaced():
    with Pool(1) as pool:
        pid = do(pool, Task("a", process, ()))["a"]
        os.kill(pid, signal.SIGKILL)
        assert ends(pid)
        assert do(pool, Task("b", process, ()))["b"] != pid


def test_a_task_that_takes_too_long_is_ended_with_all_that_it_started(tmp_path):
    with Pool(2, limit_s=3.0) as pool:
        found = do(pool, Task("slow", leave_behind, (tmp_path / "pids",)), Task("sum", add, (1, 2)))
        pids = (tmp_path / "pids").read_text().split()
        assert ends(*pids)
    assert found["sum"] == 3
    assert str(found["slow"]) == "slow: it made no progress for 3 s, and was ended."


def test_what_is_under_way_ends_with_the_pool(tmp_path):
    path = tmp_path / "pids"

    def tasks():
        yield Task("slow", leave_behind, (path,))
        while not path.exists() or len(path.read_text().split()) < 2:
            time.sleep(0.02)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), Pool(2) as pool:
        list(pool.each(tasks()))
    assert ends(*path.read_text().split())


PARENT = """
import sys
from pathlib import Path
from comparisons.processes.pool import Pool
from comparisons.processes.worker import Task, end_after_task
from tests.test_pool import leave_behind

if __name__ == "__main__":
    with Pool(1) as pool:
        list(pool.each([Task("slow", leave_behind, (Path(sys.argv[1]),))]))
"""


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_a_process_group_ends_with_the_process_that_asked(number, tmp_path):
    (tmp_path / "parent.py").write_text(PARENT)
    path = tmp_path / "pids"
    parent = subprocess.Popen(
        [sys.executable, tmp_path / "parent.py", path],
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        stderr=subprocess.DEVNULL,
    )
    try:
        while not path.exists() or len(path.read_text().split()) < 2:
            assert parent.poll() is None
            time.sleep(0.02)
        parent.send_signal(number)
        parent.wait(10)
        assert ends(*path.read_text().split())
    finally:
        parent.kill()
        parent.wait()


def beat(times, pause, progress):
    for done in range(times):
        time.sleep(pause)
        progress("beating", done, times)
    return "alive"


@pytest.mark.guarantee(
    "runs",
    "A task that makes progress continues; one that makes none is ended.",
)
def test_progress_is_a_sign_of_life():
    with Pool(1, limit_s=3.0) as pool:
        pool.start()
        found = do(
            pool,
            Task("slow", beat, (8, 0.7), lambda *_: None),
            Task("silent", time.sleep, (1000,)),
        )
    assert found["slow"] == "alive"
    assert str(found["silent"]) == "silent: it made no progress for 3 s, and was ended."


def fork_and(answer):
    """Fork; both return."""
    return f"{answer} of the parent" if os.fork() else f"{answer} of the child"


def fork_and_leave():
    """Leave behind a child that has all that this process has open, and end."""
    if os.fork() == 0:
        time.sleep(1000)
    os._exit(5)


def test_only_the_process_that_was_asked_answers():
    with Pool(1) as pool:
        found = do(pool, *(Task(name, fork_and, (name,)) for name in "abc"))
    assert found == {name: f"{name} of the parent" for name in "abc"}


def test_a_fork_does_not_hide_the_end_of_its_parent():
    with Pool(1) as pool:
        begin = time.monotonic()
        found = do(pool, Task("forking", fork_and_leave, ()), Task("sum", add, (1, 2)))
        assert time.monotonic() - begin < 60
    assert str(found["forking"]) == "forking: its process ended with exit code 5."
    assert found["sum"] == 3


def unready():
    raise InputError("nothing is ready")


def give_what_cannot_be_sent():
    return lambda: None


def spend():
    end_after_task()
    return os.getpid()


def test_a_process_that_cannot_be_prepared_says_why_each_time():
    with Pool(1, unready) as pool:
        found = do(pool, Task("a", process, ()), Task("b", process, ()))
    assert {str(error) for error in found.values()} == {"nothing is ready"}


def test_a_result_that_cannot_be_sent_is_a_message():
    with Pool(1) as pool:
        found = do(pool, Task("odd", give_what_cannot_be_sent, ()), Task("sum", add, (1, 2)))
    assert isinstance(found["odd"], LostProcessError)
    assert "cannot be sent" in str(found["odd"])
    assert found["sum"] == 3


def test_a_spent_process_does_no_other_task():
    with Pool(1) as pool:
        found = do(pool, Task("a", spend, ()), Task("b", spend, ()), Task("c", process, ()))
    assert len(set(found.values())) == 3
