"""The list of guarantees, from the tests that show them.

A test, or a class or parametrised function of tests, states its guarantee::

    @pytest.mark.guarantee("marks", "Of images that differ by noise alone …")

Tests are parsed, not imported.
"""

import ast
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from docs.figures.documents import ROOT, replace, write_table

AREAS = {
    "kernel": "Kernel and plugins",
    "reference": "Reference",
    "pairing": "Pairing",
    "plans": "Plans",
    "marks": "Marks of significance",
    "means": "Means and floors",
    "attribution": "Attribution and parts",
    "checks": "Regression checks",
    "runs": "Runs and files",
}
"""Areas of guarantees in order, with their headings."""


@dataclass(frozen=True)
class Guarantee:
    """A sentence and the test that shows it; ``./run test`` omits slow ones."""

    area: str
    text: str
    path: str
    test: str
    is_slow: bool


def guarantees() -> list[Guarantee]:
    """Return the guarantees of all tests, sorted by area and file.

    Raises
    ------
    ValueError
        If an area is unknown, or a mark is not made of literals.
    """
    files = sorted((ROOT / "tests").rglob("test_*.py"))
    found = [each for path in files for each in _of_file(path)]
    places = list(AREAS)
    return sorted(found, key=lambda each: places.index(each.area))


def write() -> None:
    """Write the list as a table, and how many guarantees there are of each area."""
    found = guarantees()
    head = "area", "guarantee", "test", "file", "slow"
    rows = [
        (AREAS[each.area], each.text, each.test, each.path, "slow" if each.is_slow else "")
        for each in found
    ]
    write_table("guarantees", [head, *rows])
    counts = Counter(AREAS[each.area] for each in found)
    areas = ", ".join(f"{area[0].lower()}{area[1:]} ({count})" for area, count in counts.items())
    replace("guarantees.md", "guarantees", [f"{counts.total()} guarantees: {areas}."])


def lines() -> Iterator[str]:
    """Yield the list for the site, with links to the tests."""
    area = ""
    for each in guarantees():
        if each.area != area:
            area = each.area
            yield from ("", f"## {AREAS[area]}", "")
        slow = ", `-m slow`" if each.is_slow else ""
        yield f"- {each.text} ([{each.test}](../{each.path}){slow})"


def _of_file(path: Path) -> Iterator[Guarantee]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if not isinstance(node, ast.FunctionDef | ast.ClassDef):
            continue
        marks = {
            ast.unparse(mark.func if isinstance(mark, ast.Call) else mark): mark
            for mark in node.decorator_list
        }
        if "pytest.mark.guarantee" in marks:
            mark: Any = marks["pytest.mark.guarantee"]
            area, text = (ast.literal_eval(argument) for argument in mark.args)
            if area not in AREAS:
                raise ValueError(
                    f"{path.name}: area {area!r} is unknown; known: {', '.join(AREAS)}"
                )
            is_slow = "pytest.mark.slow" in marks
            where = path.relative_to(ROOT).as_posix()
            yield Guarantee(area, text, where, node.name, is_slow)
