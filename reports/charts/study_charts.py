"""The figures of a study as charts.

A figure is a table of the study's TOML file::

    [[figure]]
    name = "departure"             # of the file
    title = "Departure over roughness and incidence"
    part = "lobe"
    kind = "map"                   # or "lines"
    x = "light_angle"
    y = "alpha"                    # maps
    values = ["dE2000"]            # one column for a map, one or more for lines
    series = "alpha"               # lines: one for each value of this parameter
    where = { int_ior = [1.5, 2] } # the points that are shown
    rule = 1.0                     # lines: a horizontal line
    log = ["x", "y"]               # lines: logarithmic axes

Points that differ in other parameters are averaged, and the subtitle says over which. Colours are
viridis and magma, whose lightness rises steadily: they also work in grey.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeAlias

import altair as alt
import numpy as np
import pyarrow as pa
from matplotlib import colormaps
from matplotlib.colors import to_hex

from comparisons.study import query
from comparisons.study.design import Part, Study
from heuristic.errors import InputError, unknown
from reports.charts.theme import FAINT, Spec
from reports.charts.vega import specification

KEYS = {"name", "title", "part", "kind", "x", "y", "values", "series", "where", "rule", "log"}
NEEDED = {"map": {"name", "title", "part", "x", "y", "values"},
          "lines": {"name", "title", "part", "x", "values"}}  # fmt: skip
Named: TypeAlias = Mapping[str, Any]
"""A figure of a TOML file, or a row of the dataset."""

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


def check(figure: Named, study: Study) -> None:
    """Ensure that a figure of a TOML file is complete, and that its part and parameters exist.

    Raises
    ------
    InputError
        Naming the missing or unknown keys.
    """
    where = f"figure {figure.get('name')!r}"
    kind = figure.get("kind")
    if kind not in NEEDED:
        raise unknown(f"{where}: kind =", kind, NEEDED)
    missing, surplus = NEEDED[kind] - set(figure), set(figure) - KEYS
    if missing or surplus:
        verb, names = ("lacks", missing) if missing else ("has", surplus)
        wrong = f"{verb} {', '.join(sorted(names))}"
        raise InputError(f"{where} {wrong}. It needs {', '.join(sorted(NEEDED[kind]))}.")
    parts = {part.name: part for part in study.parts}
    if figure["part"] not in parts:
        raise unknown(f"{where}: part =", figure["part"], parts)
    spans = parts[figure["part"]].spans
    for name in (figure["x"], figure.get("y"), figure.get("series"), *figure.get("where", ())):
        if name is not None and name not in spans:
            raise unknown(f"{where}: parameter", name, spans)


def default_figures(study: Study) -> Iterator[dict[str, Any]]:
    """Yield a figure for each part without one: the departure over its first parameters."""
    shown = {figure["part"] for figure in study.figures}
    for part in study.parts:
        names = part.varying
        if part.name in shown or not names:
            continue
        over = {"kind": "lines"} if len(names) == 1 else {"kind": "map", "y": names[0]}
        named = dict.fromkeys(("name", "title", "part"), part.name)
        figure: dict[str, Any] = {**named, "values": ["dE2000"]}
        yield figure | over | {"x": names[-1]}


def chart(figure: Named, table: pa.Table, study: Study) -> Spec:
    """Return the Vega-Lite specification of a figure.

    Raises
    ------
    InputError
        If a column does not exist, or no point is to be shown.
    """
    for column in figure["values"]:
        query.require(table, column)
    part = next(part for part in study.parts if part.name == figure["part"])
    data = query.rows(table, figure["part"], figure.get("where"))
    shown = {figure["x"], figure.get("y"), figure.get("series"), *figure.get("where", ())}
    over = [name for name in part.varying if name not in shown]
    make = {"map": _map, "lines": _lines}[figure["kind"]]
    title = {"text": figure["title"]}
    if over and part.design == "grid":
        title["subtitle"] = f"mean over {', '.join(map(_label, over))}"
    spec = specification(make(figure, table, part, data))
    return spec | {"title": title, "description": figure["title"], "padding": 8}


def _map(figure: Named, table: pa.Table, part: Part, data: Sequence[Named]) -> alt.TopLevelMixin:
    (column,) = figure["values"]
    names = figure["x"], figure["y"]
    is_grid, is_word = part.design == "grid", isinstance(data[0][column], str)
    if is_grid:
        cells = _mean(data, names, column)
    else:
        cells = [{"x": row[names[0]], "y": row[names[1]], "value": row[column]} for row in data]
    if is_word:
        cells = [cell | {"letter": cell["value"][0].upper()} for cell in cells]
        words = sorted({cell["value"] for cell in cells})
        scale = alt.Scale(domain=words, range=WORDS[: len(words)])
        colour = alt.Color("value:N", title=column, scale=scale)
    else:
        scale = alt.Scale(scheme="magma" if column.startswith("dE") else "viridis")
        colour = alt.Color("value:Q", title=_label(column).split(" "), scale=scale)
    chart = alt.Chart(alt.Data(values=cells)).encode(**_places(names, table, part))
    marks = chart.mark_rect() if is_grid else chart.mark_circle(size=60, opacity=1)
    layers = [marks.encode(color=colour)]
    if is_word and is_grid:
        layers.append(chart.mark_text().encode(text="letter:N"))
    return alt.layer(*layers).properties(width=420, height=300)


def _places(names: Sequence[str], table: pa.Table, part: Part) -> dict[str, Any]:
    """Return the axes of a map: steps of a grid's parameters, or spans of sampled ones."""
    x, y = _axis(alt.X, table, names[0]), _axis(alt.Y, table, names[1])
    if part.design == "grid":
        x = x.type("ordinal").sort("ascending").axis(labelOverlap="greedy", labelAngle=0)
        return {"x": x, "y": y.type("ordinal").sort("descending").axis(labelOverlap="greedy")}
    logarithmic = [getattr(part.spans[name], "logarithmic", False) for name in names]
    return {
        axis: place.scale(type="log" if is_log else "linear", nice=not is_log)
        for axis, place, is_log in zip("xy", (x, y), logarithmic, strict=True)
    }


