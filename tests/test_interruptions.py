"""Ctrl-C and SIGTERM at random moments: nothing torn, no orphan, the same results afterwards."""

import os
import signal
import subprocess
import sys

import pytest

from tests.interruptions import COMMANDS, ROOT, trials

SHOWN = 50
"""Random moments of each command in the slow form."""


MODULE = """
import time
print("begun", flush=True)
time.sleep(0.5)
print("loaded", flush=True)
"""
PROGRAM = """
import sys, time
from comparisons.processes import interruption
interruption.listen()
try:
    import module
    time.sleep(60)
except KeyboardInterrupt as error:
    sys.exit(interruption.code_of(error))
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_waits_until_a_module_is_loaded(number, tmp_path):
    """Native modules that are just loaded crash of it, or swallow it."""
    (tmp_path / "module.py").write_text(MODULE)
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


@pytest.mark.parametrize("name", ["compare without causes", "study"])
def test_an_interrupted_command_leaves_nothing_broken(name):
    assert [trial for trial in trials(name, 2) if trial.faults] == []


@pytest.mark.guarantee(
    "runs",
    "Ctrl-C and SIGTERM at any moment leave no torn file and no orphan; the same command then"
    " gives the results of an undisturbed run.",
)
@pytest.mark.slow
@pytest.mark.parametrize("name", sorted({*COMMANDS} - {"compare without causes"}))
def test_fifty_interruptions_of_each_command_leave_nothing_broken(name):
    assert [trial for trial in trials(name, SHOWN, seed=1) if trial.faults] == []
