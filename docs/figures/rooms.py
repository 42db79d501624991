"""The way of one scene through the rooms, for docs/architecture.md.

A room is a folder of modules. Calls are traced while ``fotismos compare`` runs, so the picture
shows the actual code.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout, suppress
from inspect import CO_OPTIMIZED
from io import BytesIO, TextIOWrapper
from pathlib import Path
from tempfile import TemporaryDirectory
from textwrap import fill
from types import FrameType

from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from docs.figures.from_tests import ROOT

FLOORS = ("heuristic", "reference", "comparisons", "reports")
SCENE = "fig-8-9"
FILLS = ("#e8eef7", "#e9f4ea", "#fdf3e1", "#f6e9f2")
"""Colours of the floors."""


@contextmanager
def watched() -> Iterator[list[str]]:
    """Collect the files of the functions called in the block, one entry per change of file."""
    files: list[str] = []

    def note(frame: FrameType, event: str, _: object) -> None:
        code = frame.f_code
        is_function = bool(code.co_flags & CO_OPTIMIZED)
        name = code.co_filename
        if event == "call" and is_function and name.startswith(str(ROOT)) and files[-1:] != [name]:
            files.append(name)

    sys.setprofile(note)
    try:
        yield files
    finally:
        sys.setprofile(None)


def way() -> list[str]:
    """Compare a small scene, and return the modules that it passes through, in order.

    The second of two comparisons is traced, because the first one runs imports.
    """
    from fotismos.comparisons.processes.pool import Pool
    from fotismos.reports import cli, jobs

    # Calls in other processes would not be seen.
    vars(jobs)["Pool"] = lambda count, *others: Pool(0, *others)
    words = ["fotismos", "compare", SCENE, "--resolution", "16x16", "-q", "--fresh", "-o"]
    with TemporaryDirectory() as folder, redirect_stdout(TextIOWrapper(BytesIO())):
        sys.argv = [*words, folder]
        with suppress(SystemExit):
            cli.main()
        with watched() as files, suppress(SystemExit):
            cli.main()
    paths = [Path(file).resolve().relative_to(ROOT) for file in files]
    return [str(path) for path in paths if path.parts[0] in FLOORS and path.suffix == ".py"]


def rooms(modules: list[str]) -> dict[str, list[str]]:
    """Return the modules of each room; both are in the order of entry."""
    found: dict[str, list[str]] = {}
    for module in modules:
        path = Path(module)
        inside = found.setdefault(str(path.parent), [])
        if path.stem not in inside and path.stem != "__init__":
            inside.append(path.stem)
    return {room: inside for room, inside in found.items() if inside}


def picture(found: dict[str, list[str]]) -> Figure:
    """Draw the rooms from top to bottom in order of entry, with one column per floor."""
    figure = Figure(figsize=(9, 0.5 + 0.5 * len(found)))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_xlim(-0.2, 4.05)
    axes.set_ylim(len(found) - 0.4, -1.1)
    axes.axis("off")
    for column, floor in enumerate(FLOORS):
        axes.text(column + 0.48, -0.8, floor, ha="center", va="center", weight="bold", size=11)
    for row, (room, modules) in enumerate(found.items()):
        parts = Path(room).parts
        column = FLOORS.index(parts[0])
        middle = column + 0.48
        axes.plot((-0.05, column), (row, row), color="0.85", linewidth=0.8, zorder=0)
        axes.text(-0.12, row, str(row + 1), ha="center", va="center", size=8, color="0.4")
        axes.add_patch(Rectangle((column, row - 0.42), 0.96, 0.84, facecolor=FILLS[column]))
        axes.text(middle, row - 0.22, "/".join(parts[1:]) or parts[0], ha="center", va="center",
                  size=8.5, weight="bold")  # fmt: skip
        text = fill(", ".join(modules), 48)
        axes.text(middle, row + 0.13, text, ha="center", va="center", size=5.5, linespacing=1.05)
    return figure
