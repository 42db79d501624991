"""The scripts of findings/: one summary, one reason, pinned packages, and their list."""

import ast
import re
import subprocess

import pytest

from findings import index
from tests.shared.programs import ROOT

SCRIPTS = sorted((ROOT / "findings").glob("*.sh"))


def test_the_list_has_the_first_line_of_each_script():
    assert (ROOT / "findings/README.md").read_text() == index.page()
    summaries = [index.summary(script) for script in SCRIPTS]
    assert len(set(summaries)) == len(SCRIPTS) >= 12


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_a_script_runs_pinned_packages_in_a_folder_of_its_own(script):
    text = script.read_text()
    head, _, rest = text.partition("set -euo pipefail\n")
    lines = head.splitlines()
    assert lines[1] == "#"
    assert len(lines) > 3
    assert all(line.startswith("#") for line in lines)
    assert "folder=$(mktemp -d)\ntrap 'rm -rf \"$folder\"' EXIT\n" in rest
    packages = re.search(r"pip\" install (.*?)(?<!\\)\n", rest, re.DOTALL)[1].split()
    named = [word for word in packages if word[0].isalpha()]
    assert named
    assert all("==" in word for word in named)
    program = rest.partition("<<'PYTHON'\n")[2].removesuffix("PYTHON\n")
    tree = ast.parse(program)
    assert any(isinstance(node, ast.Assert) for node in ast.walk(tree))
    assert "fotismos" not in program
    subprocess.run(["bash", "-n", script], check=True)