def _lines(figure: Named, table: pa.Table, part: Part, data: Sequence[Named]) -> alt.TopLevelMixin:
    x, series, columns = figure["x"], figure.get("series"), figure["values"]
    keys = (x, series) if series else (x,)
    values = [
        cell | {"quantity": _label(column)}
        for column in columns
        for cell in _mean(data, keys, column)
    ]
    title = _label(columns[0]) if len(columns) == 1 else _common(columns)
    scales: list[Spec] = [
        {"type": "log"} if axis in figure.get("log", ()) else {"zero": axis == "y"} for axis in "xy"
    ]
    chart = (
        alt.Chart()
        .mark_line(strokeWidth=2)
        .encode(
            x=_axis(alt.X, table, x).scale(nice=False, **scales[0]),
            y=alt.Y("value:Q", title=_with(title, query.unit(table, columns[0]))).scale(
                **scales[1]
            ),
        )
    )
    if series:
        inks = alt.Scale(range=_inks(len({value["y"] for value in values})))
        chart = chart.encode(color=alt.Color("y:O", title=_title(table, series), scale=inks))
    if len(columns) > 1:
        dash = alt.StrokeDash("quantity:N", title=None, sort=[_label(name) for name in columns])
        dash = dash.scale(range=DASHES[: len(columns)]).legend(labelLimit=300, symbolSize=400)
        chart = chart.encode(strokeDash=dash)
    layers = [chart]
    if "rule" in figure:
        rule = alt.Chart(alt.Data(values=[{}])).mark_rule(strokeDash=[3, 3], color=FAINT)
        layers.append(rule.encode(y=alt.datum(figure["rule"])))
    return alt.layer(*layers, data=alt.Data(values=values)).properties(width=460, height=300)


def _mean(data: Sequence[Named], keys: Sequence[str], column: str) -> list[dict[str, Any]]:
    """Return a column's mean for each combination of keys; of words, the most frequent."""
    groups: dict[tuple[Any, ...], list[Any]] = defaultdict(list)
    for row in data:
        if row[column] is not None:
            groups[tuple(row[key] for key in keys)].append(row[column])
    cells = []
    for key, found in sorted(groups.items()):
        is_word = isinstance(found[0], str)
        value = max(sorted(set(found)), key=found.count) if is_word else sum(found) / len(found)
        cells.append(dict(zip(("x", "y"), key, strict=False)) | {"value": value})
    return cells


def _inks(count: int) -> list[str]:
    """Return colours along viridis without its light end, which is invisible on white."""
    return [to_hex(ink) for ink in colormaps["viridis"](np.linspace(0, 0.8, count))]


def _axis(channel: Any, table: pa.Table, name: str) -> Any:
    field = {alt.X: "x", alt.Y: "y"}[channel]
    return channel(f"{field}:Q", title=_title(table, name)).axis(format=".3~g")


def _title(table: pa.Table, column: str) -> str:
    return _with(_label(column), query.unit(table, column))


def _with(label: str, unit: str) -> str:
    return f"{label} ({unit})" if unit not in ("", "1") else label


def _label(column: str) -> str:
    return SYMBOLS.get(column, column.replace("_", " "))


def _common(columns: Sequence[str]) -> str:
    """Return the words common to several columns' names, such as ``albedo`` of both halves."""
    words = [column.split("_") for column in columns]
    shared = [word for word in words[0] if all(word in other for other in words)]
    return " ".join(shared) or "value"
