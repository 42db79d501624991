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


SCENES = ("a.xml", "b.xml", "c d.py")


@pytest.fixture
def run_step(tmp_path):
    """Return a function that runs a step in a folder with three scenes."""
    copy = tmp_path / "copy"
    copy.mkdir()
    (copy / "requirements.txt").write_text("x")
    (copy / "run").write_text(STUB)
    (copy / "run").chmod(0o755)
    for name in SCENES:
        (tmp_path / name).write_text("")

    def run(step, **variables):
        given = {
            key.upper().replace("-", "_"): entry.get("default", "")
            for key, entry in ACTION["inputs"].items()
        }
        given["PYTHON_WANTED"] = given.pop("PYTHON")
        outputs = tmp_path / "outputs"
        outputs.unlink(missing_ok=True)
        paths = {"GITHUB_ACTION_PATH": str(copy), "GITHUB_OUTPUT": str(outputs)}
        done = subprocess.run(
            ["bash", "-eo", "pipefail", "-c", step],
            cwd=tmp_path,
            env={"PATH": os.environ["PATH"]} | paths | given | variables,
            capture_output=True,
            text=True,
        )
        return done.returncode, done.stdout.splitlines(), done.stderr

    return run


INPUTS = [
    (
        {"BASELINE": "kept here", "PICTURES": "hall=new_*.exr\nyard=yard $(touch evil)*.exr"},
        ["check", "kept here", "--picture", "hall=new_*.exr", "--picture",
         "yard=yard $(touch evil)*.exr", "--junit", "out/shading-check.xml"],
        "out/shading-check",
    ),
    (
        {"SCENES": "*.xml\nc d.py\nno*.xml\n", "MAX_VISIBLE": "5%", "ARTIFACT": "mine"},
        ["compare", "a.xml", "b.xml", "c d.py", "no*.xml", "--max-visible", "5%",
         "--junit", "out/mine.xml"],
        "out/mine",
    ),
    (
        {"PICTURES": "image=mine*.exr\nreference=truth*.exr", "OUTPUT": "there"},
        ["compare", "--image", "mine*.exr", "--reference", "truth*.exr", "--junit", "there.xml"],
        "there",
    ),
]  # fmt: skip


@pytest.mark.parametrize(("inputs", "words", "folder"), INPUTS, ids=["check", "scenes", "pictures"])
def test_inputs_become_words_without_quoting(inputs, words, folder, run_step, tmp_path):
    code, said, _ = run_step(STEPS[1], **inputs)
    assert (code, said) == (3, [*words, "-o", folder, "PYTHON="])
    assert not (tmp_path / "evil").exists()
    assert f"output={folder}" in (tmp_path / "outputs").read_text().splitlines()


def test_arguments_become_words_and_nothing_in_them_is_executed(run_step, tmp_path):
    words = "*.xml --max-visible 5% --junit x.xml $(touch evil) ;touch evil"
    code, said, _ = run_step(STEPS[1], COMMAND="compare", ARGUMENTS=words, PYTHON_WANTED="python9")
    assert code == 3
    assert said == [
        "compare", "a.xml", "b.xml", "--max-visible", "5%", "--junit", "x.xml",
        "$(touch", "evil)", ";touch", "evil", "-o", "out/shading-compare", "PYTHON=python9",
    ]  # fmt: skip
    assert not (tmp_path / "evil").exists()


@pytest.mark.parametrize(
    ("inputs", "message"),
    [
        ({"COMMAND": "doctor; id", "ARGUMENTS": "x"}, "give check or compare"),
        ({"PICTURES": "hall=x.exr"}, "give image=PATTERN or reference=PATTERN"),
    ],
)
def test_other_commands_and_halves_are_refused(inputs, message, run_step):
    code, said, error = run_step(STEPS[1], **inputs)
    assert (code, said) == (2, [])
    assert message in error


def test_its_words_are_those_of_the_commands(run_step, tmp_path):
    for name, needed in {"check": {"--picture"}, "compare": {"--image", "--reference"}}.items():
        params = cli.get_command(None, name).params
        known = {word for option in params for word in option.opts}
        assert needed | {"-o", "--junit", "--max-visible"} <= known
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
    upload = ACTION["runs"]["steps"][-1]
    assert "cancelled()" in upload["if"], "the page of a failure is kept"
    assert upload["with"]["path"].split() == [
        "${{", "steps.run.outputs.output", "}}", "${{", "steps.run.outputs.output", "}}.xml",
    ]  # fmt: skip
