"""What Windows lacks is not needed to import the package, or to compare a scene in one process."""

import subprocess
import sys

from tests.shared.programs import ROOT

WITHOUT = """
import os, signal, sys
import multiprocessing.resource_tracker, multiprocessing.popen_spawn_posix, random, threading
import filelock  # which has locks of its own on Windows

for module in ("fcntl", "resource", "termios", "pwd", "grp"):
    sys.modules[module] = None
for name in ("killpg", "setpgid", "getpgid", "register_at_fork", "fork", "sched_getaffinity"):
    delattr(os, name)
for name in ("SIGALRM", "SIGKILL", "setitimer", "ITIMER_REAL", "pthread_sigmask"):
    delattr(signal, name)
members = {name: value for name, value in signal.Signals.__members__.items()
           if name in ("SIGINT", "SIGTERM", "SIGABRT")}
signal.Signals = type("Signals", (), {"__members__": members, "__class_getitem__": members.get})
"""

IMPORT = """
import pkgutil
from importlib import import_module

import fotismos
rooms = [__import__(f"fotismos.{room}", fromlist=["x"]) for room in
         ("heuristic", "reference", "comparisons", "reports")]
names = [name for room in rooms for _, name, _ in
         pkgutil.walk_packages(room.__path__, f"{room.__name__}.") if not name.endswith("__main__")]
optional = ("moderngl", "dask", "distributed")
for name in names:
    try:
        import_module(name)
    except ImportError as error:
        if error.name not in optional:
            raise
print(len(names))
"""

COMPARE = """
from fotismos.reports.__main__ import main
sys.argv = ["fotismos", "compare", "fig-8-9", "--resolution", "16x16", "--spp", "4",
            "--workers", "0", "-o", sys.argv[1]]
main()
"""


def program(*parts, folder):
    text = "\n".join((WITHOUT, *parts))
    return subprocess.run(
        [sys.executable, "-P", "-c", text, str(folder)],
        capture_output=True,
        text=True,
        cwd=ROOT,
        timeout=300,
    )


def test_every_module_can_be_imported_without_what_windows_lacks(tmp_path):
    done = program(IMPORT, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 150


def test_a_scene_is_compared_in_one_process(tmp_path):
    done = program(COMPARE, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "fig-8-9/comparison.json").exists()
