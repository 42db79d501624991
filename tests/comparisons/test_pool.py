"""Processes that do tasks: deaths, time limits, process groups, signals, and a Dask cluster."""

import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest

from fotismos.comparisons.processes import cluster
from fotismos.comparisons.processes.pool import Pool, Task, silent
from fotismos.heuristic.errors import InputError, LostProcessError
from tests.shared import dask_cluster
from tests.shared.outputs import results
from tests.shared.programs import ROOT
from tests.shared.small_baselines import change
from tests.shared.small_scene import SCENE


def process():
    return os.getpid()


def count(total, progress):
    for done in range(total):
        progress("counting", done, total)
    return total


def beat(times, pause, progress):
    for done in range(times):
        time.sleep(pause)
        progress("beating", done, times)
    return "alive"


def refuse(message):
    raise InputError(message)


def stop(kind):
    raise kind


def die_of(number):
    os.kill(os.getpid(), number)


def close_all():
    os.closerange(0, 100)
    time.sleep(1000)


def note_once(path):
    with path.open("a") as file:
        file.write("once\n")


def leave_behind(path):
    """Start a process that outlives this one, and never return."""
    child = subprocess.Popen(["/bin/sh", "-c", "sleep 1000; true"])
    path.write_text(f"{os.getpid()} {child.pid}")
    time.sleep(1000)


def fork_and(answer):
    """Fork; both return."""
    return f"{answer} of the parent" if os.fork() else f"{answer} of the child"


def fork_and_leave():
    """Leave behind a child that has all that this process has open, and end."""
    if os.fork() == 0:
        time.sleep(1000)
    os._exit(5)


def unready():
    raise InputError("nothing is ready")


def give_what_cannot_be_sent():
    return lambda: None


