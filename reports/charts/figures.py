"""Figures for print, each as SVG and PDF: a strip of pictures, histograms, and a run's departures.

Maps have the fixed ranges of their metrics, and figures of a kind share an axis, so figures of
different scenes can be compared. Text is black on white. Pictures are kept pixel for pixel. The
files are reproducible: they hold no date.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import altair as alt
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from comparisons.comparison import Comparison, ComparisonRecord
from comparisons.cost.cost_record import Cost
from comparisons.departure.metrics import LEADING
from reports.charts import cost_charts, histograms, vega
from reports.charts.theme import Spec
from reports.files import images
from reports.run import results
from reports.terminal.words import number

FORMATS = ("svg", "pdf")

#: Inches: the width of the text on a page with usual margins.
TEXT_WIDTH = 6.9

#: Inches: between panels, for the colour bar with its labels, and for the titles.
GAP, BAR, HEADING = 0.08, 0.55, 0.22

#: Points, printed at that width.
FONT_SIZE = 8

#: Smaller departures are drawn at the left border, since a logarithmic axis has no 0.
LEAST, LARGEST = 1e-3, 100.0

#: Colour and shape of each quantity of a scene.
MARKS = {
    "as it is": ("#08519c", "circle"),
    "after exposure": ("#b3450b", "diamond"),
    "noise floor": ("#6b6b6b", "triangle-up"),
}


def write_scene(folder: Path, name: str, comparison: Comparison) -> None:
    """Write the strip and the histograms of a comparison as ``folder/name...`` in each format."""
    results.own(folder)
    figure = strip(comparison)
    for kind in FORMATS:
        results.write(folder / f"{name}.{kind}", drawn(figure, kind))
    for metric, spec in histograms.specs(comparison.record).items():
        write_chart(folder, f"{name}-histogram-{metric}", spec)


def write_run(folder: Path, records: Iterable[ComparisonRecord]) -> None:
    """Write the departures of a run's scenes as ``folder/departures`` in each format."""
    write_chart(folder, "departures", departures(list(records)))


def write_cost(folder: Path, name: str, record: Cost) -> None:
    """Write the chart of a study of cost as ``folder/name-cost`` in each format."""
    write_chart(folder, f"{name}-cost", cost_charts.titled(record))


def write_chart(folder: Path, name: str, spec: Mapping[str, Any]) -> None:
    """Write a Vega-Lite specification as ``folder/name`` in each format."""
    results.own(folder)
    for kind in FORMATS:
        results.write(folder / f"{name}.{kind}", vega.paper(spec, kind))


def strip(comparison: Comparison) -> Figure:
    """Return heuristic, reference and the map of the error with its colour bar, side by side."""
    shown, metric = comparison.images, LEADING
    exposure = comparison.record.viewing.exposure
    summary = comparison.record.metrics[metric.name]
    high = metric.map_range[1]
    heading = f"{metric.label}: mean {number(summary.mean)}"
    if summary.noise_floor:
        heading += f" (noise {number(summary.noise_floor)})"
    panels = {
        "heuristic": images.tonemap(shown.heuristic, exposure),
        "reference": images.tonemap(shown.reference, exposure),
        heading: images.error_map(shown.maps[metric.name], high),
    }
    height, width = shown.counted.shape
    side = (TEXT_WIDTH - 2 * GAP - BAR) / len(panels)
    tall = side * height / width
    with rc_context({"font.size": FONT_SIZE, "axes.titlesize": FONT_SIZE}):
        figure = Figure(figsize=(TEXT_WIDTH, tall + HEADING + GAP))
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


def departures(records: Sequence[ComparisonRecord]) -> Spec:
    """Return the chart of means by scene: as it is, after exposure, and the noise floor.

    The axis is logarithmic, always from 0.001 to 100; values beyond are drawn at its ends.
    """
    rows = []
    for record in records:
        metric = record.metrics[LEADING.name]
        values = {
            "as it is": metric.mean,
            "after exposure": metric.after_exposure.mean,
            "noise floor": metric.noise_floor,
        }
        rows += [
            {"scene": record.scene, "what": what, "value": min(max(value, LEAST), LARGEST)}
            for what, value in values.items()
        ]
    title = f"mean {LEADING.label} (0.001 and less at the left border)"
    colours, shapes = (
        alt.Scale(domain=list(MARKS), range=style) for style in zip(*MARKS.values(), strict=True)
    )
    chart = alt.Chart(alt.Data(values=rows), width=360, height=alt.Step(18))
    chart = chart.mark_point(size=60, strokeWidth=1.6, opacity=1).encode(
        x=alt.X("value:Q", title=title)
        .scale(type="log", domain=[LEAST, LARGEST], nice=False)
        .axis(values=[0.001, 0.01, 0.1, 1, 10, 100], format="~g"),
        y=alt.Y("scene:N", sort=None, title=None).axis(grid=True, labelLimit=260),
        color=alt.Color("what:N", scale=colours, title=None).legend(orient="top"),
        shape=alt.Shape("what:N", scale=shapes),
    )
    return vega.specification(chart)
