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


def test_each_row_of_surprises_names_a_test_or_script_that_exists():
    page = (ROOT / "docs/surprises.md").read_text()
    rows = [line for line in page.splitlines() if line.startswith("| ")]
    cells = [row.strip("| ").split(" | ") for row in rows]
    held = [row[-1] for row in cells if row[-1] != "Held by"]
    assert {len(row) for row in cells} == {5}
    assert len(held) >= 40
    for cell in held:
        paths = re.findall(r"\]\(\.\./([^)]+)\)", cell)
        assert paths, cell
        tests = re.findall(r"\]\(\.\./(tests/[^)]+)\) `(\w+)`", cell)
        assert len(tests) == sum(path.startswith("tests/") for path in paths), cell
        assert all((ROOT / path).is_file() for path in paths), cell
        assert all(f"def {name}(" in (ROOT / path).read_text() for path, name in tests), cell
    named = {path for cell in held for path in re.findall(r"findings/[\w-]+\.sh", cell)}
    assert named == {f"findings/{script.name}" for script in SCRIPTS}