def is_alive(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def ends(*pids):
    until = time.monotonic() + 10
    while any(map(is_alive, pids)) and time.monotonic() < until:
        time.sleep(0.02)
    return not any(map(is_alive, pids))


def do(pool, *tasks, told=silent):
    """Return what came of each task: a value, or what it raised."""
    return {
        task.name: outcome.exception() or outcome.result()
        for task, outcome in pool.each(tasks, told)
    }


@pytest.mark.parametrize("processes", [0, 1])
def test_tasks_are_done_and_report_their_progress(processes, tmp_path):
    told, path = [], tmp_path / "prepared"
    with Pool(processes, partial(note_once, path)) as pool:
        found = do(
            pool,
            Task("sum", divmod, (7, 2)),
            Task("count", count, (3,), tells=True),
            Task("wrong", refuse, ("no such thing",)),
            Task("process", process, ()),
            told=lambda task, *state: told.append((task.name, *state)),
        )
    assert (found["sum"], found["count"], str(found["wrong"])) == ((3, 1), 3, "no such thing")
    assert isinstance(found["wrong"], InputError)
    assert told == [("count", "counting", done, 3) for done in range(3)]
    assert (found["process"] == os.getpid()) == (processes == 0)
    assert path.read_text() == "once\n"


LOST = {
    "aborting": (die_of, (signal.SIGABRT,), "its process died of SIGABRT in native code."),
    "killed": (die_of, (signal.SIGKILL,), "its process was killed (SIGKILL)"),
    "leaving": (os._exit, (7,), "its process ended with exit code 7."),
    "forking": (fork_and_leave, (), "its process ended with exit code 5."),
    "dividing": (divmod, (1, 0), "ZeroDivisionError: "),
    "interrupting": (stop, (KeyboardInterrupt,), "KeyboardInterrupt: "),
    "exiting": (stop, (SystemExit,), "SystemExit: "),
    "odd": (give_what_cannot_be_sent, (), "its result cannot be sent: "),
    "closing": (close_all, (), "its process no longer answered."),
    "silent": (time.sleep, (1000,), "it made no progress for 6 s, and was ended."),
}


@pytest.mark.thorough
@pytest.mark.guarantee("runs", "A task that hangs or dies fails; all others are done.")
def test_a_lost_task_takes_no_other_along(capfd):
    with Pool(2, limit_s=6.0) as pool:
        pool.start()
        tasks = [Task(name, *call) for name, (*call, _) in LOST.items()]
        beating = Task("beating", beat, (10, 0.7), tells=True)
        found = do(pool, beating, *tasks, Task("last", os.write, (1, b"native code")),
                   Task("words", print, ("words",)))  # fmt: skip
    assert (found["beating"], found["last"]) == ("alive", 11)
    for name, (*_, message) in LOST.items():
        assert isinstance(found[name], LostProcessError)
        assert str(found[name]).startswith(f"{name}: {message}")
    # What a task prints is no result.
    assert capfd.readouterr() in (("", "native codewords\n"), ("", "wordsnative code\n")), "stdout"


@pytest.mark.thorough
def test_processes_answer_once_and_are_replaced_when_spent_or_dead():
    with Pool(1) as pool:
        found = do(pool, *(Task(name, fork_and, (name,)) for name in "abc"))
        assert found == {name: f"{name} of the parent" for name in "abc"}
        pids = list(do(pool, Task("d", process, ()), Task("e", process, (), ends_process=True),
                       Task("f", process, ())).values())  # fmt: skip
        assert pids[0] == pids[1] != pids[2]
        os.kill(pids[2], signal.SIGKILL)
        assert ends(pids[2])
        assert do(pool, Task("g", process, ()))["g"] != pids[2]
    with Pool(1, unready) as pool:
        found = do(pool, Task("a", process, ()), Task("b", process, ()))
    assert {str(error) for error in found.values()} == {"nothing is ready"}


PARENT = """
import sys
from pathlib import Path
from fotismos.comparisons.processes.pool import Pool, Task
from tests.comparisons.test_pool import leave_behind

if __name__ == "__main__":
    with Pool(1, limit_s=float(sys.argv[2])) as pool:
        list(pool.each([Task("slow", leave_behind, (Path(sys.argv[1]),))]))
"""


@pytest.mark.thorough
@pytest.mark.guarantee("runs", "All processes of a command end with it, whatever ends it.")
def test_processes_end_with_what_they_started_when_the_command_or_the_time_does(tmp_path):
    (tmp_path / "parent.py").write_text(PARENT)
    for number in (signal.SIGKILL, signal.SIGTERM, signal.SIGINT, None):
        path = tmp_path / f"pids {number}"
        parent = subprocess.Popen(
            [sys.executable, tmp_path / "parent.py", path, "1000" if number else "8"],
            env=os.environ | {"PYTHONPATH": str(ROOT)},
            stderr=subprocess.DEVNULL,
        )
        try:
            while not path.exists() or len(path.read_text().split()) < 2:
                assert parent.poll() is None
                time.sleep(0.02)
            if number:
                parent.send_signal(number)
            parent.wait(60)
            assert ends(*path.read_text().split()), number
        finally:
            parent.kill()
            parent.wait()


MODULE = """
import time
print("begun", flush=True)
time.sleep(0.5)
print("loaded", flush=True)
"""
PROGRAM = """
import sys, time
from fotismos.comparisons.processes import interruption
interruption.listen()
try:
    import module
    time.sleep(60)
except KeyboardInterrupt as error:
    sys.exit(interruption.code_of(error))
"""


@pytest.mark.thorough
def test_a_signal_waits_until_a_module_is_loaded(tmp_path):
    """Native modules that are just loaded crash of it, or swallow it."""
    (tmp_path / "module.py").write_text(MODULE)
    for number in (signal.SIGINT, signal.SIGTERM):
        process = subprocess.Popen(
            [sys.executable, "-c", PROGRAM],
            cwd=tmp_path,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
            stdout=subprocess.PIPE,
            text=True,
        )
        assert process.stdout.readline() == "begun\n"
        process.send_signal(number)
        assert process.communicate(timeout=30)[0] == "loaded\n"
        assert process.returncode == 128 + number


# --- A Dask cluster -------------------------------------------------------------------------------


@pytest.mark.thorough
def test_a_cluster_does_batches_and_checks_as_this_machine_does(
    run, apart, baselines_folder, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    boxed = SCENE.replace("</film>", '<rfilter type="box"/></film>')
    for name, scene in (("a", boxed), ("b", "<scene/>")):
        (tmp_path / f"{name}.xml").write_text(scene)
    change(baselines_folder / "fig-8-6b.exr")
    with dask_cluster.running() as address:
        for out, words in (("here", ()), ("there", ("--scheduler", address))):
            code, _, messages = run("compare", "a.xml", "b.xml", "-o", out, "--spp", 4, *words)
            assert (code, "b.xml" in messages) == (2, True)
        assert results(tmp_path / "here") == results(tmp_path / "there")
        words = ("check", baselines_folder, "-o", tmp_path / "out", "--scheduler", address)
        code, printed, messages = run(*words)
        assert (code, "1 of 2 moved" in printed) == (1, True)
        assert all(line.startswith("baselines: ") for line in messages.splitlines())
        # Tasks of one name are apart, whoever asks.
        with cluster.connected(address) as one, cluster.connected(address) as other:
            first = one.each([Task("sum", divmod, (7, 2)), Task("sum", divmod, (9, 2))])
            found = {next(first)[1].result()}
            assert other.do(Task("sum", divmod, (50, 7))) == (7, 1)
            assert found | {next(first)[1].result()} == {(3, 1), (4, 1)}


def test_a_cluster_that_is_not_there_is_one_message(run, scene_file, tmp_path, monkeypatch):
    words = ("compare", scene_file, "-o", tmp_path / "out", "--scheduler", "tcp://127.0.0.1:9")
    code, _, messages = run(*words, "--workers", 2)
    assert (code, "exclude each other" in messages) == (2, True)
    monkeypatch.setattr(cluster, "TIMEOUT", 0.5)
    code, _, messages = run(*words)
    assert (code, "no Dask scheduler answers" in messages) == (2, True)
    monkeypatch.setitem(sys.modules, "distributed", None)
    code, _, messages = run(*words)
    assert (code, messages.endswith("-m pip install dask distributed\n")) == (2, True)
