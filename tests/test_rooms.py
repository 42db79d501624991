"""How the rooms are kept: names and sizes. Which room may import which, import-linter checks."""

import ast
from pathlib import Path

ROOT = Path(__file__).parents[1]
ROOMS = ["heuristic", "reference", "comparisons", "reports"]


def modules():
    return [path for room in ROOMS for path in sorted((ROOT / room).rglob("*.py"))]


def test_no_module_name_stands_for_two():
    """Commands aside, which are called as what they do."""
    names = [path.stem for path in modules() if path.parent.name != "commands"]
    names = [name for name in names if not name.startswith("__")]
    assert len(names) > 150
    assert sorted({name for name in names if names.count(name) > 1}) == []


def test_no_import_of_our_own_renames():
    renamed = [
        f"{path.relative_to(ROOT)}: {alias.asname}"
        for path in modules()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, (ast.Import, ast.ImportFrom))
        for alias in node.names
        if alias.asname and (getattr(node, "module", None) or alias.name).split(".")[0] in ROOMS
    ]
    assert renamed == []


def test_a_folder_holds_about_a_dozen_modules():
    folders = [path.parent for path in modules() if path.relative_to(ROOT).parts[0] != "heuristic"]
    largest = max(set(folders), key=folders.count)
    assert folders.count(largest) <= 14, largest
