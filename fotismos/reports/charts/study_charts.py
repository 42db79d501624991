"""The figures of a study: charts, and contact sheets of its pictures.

For the keys of charts see :mod:`fotismos.comparisons.study.design`. Points that differ in other
parameters are averaged, and the subtitle says over which. Colours are viridis and magma, whose
lightness rises steadily: they also work in grey.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import altair as alt
import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from fotismos.comparisons.study import dataset
from fotismos.comparisons.study.dataset import Row
from fotismos.comparisons.study.design import StudyFigure, StudyFile, StudyPart
from fotismos.comparisons.study.sheet import Pictures, Sheet
from fotismos.reports.charts.figures import FONT_SIZE, drawn
from fotismos.reports.charts.vega import FAINT, Spec, specification

if TYPE_CHECKING:
    import pyarrow as pa  # loaded late: it is an extra

Cell: TypeAlias = dict[str, Any]
"""A mark of a chart: ``x``, perhaps ``y``, and ``value``."""

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
WORDS = ("#fde725", "#5ec962", "#5aa0c8", "#c9b6e4")
"""Colours for words, light enough for the word's first letter, which each cell shows too."""

DASHES = ([1, 0], [6, 3], [2, 2], [8, 2, 2, 2])
"""Dashes of lines of several columns."""

CELL = 1.1
"""Inches of a cell's width: both halves."""

DOTS_PER_INCH = 150


def all_figures(study: StudyFile) -> Iterator[StudyFigure]:
    """Yield a study's figures; a part without one gets the error over its parameters."""
    yield from study.figures
    shown = {figure.part for figure in study.figures}
    for part in study.parts:
        if part.name not in shown and (names := part.varying):
            is_map = len(names) > 1
            yield StudyFigure(
                name=part.name,
                title=part.name,
                part=part.name,
                kind="map" if is_map else "lines",
                x=names[-1],
                y=names[0] if is_map else None,
                values=("dE2000",),
            )


def chart(figure: StudyFigure, table: pa.Table, study: StudyFile) -> Spec:
    """Return the Vega-Lite specification of a figure.

    ``InputError`` if a column does not exist, or no point is to be shown.
    """
    for column in figure.values:
        dataset.require(table, column)
    part = next(part for part in study.parts if part.name == figure.part)
    data = dataset.rows(table, figure.part, figure.where)
    shown = {figure.x, figure.y, figure.series, *figure.where}
    over = [name for name in part.varying if name not in shown]
    title = {"text": figure.title}
    if over and part.design == "grid":
        title["subtitle"] = f"mean over {', '.join(map(label, over))}"
    make = {"map": _map, "lines": _lines}[figure.kind]
    spec = specification(make(figure, table, part, data))
    return spec | {"title": title, "description": figure.title, "padding": 8}


def _scaled(axis: Any, is_log: bool) -> Any:
    return axis.scale(type="log" if is_log else "linear", nice=not is_log)


def _map(
    figure: StudyFigure, table: pa.Table, part: StudyPart, data: Sequence[Row]
) -> alt.TopLevelMixin:
    (column,) = figure.values
    names = (figure.x, str(figure.y))
    is_grid = part.design == "grid"
    is_word = isinstance(data[0][column], str)
    if is_grid:
        cells = _mean(data, names, column)
    else:
        cells = [{"x": row[names[0]], "y": row[names[1]], "value": row[column]} for row in data]
    if is_word:
        cells = [cell | {"letter": cell["value"][0].upper()} for cell in cells]
        categories = sorted({cell["value"] for cell in cells})
        scale = alt.Scale(domain=categories, range=WORDS[: len(categories)])
        colour = alt.Color("value:N", title=column, scale=scale)
    else:
        scale = alt.Scale(scheme="magma" if column.startswith("dE") else "viridis")
        # A title as a list has a line for each word, which keeps the legend narrow.
        colour = alt.Color("value:Q", title=label(column).split(" "), scale=scale)
    x = _axis(alt.X, table, names[0])
    y = _axis(alt.Y, table, names[1])
    if is_grid:
        x = x.type("ordinal").sort("ascending").axis(labelOverlap="greedy", labelAngle=0)
        y = y.type("ordinal").sort("descending").axis(labelOverlap="greedy")
    else:
        logs = [part.levels[name].is_log for name in names]
        x = _scaled(x, logs[0])
        y = _scaled(y, logs[1])
    chart = alt.Chart(alt.Data(values=cells)).encode(x=x, y=y)
    marks = chart.mark_rect() if is_grid else chart.mark_circle(size=60, opacity=1)
    layers = [marks.encode(color=colour)]
    if is_word and is_grid:
        layers.append(chart.mark_text(color="black").encode(text="letter:N"))
    return alt.layer(*layers).properties(width=420, height=300)


