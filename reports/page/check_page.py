"""The page of a check that failed: before, after, what moved, where, on which object, and why."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from comparisons.check.measurement import HALVES
from comparisons.check.moved import Move
from comparisons.departure.metrics import LEADING, METRICS, RATIO
from heuristic import program
from reports.ci import lines
from reports.ci.check_pictures import LARGEST_ERROR
from reports.ci.checks import Result
from reports.files import ownership
from reports.page import templates
from reports.run.places import PAGE
from reports.terminal.printing import percent

SHOWN = 12
"""Greatest number of rows in a scene's tables of quantities and of objects."""

TITLES = {"heuristic": "Textbook half", "reference": "Reference"}

KINDS = {
    "-before": "Before",
    "": "Now",
    "-error": f"{LEADING.label}, from 0 (black) to {LARGEST_ERROR:g} or more (light)",
    "-change": "Change of luminance, by block",
    "-p": "Chance of this if nothing changed, by block",
}
"""Captions of a half's pictures, by the endings of their names."""


def render(results: Sequence[Result], level: float) -> str:
    """Return the page of all results of a check, with failures in full.

    Parameters
    ----------
    results
        From :mod:`reports.ci.checks`; the pictures of a failure are read from its folder.
    level
        Significance of the whole command.
    """
    environment = templates()
    environment.filters["percent"] = percent
    failed = [result for result in results if result.status == "failed"]
    return environment.get_template("check.html.j2").render(
        verdict=lines.verdict(results, level),
        results=results,
        failed=[_failure(result) for result in failed],
    )


def write(folder: Path, results: Sequence[Result], level: float) -> Path | None:
    """Write the page to a folder and return its path; None if nothing moved."""
    if not any(result.status == "failed" for result in results):
        ownership.clear(folder, (PAGE,))
        return None
    ownership.write(ownership.folder(folder) / PAGE, render(results, level))
    return folder / PAGE


def _failure(result: Result) -> dict[str, Any]:
    """Return the template's data of one baseline."""
    check, folder = result.check, result.folder
    assert check is not None  # a failure has both
    assert folder is not None
    moved = {move.half for move in check.moved}
    objects = result.objects or {}
    halves = [_half(half, folder, half in moved, objects.get(half, {})) for half in HALVES]
    sides = check.before, check.after
    before, after = (measured.metrics[LEADING.name].value for measured in sides)
    return {
        "result": result,
        "before": f"{before:.3f}",
        "after": f"{after:.3f}",
        "versions": lines.versions_line(result),
        "halves": [half for half in halves if half["moved"]] or halves,
        "moved": [_cells(move) for move in check.moved[:SHOWN]],
        "accepting": program.command("check", result.path, "--update"),
    }


def _cells(move: Move) -> tuple[str, ...]:
    """Return the cells of a row, metrics by their labels."""
    name, *numbers = lines.moved_cells(move)
    labels = {metric.name: metric.label for metric in METRICS.values()} | {RATIO.name: RATIO.label}
    return labels.get(name, name), *(number.replace("-", "−") for number in numbers)


def _half(half: str, folder: Path, moved: bool, objects: dict[str, float]) -> dict[str, Any]:
    paths = {kind: folder / f"{half}{kind}.png" for kind in KINDS}
    return {
        "title": TITLES[half],
        "moved": moved,
        "pictures": [(KINDS[kind], _uri(path)) for kind, path in paths.items() if path.is_file()],
        "has_before": paths["-before"].is_file(),
        "objects": list(objects.items())[:SHOWN],
    }


def _uri(path: Path) -> str:
    return "data:image/png;base64," + base64.b64encode(path.read_bytes()).decode("ascii")
