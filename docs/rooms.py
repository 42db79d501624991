"""The way of one scene through the rooms, for docs/architecture.md.

A room is a folder of modules. Calls are watched while ``fotismos compare`` runs: the picture shows
the code as it is.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

from matplotlib.figure import Figure

ROOT = Path(__file__).resolve().parents[1]
FLOORS = ("heuristic", "reference", "comparisons", "reports")
SCENE = "fig-8-9"


@contextmanager
def watched() -> Iterator[list[str]]:
    """Collect the files whose functions are called in the block, one entry per change of file."""
    files: list[str] = []

    def note(frame, event, _):
        name = frame.f_code.co_filename
        if event == "call" and name.startswith(str(ROOT)) and (not files or files[-1] != name):
            files.append(name)

    sys.setprofile(note)
    try:
        yield files
    finally:
        sys.setprofile(None)


def way() -> list[str]:
    """Compare a scene in a small size, and return the modules that it passes through, in order."""
    from reports import cli

    arguments = ["compare", SCENE, "--resolution", "16x16", "-q"]
    with TemporaryDirectory() as folder:
        sys.argv = ["fotismos", *arguments, "-o", folder]
        with watched() as files, suppress(SystemExit):
            cli.main()
    paths = [Path(file).relative_to(ROOT) for file in files]
    return [str(path) for path in paths if path.parts[0] in FLOORS]


def rooms(modules: list[str]) -> dict[str, list[str]]:
    """Return the modules of each room, rooms and modules in the order in which they are entered."""
    found: dict[str, list[str]] = {}
    for module in modules:
        path = Path(module)
        inside = found.setdefault(str(path.parent), [])
        if path.stem not in inside and path.stem != "__init__":
            inside.append(path.stem)
    return {room: inside for room, inside in found.items() if inside}


def picture(found: dict[str, list[str]]) -> Figure:
    """Draw the rooms from top to bottom as they are entered, each floor a column."""
    height = 0.42
    figure = Figure(figsize=(9, 0.9 + height * len(found)))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_xlim(0, 4)
    axes.set_ylim(len(found) + 0.4, -1.2)
    axes.axis("off")
    for column, floor in enumerate(FLOORS):
        axes.text(column + 0.5, -0.8, floor, ha="center", weight="bold", size=10)
        if column:
            axes.axvline(column, color="0.85", linewidth=0.8)
    before = None
    for row, (room, modules) in enumerate(found.items()):
        column = FLOORS.index(Path(room).parts[0]) + 0.5
        name = "/".join(Path(room).parts[1:]) or "."
        axes.text(column, row, name, ha="center", va="center", size=9, weight="bold")
        axes.text(column, row + 0.36, ", ".join(modules), ha="center", va="center", size=4.5)
        if before is not None:
            arrow = {"arrowstyle": "->", "color": "0.6", "shrinkA": 9, "shrinkB": 9}
            axes.annotate("", (column, row), before, arrowprops=arrow)
        before = (column, row)
    return figure
