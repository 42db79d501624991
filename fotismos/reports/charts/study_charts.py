"""The figures of a study: charts, and contact sheets of its pictures.

A chart is a specification of Vega-Lite, to which the rows of its part, titles with units, and a
subtitle that says over what it averages are added.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import altair as alt
import numpy as np
from altair.utils.schemapi import SchemaValidationError
from matplotlib import rc_context
from matplotlib.figure import Figure

from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.study import dataset
from fotismos.comparisons.study.design import StudyFigure, StudyFile, StudyPart, stated
from fotismos.comparisons.study.sheet import Pictures, Sheet
from fotismos.heuristic.errors import InputError
from fotismos.reports.charts.figures import FONT_SIZE, drawn
from fotismos.reports.charts.vega import Spec

if TYPE_CHECKING:
    import pyarrow as pa  # loaded late: it is an extra

SYMBOLS = {
    "alpha": "α",
    "dE2000": "ΔE2000",
    "dE2000_shape": "ΔE2000 after the best exposure",
    "dE_ITP": "ΔE ITP",
    "int_ior": "index of refraction",
    "k_d": "k_d",
    "k_s": "k_s",
    "log2_luminance": "luminance ratio",
}

SIZE = {"width": 460, "height": 300}
"""Pixels of a chart that states none."""

CELL = 1.1
"""Inches of a cell's width: both halves."""

DOTS_PER_INCH = 150


def all_figures(study: StudyFile) -> Iterator[StudyFigure]:
    """Yield a study's figures; a part without one gets the error over its parameters.

    That is a map of two parameters, a circle for each point that was drawn, or a line over one.
    """
    yield from study.figures
    shown = {figure.part for figure in study.figures}
    for part in study.parts:
        if part.name not in shown and part.varying:
            yield StudyFigure(
                name=part.name, title=part.name, part=part.name, chart=_error_over(part)
            )


def _error_over(part: StudyPart) -> Spec:
    """Return the chart of the mean error over a part's parameters."""
    *others, across = part.varying
    error = {"field": LEADING.name, "aggregate": "mean", "type": "quantitative"}
    axes = {"x": across} | ({"y": others[0]} if others else {})
    is_grid = bool(others) and part.design == "grid"
    encoding: Spec = {
        axis: {
            "field": name,
            "type": "ordinal" if is_grid else "quantitative",
            "sort": "descending" if is_grid and axis == "y" else "ascending",
            "scale": {"type": "log"} if part.levels[name].is_log and not is_grid else {},
        }
        for axis, name in axes.items()
    }
    if not others:
        return {"mark": "line", "encoding": encoding | {"y": error}}
    colour = error | {"scale": {"scheme": "magma"}}
    if not is_grid:
        del colour["aggregate"]
    return {"mark": "rect" if is_grid else "circle", "encoding": encoding | {"color": colour}}


def check_charts(study: StudyFile) -> None:
    """Ensure that charts are in Vega-Lite; `InputError` says what is not."""
    for figure in study.figures:
        try:
            alt.TopLevelSpec(SIZE | figure.chart | {"data": {"values": []}}).to_dict()
        except SchemaValidationError as error:
            reason = " ".join(str(error).split())
            raise InputError(f"figure {figure.name!r}: chart: {reason}") from error


def chart(figure: StudyFigure, table: pa.Table, study: StudyFile) -> Spec:
    """Return the Vega-Lite specification of a figure, with its data.

    ``InputError`` if a column does not exist, or no point is to be shown.
    """
    part = next(part for part in study.parts if part.name == figure.part)
    data = dataset.rows(table, figure.part, figure.where)
    shown = {*stated(figure.chart, "field"), *figure.where}
    for column in stated(figure.chart, "field"):
        if column not in stated(figure.chart, "as"):
            dataset.require(table, column)
    over = [label(name) for name in part.varying if name not in shown]
    title: Spec = {"text": figure.title}
    if over and part.design == "grid":
        title["subtitle"] = f"mean over {', '.join(over)}"
    return {
        "$schema": alt.SCHEMA_URL,
        **SIZE,
        **_titled(figure.chart, table),
        "data": {"values": data},
        "title": title,
        "description": figure.title,
        "padding": 8,
    }


def _titled(content: Any, table: pa.Table, is_channel: bool = False) -> Any:
    """Return a part of a chart, in which each channel has the label and unit of its column."""
    if isinstance(content, list):
        return [_titled(item, table) for item in content]
    if not isinstance(content, dict):
        return content
    titles: Spec = {}
    if is_channel and content.get("field") in table.column_names:
        titles["title"] = with_unit(content["field"], table)
    inside = {
        key: {name: _titled(channel, table, is_channel=True) for name, channel in value.items()}
        if key == "encoding"
        else _titled(value, table)
        for key, value in content.items()
    }
    return titles | inside


def with_unit(column: str, table: pa.Table) -> str:
    """Return how charts call a column, with its unit if it has one."""
    unit = dataset.unit(table, column)
    return f"{label(column)} ({unit})" if unit not in ("", "1") else label(column)


def label(column: str) -> str:
    """Return how charts call a column."""
    return SYMBOLS.get(column, column.replace("_", " "))


# --- Contact sheets ----------------------------------------------------------------------------


def contact_sheet(part: StudyPart, sheet: Sheet, pictures: dict[int, Pictures]) -> bytes:
    """Return the WebP file of a sheet: both halves of scenes, side by side, over two parameters.

    ``pictures`` are by the numbers of points; some may be absent.
    """
    height, width = next(iter(pictures.values())).shape[1:3]
    gap = max(1, width // 16)
    rows, columns = sheet.points.shape
    step_down = height + gap
    step_across = 2 * width + 2 * gap
    whole = np.full((rows * step_down, columns * step_across, 3), 255, np.uint8)
    for (row, column), number in np.ndenumerate(sheet.points):
        if number in pictures:
            # Large values are on top, as in the maps.
            top = (rows - 1 - row) * step_down
            left = column * step_across
            whole[top : top + height, left : left + 2 * width] = np.hstack([*pictures[int(number)]])
    values = part.points()
    size = (columns * CELL + 0.8, rows * CELL * step_down / step_across + 0.9)
    with rc_context({"font.size": FONT_SIZE, "axes.titlesize": FONT_SIZE}):
        figure = Figure(figsize=size, layout="constrained")
        axes = figure.subplots()
        axes.imshow(whole, interpolation="nearest")
        ticks = [column * step_across + width for column in range(columns)]
        axes.set_xticks(ticks, [f"{values[n][sheet.across]:.3g}" for n in sheet.points[0]])
        axes.set_xlabel(label(sheet.across))
        axes.set_yticks([])
        if sheet.down:
            ticks = [(rows - 1 - row) * step_down + height / 2 for row in range(rows)]
            axes.set_yticks(ticks, [f"{values[n][sheet.down]:.3g}" for n in sheet.points[:, 0]])
            axes.set_ylabel(label(sheet.down))
        axes.tick_params(length=0)
        axes.spines[:].set_visible(False)
        axes.set_title(f"{part.name}: textbook (left) and physical (right)", loc="left")
        return drawn(figure, "webp", DOTS_PER_INCH)
