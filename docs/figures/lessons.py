"""The numbers of docs/lessons.md: what both halves of built-in scenes have at pixels."""

from collections.abc import Iterator
from functools import cache
from typing import Any

import fotismos  # noqa: F401  isort: skip  it finds LLVM before Dr.Jit is imported

import numpy as np

from fotismos.comparisons.case import open_case
from fotismos.comparisons.compare import compare
from fotismos.comparisons.comparison import Images
from fotismos.comparisons.options import Options
from fotismos.reports.terminal.tables import markdown

SIDE, SAMPLES = 64, 1024

LESSONS: dict[str, tuple[tuple[str, int, int], ...]] = {
    "sky": (("fig-8-5a", 32, 32), ("fig-8-5a", 50, 32)),
    "distance": (("fig-8-6a", 15, 32), ("fig-8-6a", 42, 32), ("lambert-sphere", 42, 32)),
    "rim": (("fig-8-7a", 14, 32), ("fig-8-7a", 31, 32)),
    "shadow": (("fig-8-8a", 49, 32),),
    "sum": (("fig-8-8c", 32, 38),),
    "exponent": (("fig-8-8c", 32, 38), ("fig-8-9", 32, 38), ("fig-8-8c", 32, 50),
                 ("fig-8-9", 32, 50)),
    "half vector": (("fig-8-9", 45, 32), ("fig-8-9 --heuristic blinn", 45, 32)),
    "channels": (("fig-8-11-n9", 48, 32), ("fig-8-9", 48, 32)),
    "beam": (("fig-6-5-m1", 44, 32), ("fig-6-5-m40", 32, 32), ("fig-6-5-m40", 44, 32)),
    "edges": (("fig-6-10", 31, 32), ("fig-6-10", 32, 32),
              ("fig-6-10 --interpolation phong", 31, 32),
              ("fig-6-10 --interpolation phong", 32, 32)),
    "vertices": (("fig-6-14", 42, 37), ("fig-6-14 --interpolation phong", 42, 37)),
    "surfaces": (("cornell-box", 20, 6), ("cornell-box", 36, 50), ("cornell-box", 48, 58)),
}  # fmt: skip
"""Words of the command, column and row of the pixels of each lesson."""


@cache
def images(command: str) -> Images:
    """Compare as a command does whose words are a scene and options."""
    scene, *words = command.split(" --")
    given: dict[str, Any] = dict(word.split() for word in words)
    case = open_case(scene, Options(resolution=(SIDE, SIDE), spp=SAMPLES, **given))
    return compare(case.source, case.options).images


def values(lesson: str) -> np.ndarray:
    """Return the linear RGB of textbook and reference at each pixel, (pixels, 2, 3)."""
    found = [(images(command), column, row) for command, column, row in LESSONS[lesson]]
    return np.array([[half[row, column] for half in (one.heuristic, one.reference)]
                     for one, column, row in found])  # fmt: skip


def table(lesson: str) -> Iterator[str]:
    """Yield the table of a lesson."""
    rows = [
        (f"`{command}` at {column}, {row}", *map(_shown, halves))
        for (command, column, row), halves in zip(LESSONS[lesson], values(lesson), strict=True)
    ]
    yield from markdown([("Pixel", "Textbook", "Physical"), *rows], right=1)


def _shown(colour: np.ndarray) -> str:
    """Return a grey as one number, another colour as three."""
    shown = [f"{value:.3f}" for value in colour]
    return ", ".join(shown if len(set(shown)) > 1 else shown[:1])
