"""What makes the documents' parts: where they are written, and what they are measured with."""

import csv
import json
import os
import subprocess
import sys
from collections.abc import Iterable, Sequence
from io import BytesIO, StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from matplotlib.figure import Figure
from PIL import Image

from fotismos.comparisons import atomic
from fotismos.comparisons.case import open_case
from fotismos.comparisons.compare import compare
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.halves import Step
from fotismos.comparisons.options import Options
from fotismos.comparisons.records.images import Comparison, Images
from fotismos.reports.charts import figures
from fotismos.reports.files import images

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"

DENSITIES = {".svg": 300, ".png": 100, ".webp": 160}
"""Dots per inch of pictures; WebP is for screens of high density, and has a sixth of PNG's size."""


def replace(page: str, part: str, lines: Iterable[str]) -> None:
    """Replace the text between the marks of a part of a page."""
    path = DOCS / page
    begin = f"<!-- {part}: made by ./run docs -->"
    end = f"<!-- end of {part} -->"
    head, rest = path.read_text(encoding="utf-8").split(begin)
    _, tail = rest.split(end)
    atomic.write(path, "\n".join([head + begin, "", *lines, "", end + tail]))


def draw(name: str, figure: Figure) -> None:
    """Write a figure in the format that its name ends with: SVG, PNG or WebP."""
    path = DOCS / name
    density = DENSITIES[path.suffix]
    if path.suffix != ".webp":
        atomic.write(path, figures.drawn(figure, path.suffix[1:], density))
        return
    drawn = figures.drawn(figure, "png", density)
    atomic.write(path, images.webp(Image.open(BytesIO(drawn))))


def write_table(name: str, rows: Iterable[Sequence[object]]) -> None:
    """Write a table into docs/data; its first row has the names of its columns."""
    text = StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    atomic.write(DOCS / f"data/{name}.csv", text.getvalue())


def read_table(name: str) -> list[dict[str, str]]:
    """Return the rows of a table in docs/data by the names of its columns."""
    with (DOCS / f"data/{name}.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def compared(
    scene: Any, name: str | None = None, then: Sequence[Step] = (), **options: Any
) -> Comparison:
    """Compare a scene with the given options, as a command does."""
    case = open_case(scene, Options(**options), name=name)
    return compare(case.source, case.options, then=then)


def panels(shown: Images) -> list[Image.Image]:
    """Return the pictures of both halves, and the map of the error."""
    error = images.error_map(shown.maps[LEADING.name], LEADING.map_range[1])
    found = (images.tonemap(shown.heuristic), images.tonemap(shown.reference), error)
    return [picture.convert("RGB") for picture in found]


def run(*words: str) -> None:
    """Run a command of fotismos, which calls itself ``./run`` in what it writes."""
    shown_as = os.environ | {"FOTISMOS_PROGRAM": "./run"}
    command = (sys.executable, "-P", "-m", "fotismos.reports", *words)
    subprocess.run(command, cwd=ROOT, env=shown_as, check=True)


def fact(name: str, *words: object) -> Any:
    """Return one of the facts in ``tests/facts.py``, which only tests can measure.

    They run in a process of their own, and answer in JSON.
    """
    with TemporaryDirectory() as folder:
        file = Path(folder, "fact.json")
        command = [sys.executable, "-P", "-m", "tests.facts", name, file, *words]
        subprocess.run([*map(str, command)], cwd=ROOT, check=True)
        return json.loads(file.read_bytes())
