"""Imports point one way: heuristic ← reference ← comparisons ← reports."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ROOMS = ["heuristic", "reference", "comparisons", "reports"]


def imported(path):
    """Return the top-level names that a module imports, at any depth of its code."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names.add(path.relative_to(ROOT).parts[0] if node.level else node.module.split(".")[0])
    return names


def modules():
    return [path for room in ROOMS for path in sorted((ROOT / room).rglob("*.py"))]


@pytest.mark.parametrize("path", modules(), ids=lambda path: str(path.relative_to(ROOT)))
def test_a_room_imports_only_itself_and_those_before_it(path):
    room = path.relative_to(ROOT).parts[0]
    later = {*ROOMS[ROOMS.index(room) + 1 :], "tests"}
    assert not imported(path) & later


def test_every_room_is_looked_at():
    assert {path.relative_to(ROOT).parts[0] for path in modules()} == set(ROOMS)


def test_an_import_inside_a_function_counts(tmp_path, monkeypatch):
    monkeypatch.setattr("tests.test_rooms.ROOT", tmp_path)
    module = tmp_path / "heuristic.py"
    module.write_text("def late():\n    from reports import page\n    import tests.oracle\n")
    assert imported(module) == {"reports", "tests"}


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
