"""What Windows lacks, and extras, are not needed to import the package or to compare a scene."""

import sys

import pytest

from tests.shared.programs import ROOT, python

PROGRAM = """
import os, pkgutil, signal, sys
import multiprocessing.resource_tracker, multiprocessing.popen_spawn_posix, random, threading
import filelock  # which has locks of its own on Windows
from importlib import import_module

for module in ("fcntl", "resource", "termios", "pwd", "grp"):
    sys.modules[module] = None
for name in ("killpg", "setpgid", "getpgid", "register_at_fork", "fork", "sched_getaffinity"):
    delattr(os, name)
for name in ("SIGALRM", "SIGKILL", "setitimer", "ITIMER_REAL", "pthread_sigmask"):
    delattr(signal, name)
members = {name: value for name, value in signal.Signals.__members__.items()
           if name in ("SIGINT", "SIGTERM", "SIGABRT")}
signal.Signals = type("Signals", (), {"__members__": members, "__class_getitem__": members.get})

class Hook:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ("pyarrow", "moderngl", "dask", "distributed", "nbformat"):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Hook())

import fotismos
names = []
for room in ("heuristic", "reference", "comparisons", "reports"):
    package = import_module(f"fotismos.{room}")
    names += [one.name for one in pkgutil.walk_packages(package.__path__, f"{package.__name__}.")]
for name in names:
    if not name.endswith("__main__"):
        import_module(name)
print(len(names))

from fotismos.reports.__main__ import main
sys.argv = ["fotismos", *sys.argv[1:]]
main()
"""


@pytest.mark.thorough
def test_every_module_is_imported_and_a_scene_compared(tmp_path):
    words = ("fig-8-9", "--resolution", "16x16", "--spp", 4, "--workers", 0, "--figures")
    done = python("-c", PROGRAM, "compare", *words, "-o", tmp_path)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout.splitlines()[0]) > 150
    assert (tmp_path / "fig-8-9/comparison.json").exists()


def test_a_study_without_its_extra_names_what_to_install(run, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    study = ROOT / "studies/phong-roughplastic.toml"
    code, _, messages = run("study", study, "-o", tmp_path)
    assert (code, "pip install pyarrow" in messages) == (2, True)
    assert not list(tmp_path.iterdir())
