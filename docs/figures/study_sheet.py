"""The picture of docs/studies.md: both halves of an example study at each point of its grid."""

import fotismos  # noqa: F401  isort: skip  it finds LLVM before Dr.Jit is imported

from matplotlib import rc_context
from matplotlib.figure import Figure

from docs.figures.from_tests import ROOT
from docs.figures.model_figures import GROUND, STYLE
from fotismos.comparisons.compare import compare
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.options import Options
from fotismos.comparisons.study import design, running
from fotismos.reports.files import images
from fotismos.reports.terminal.words import number, parameter

FILE = ROOT / "studies/lamp-and-roughness.toml"
SIDE, SAMPLES = 96, 256


def picture() -> Figure:
    """Render both halves at each point, and draw a row for each roughness."""
    (part,) = design.read(FILE).parts
    rows, columns = (part.levels[name].values for name in part.varying)
    options = Options(resolution=(SIDE, SIDE), spp=SAMPLES)
    with rc_context(STYLE | {"font.size": 9, "axes.titlesize": 9}):
        size = (0.8 + 2.05 * len(columns), 1.22 * len(rows) + 0.3)
        figure = Figure(figsize=size, facecolor=GROUND, layout="constrained")
        panels = figure.subplots(len(rows), 2 * len(columns))
        for place, values in enumerate(part.points()):
            row, column = divmod(place, len(columns))
            compared = compare(running.source_of(part, values), options)
            pair = panels[row, 2 * column : 2 * column + 2]
            halves = (compared.images.heuristic, compared.images.reference)
            for axes, half in zip(pair, halves, strict=True):
                axes.imshow(images.tonemap(half), interpolation="none")
                axes.set(xticks=[], yticks=[])
                axes.spines[:].set_visible(False)
            error = f"{LEADING.label} {number(compared.record.metrics[LEADING.name].mean)}"
            pair[1].text(3, SIDE - 5, error, color="white", fontsize=8)
            if row == 0:
                pair[0].set_title("textbook", loc="left")
                pair[1].set_title("physical", loc="left")
            if column == 0:
                pair[0].set_ylabel(f"alpha {parameter(rows[row])}")
            if row == len(rows) - 1:
                pair[0].set_xlabel(f"light_size {parameter(columns[column])}°", loc="left")
    return figure
