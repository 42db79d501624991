"""Ctrl-C and SIGTERM at random moments: nothing torn, no orphan, the same results afterwards."""

import pytest

from tests.interruptions import COMMANDS, trials

SHOWN = 50
"""Random moments of each command in the slow form."""


@pytest.mark.parametrize("name", ["compare", "study"])
def test_an_interrupted_command_leaves_nothing_broken(name):
    assert [trial for trial in trials(name, 2) if trial.faults] == []


@pytest.mark.guarantee(
    "runs",
    "Ctrl-C and SIGTERM at any moment leave no torn file and no orphan, and the same command then"
    " gives the results of an undisturbed one.",
)
@pytest.mark.slow
@pytest.mark.parametrize("name", COMMANDS)
def test_fifty_interruptions_of_each_command_leave_nothing_broken(name):
    assert [trial for trial in trials(name, SHOWN, seed=1) if trial.faults] == []
