"""The strip of a comparison for print, as SVG and PDF.

The map has the fixed range of its metric, so that strips of different scenes can be compared.
Pictures are kept pixel for pixel. The files are reproducible: they hold no date.
"""

from io import BytesIO
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.records.images import Comparison
from fotismos.reports.files import images, results
from fotismos.reports.terminal.words import number
from fotismos.reports.verdict import judged, truth

FORMATS = ("svg", "pdf")

#: Inches: the width of the text on a page with usual margins.
TEXT_WIDTH = 6.9

#: Inches: between panels, for the colour bar with its labels, and for the titles.
GAP = 0.08
BAR = 0.55
HEADING = 0.22

#: Points, printed at that width.
FONT_SIZE = 8


def write_scene(folder: Path, name: str, comparison: Comparison) -> None:
    """Write the strip of a comparison as ``folder/name`` in each format."""
    results.own(folder)
    figure = strip(comparison)
    for kind in FORMATS:
        results.write(folder / f"{name}.{kind}", drawn(figure, kind))


def strip(comparison: Comparison) -> Figure:
    """Return both halves and the map of the error with its colour bar, side by side."""
    shown = comparison.images
    metric = LEADING
    exposure = comparison.record.viewing.exposure
    summary = comparison.record.metrics[metric.name]
    high = metric.map_range[1]
    heading = f"{metric.label}: mean {number(summary.mean)}"
    if summary.noise_floor:
        heading += f" (noise {number(summary.noise_floor)})"
    panels = {
        judged(comparison.record).name: images.tonemap(shown.heuristic, exposure),
        truth(comparison.record).name: images.tonemap(shown.reference, exposure),
        heading: images.error_map(shown.maps[metric.name], high),
    }
    height, width = shown.counted.shape
    side = (TEXT_WIDTH - 2 * GAP - BAR) / len(panels)
    tall = side * height / width
    with rc_context({"font.size": FONT_SIZE, "axes.titlesize": FONT_SIZE}):
        figure = Figure(figsize=(TEXT_WIDTH, tall + HEADING + GAP))
        # Matplotlib takes places as parts of the figure's sides.
        inches = (1 / TEXT_WIDTH, 1 / (tall + HEADING + GAP))

        def place(left: float, width: float) -> Axes:
            box = left * inches[0], GAP * inches[1], width * inches[0], tall * inches[1]
            return figure.add_axes(box)

        for column, (title, picture) in enumerate(panels.items()):
            axes = place(column * (side + GAP), side)
            axes.imshow(picture.convert("RGB"), interpolation="none", aspect="auto")
            axes.set_title(title, pad=4)
            axes.axis("off")
        legend(figure, place(TEXT_WIDTH - BAR + GAP, 0.1))
    return figure


def legend(figure: Figure, axes: Axes) -> None:
    """Draw the colour bar of the leading metric's map, with its range, into axes."""
    low, high = LEADING.map_range
    scale = ScalarMappable(Normalize(low, high), images.ERROR_COLOURS)
    bar = figure.colorbar(scale, cax=axes)
    bar.set_ticks((low, high / 2, high), labels=(f"{low:g}", f"{high / 2:g}", f"≥ {high:g}"))
    bar.outline.set_linewidth(0.5)
    bar.ax.tick_params(width=0.5, length=2)


def drawn(figure: Figure, kind: str, dots_per_inch: float = 300) -> bytes:
    """Return the file of a Matplotlib figure."""
    # Type 42 keeps text as text, as journals require; the salt makes the ids of an SVG repeatable.
    settings: Any = {"pdf.fonttype": 42, "svg.hashsalt": "fotismos"}
    undated = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
    buffer = BytesIO()
    with rc_context(settings):
        figure.savefig(buffer, format=kind, dpi=dots_per_inch, metadata=undated.get(kind))
    return buffer.getvalue()
