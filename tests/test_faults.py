"""Commands that meet faults of every kind: a message and an exit code, and nothing lost."""

import dataclasses
import os

import pytest

from tests.faults import __main__ as faults
from tests.faults import table, trial
from tests.faults.fault import Fault

SHORT = {
    "words": ("a scene with a typo", "--spp 'nan'", "an empty scene"),
    "bad scenes": (
        "radius = 'nan'", "a pipe included", "a mesh with an index beyond its points",
        "a camera that looks away",
    ),
    "scripts": ("os._exit(0)", "a null pointer", "a fork that sleeps", "KeyboardInterrupt"),
    "baselines": ("another mean", "in place of it: a pipe", "passes of -1"),
    "disk and names": (
        "another's page", "compare with files of 4 blocks at most",
        "standard output full, for a list", "--junit pipe",
    ),
    "kept results": ("view.json is garbage", ".fotismos that is a link to a file of others"),
    "signals": ("SIGTERM at out/.fotismos-lock", "SIGKILL to the worker"),
    "together": ("a folder that is held, for compare", "one scene at once"),
}  # fmt: skip
"""Names of the faults in every run of the tests, by kind."""

LEAST = 400


def without_causes(fault):
    """Nine tenths of a small comparison are its causes; the long form has them."""
    more = ("--no-why",) if "compare" in fault.words[:1] else ()
    shell = fault.shell.replace(" compare ", " compare --no-why ")
    return dataclasses.replace(fault, words=(*fault.words, *more), shell=shell)


def wrong(kind, chosen):
    return list(table.failures(faults.trials([(kind, fault) for fault in chosen])))


@pytest.mark.parametrize("kind", faults.KINDS)
def test_a_few_faults_of_each_kind(kind):
    known = {fault.name: fault for fault in faults.of_kind(kind)}
    assert wrong(kind, [without_causes(known[name]) for name in SHORT[kind]]) == []


@pytest.mark.guarantee(
    "runs",
    "Of more than 400 faults, each ends with a message and an exit code: no traceback, no hang, "
    "no silence, no orphan, and no file lost.",
)
@pytest.mark.slow
@pytest.mark.parametrize("kind", faults.KINDS)
def test_all_faults(kind):
    assert wrong(kind, faults.of_kind(kind)) == []


def test_there_are_as_many_faults_as_is_said():
    assert sum(len(faults.of_kind(kind)) for kind in faults.KINDS) > LEAST


BAD = {
    "a traceback": ('echo "Traceback (most recent call last)" >&2; exit 2', "has_traceback"),
    "a hang": ("exec sleep 1000", "hangs"),
    "a pass": ("exit 0", "is_silent"),
    "no message": ("exit 2", "is_silent"),
    "an orphan": ("setsid sleep 1000 >/dev/null 2>&1 & echo no such thing >&2; exit 2", "orphans"),
    "a file lost": ("rm mine.txt; echo no such thing >&2; exit 2", "lost"),
    "a file changed": ("echo x >>out/mine.txt; echo no such thing >&2; exit 2", "lost"),
}


@pytest.mark.parametrize("shell", BAD)
def test_what_goes_wrong_is_seen(shell, monkeypatch):
    monkeypatch.setattr(trial, "LIMIT_S", 2.0)
    script, field = BAD[shell]
    found = trial.run("words", Fault("it", (), "no such thing", shell=script))
    assert getattr(found, field)
    assert not found.is_good
    columns = list(table.lines([found]))[2].split(" | ")[3:]
    assert sum(int(count.strip(" |")) for count in columns) == 1
    assert next(table.failures([found])).startswith("- words: it: ")


def test_what_is_not_as_expected_is_seen():
    good = Fault("it", (), "no such thing", shell="echo no such thing >&2; exit 2")
    assert trial.run("words", good).is_good
    for other in ({"codes": (1,)}, {"message": "another"}, {"leaves": ("page",)}):
        found = trial.run("words", dataclasses.replace(good, **other))
        assert not found.is_expected
        assert not found.is_good
    half = f"touch out/.page.{trial.atomic.HOST}.{os.getpid()}.fotismos-partial; {good.shell}"
    assert trial.run("words", dataclasses.replace(good, shell=half)).notes