def _lines(
    figure: StudyFigure, table: pa.Table, part: StudyPart, data: Sequence[Row]
) -> alt.TopLevelMixin:
    columns = figure.values
    series = figure.series
    keys = (figure.x, series) if series else (figure.x,)
    values = [
        {**cell, "quantity": label(column)}
        for column in columns
        for cell in _mean(data, keys, column)
    ]
    # Of several columns, the words that their names share, such as `albedo` of both halves.
    parts_of_names = [column.split("_") for column in columns]
    shared = [word for word in parts_of_names[0] if all(word in other for other in parts_of_names)]
    named = label(columns[0]) if len(columns) == 1 else " ".join(shared) or "value"
    scales: list[Spec] = [
        {"type": "log"} if axis in figure.log else {"zero": axis == "y"} for axis in "xy"
    ]
    y = alt.Y("value:Q", title=_with_unit(named, table, columns[0])).scale(**scales[1])
    x = _axis(alt.X, table, figure.x).scale(nice=False, **scales[0])
    chart = alt.Chart().mark_line(strokeWidth=2).encode(x=x, y=y)
    if series:
        # Viridis without its light end, which is invisible on white.
        inks = alt.Scale(scheme=alt.SchemeParams("viridis", extent=[0, 0.8]))
        title = _with_unit(label(series), table, series)
        chart = chart.encode(color=alt.Color("y:O", title=title, scale=inks))
    if len(columns) > 1:
        dash = alt.StrokeDash("quantity:N", title=None, sort=[label(name) for name in columns])
        dash = dash.scale(range=DASHES[: len(columns)]).legend(labelLimit=300, symbolSize=400)
        chart = chart.encode(strokeDash=dash)
    layers = [chart]
    if figure.rule is not None:
        # One row of its own, or Vega-Lite would draw the rule once for each point.
        rule = alt.Chart(alt.Data(values=[{}])).mark_rule(strokeDash=[3, 3], color=FAINT)
        layers.append(rule.encode(y=alt.datum(figure.rule)))
    return alt.layer(*layers, data=alt.Data(values=values)).properties(width=460, height=300)


def _mean(data: Sequence[Row], keys: Sequence[str], column: str) -> list[Cell]:
    """Return a column's mean for each combination of keys; of words, the most frequent."""
    groups: dict[tuple[Any, ...], list[Any]] = defaultdict(list)
    for row in data:
        if row[column] is not None:
            groups[tuple(row[key] for key in keys)].append(row[column])
    cells = []
    for key, group in sorted(groups.items()):
        is_word = isinstance(group[0], str)
        value = max(sorted(set(group)), key=group.count) if is_word else sum(group) / len(group)
        cells.append(dict(zip(("x", "y"), key, strict=False)) | {"value": value})
    return cells


def _axis(channel: Any, table: pa.Table, name: str) -> Any:
    field = {alt.X: "x", alt.Y: "y"}[channel]
    title = _with_unit(label(name), table, name)
    return channel(f"{field}:Q", title=title).axis(format=".3~g", tickCount=8, labelFlush=False)


def _with_unit(name: str, table: pa.Table, column: str) -> str:
    unit = dataset.unit(table, column)
    return f"{name} ({unit})" if unit not in ("", "1") else name


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
