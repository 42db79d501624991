"""The action for GitHub: its steps, run by bash with a program in place of fotismos."""

import os
import subprocess

import pytest
import yaml

from fotismos.reports.cli import cli
from tests.shared.programs import ROOT

ACTION = yaml.safe_load((ROOT / "action.yml").read_text(encoding="utf-8"))
STEPS = [step["run"] for step in ACTION["runs"]["steps"] if "run" in step]

STUB = """#!/usr/bin/env bash
printf '%s\\n' "$@" "PYTHON=${PYTHON:-}"
exit 3
"""


@pytest.fixture
def run_step(tmp_path):
    """Return a function that runs a step in a folder with three scenes."""
    copy = tmp_path / "copy"
    copy.mkdir()
    (copy / "requirements.txt").write_text("x")
    (copy / "run").write_text(STUB)
    (copy / "run").chmod(0o755)
    for name in ("a.xml", "b.xml", "c.py"):
        (tmp_path / name).write_text("")

    def run(step, **variables):
        given = {key.upper(): entry.get("default", "") for key, entry in ACTION["inputs"].items()}
        given["PYTHON_WANTED"] = given.pop("PYTHON")
        outputs = tmp_path / "outputs"
        places = {"GITHUB_ACTION_PATH": str(copy), "GITHUB_OUTPUT": str(outputs)}
        done = subprocess.run(
            ["bash", "-eo", "pipefail", "-c", step],
            cwd=tmp_path,
            env={"PATH": os.environ["PATH"]} | places | given | variables,
            capture_output=True,
            text=True,
        )
        return done.returncode, done.stdout.splitlines(), done.stderr

    return run


def test_arguments_become_words_and_nothing_in_them_is_executed(run_step, tmp_path):
    words = "*.xml --max-visible 5% --picture hall=new_*.exr $(touch evil) ;touch evil"
    code, said, _ = run_step(STEPS[1], COMMAND="compare", ARGUMENTS=words, PYTHON_WANTED="python9")
    assert code == 3
    assert said == [
        "compare", "a.xml", "b.xml", "--max-visible", "5%", "--picture", "hall=new_*.exr",
        "$(touch", "evil)", ";touch", "evil", "-o", "out", "PYTHON=python9",
    ]  # fmt: skip
    assert not (tmp_path / "evil").exists()
    code, said, message = run_step(STEPS[1], COMMAND="doctor; id", ARGUMENTS="x")
    assert (code, said) == (2, [])
    assert "give check or compare" in message


def test_its_defaults_are_those_of_the_commands(run_step, tmp_path):
    code, said, _ = run_step(STEPS[1], ARGUMENTS="baselines")
    assert (code, said) == (3, ["check", "baselines", "-o", "out", "PYTHON="])
    for name in ("check", "compare"):
        params = cli.get_command(None, name).params
        assert "-o" in {word for option in params for word in option.opts}
    assert run_step(STEPS[0])[0] == 0
    venv, key = (tmp_path / "outputs").read_text().splitlines()
    assert venv == f"venv={tmp_path / 'copy'}/.venv"
    assert key.startswith("key=")
    assert len(key) == 20


def test_it_names_no_registry_and_only_actions_of_github():
    text = (ROOT / "action.yml").read_text(encoding="utf-8")
    assert "://" not in text
    uses = [step["uses"] for step in ACTION["runs"]["steps"] if "uses" in step]
    assert all(name.startswith("actions/") for name in uses)
    assert ACTION["runs"]["steps"][-1]["if"] == "failure()"
