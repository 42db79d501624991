"""The figures of a study as Vega-Lite specifications: plain dictionaries, drawn by vl-convert.

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

Points that differ in other parameters still are averaged, and the subtitle says over which. Colours
are viridis and magma, whose lightness rises steadily, so that they survive without colour.
"""

from collections import defaultdict

from comparisons.study import query
from heuristic.errors import InputError, unknown

SCHEMA = "https://vega.github.io/schema/vega-lite/v5.json"
KEYS = {"name", "title", "part", "kind", "x", "y", "values", "series", "where", "rule", "log"}
NEEDED = {"map": {"name", "title", "part", "x", "y", "values"},
          "lines": {"name", "title", "part", "x", "values"}}  # fmt: skip
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
"""Colours for words, light enough for the letter of the word that stands in each cell besides."""

CONFIG = {
    "font": "sans-serif",
    "background": "white",
    "axis": {"labelFontSize": 12, "titleFontSize": 13, "titleFontWeight": "normal"},
    "legend": {"labelFontSize": 12, "titleFontSize": 12, "titleFontWeight": "normal"},
    "title": {"fontSize": 15, "subtitleFontSize": 12, "subtitleColor": "#555555"},
    "view": {"stroke": "#bbbbbb"},
}


def check(figure, study):
    """See that a figure of a TOML file is complete, and that its part and parameters exist.

    Raises
    ------
    InputError
        Naming what is missing or not known.
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


def default_figures(study):
    """Return a figure for each part that names none: the departure over its first parameters."""
    shown = {figure["part"] for figure in study.figures}
    for part in study.parts:
        names = part.varying
        if part.name in shown or not names:
            continue
        figure = {"name": part.name, "title": part.name, "part": part.name, "values": ["dE2000"]}
        if len(names) == 1:
            yield figure | {"kind": "lines", "x": names[0]}
        else:
            yield figure | {"kind": "map", "x": names[-1], "y": names[0]}


def chart(figure, table, study):
    """Return the Vega-Lite specification of a figure.

    Raises
    ------
    InputError
        When a column does not exist, or nothing is to be shown.
    """
    for column in figure["values"]:
        query.require(table, column)
    part = next(part for part in study.parts if part.name == figure["part"])
    data = query.rows(table, figure["part"], figure.get("where"))
    shown = {figure["x"], figure.get("y"), figure.get("series"), *figure.get("where", ())}
    over = [name for name in part.varying if name not in shown]
    make = {"map": _map, "lines": _lines}[figure["kind"]]
    title = {"text": figure["title"], "anchor": "start"}
    if over and part.design == "grid":
        title["subtitle"] = f"mean over {', '.join(map(_label, over))}"
    return {
        "$schema": SCHEMA,
        "description": figure["title"],
        "title": title,
        "padding": 8,
        "config": CONFIG,
        **make(figure, table, part, data),
    }


def _map(figure, table, part, data):
    (column,) = figure["values"]
    x, y = figure["x"], figure["y"]
    is_word = isinstance(data[0][column], str)
    if part.design == "grid":
        cells = _mean(data, (x, y), column)
        x_axis = _field("x", table, x, "ordinal", sort="ascending")
        y_axis = _field("y", table, y, "ordinal", sort="descending")
        x_axis["axis"] |= {"labelOverlap": "greedy", "labelAngle": 0}
        y_axis["axis"] |= {"labelOverlap": "greedy"}
        mark = {"type": "rect"}
    else:
        cells = [{"x": row[x], "y": row[y], "value": row[column]} for row in data]
        x_axis, y_axis = (_field(axis, table, name) for axis, name in (("x", x), ("y", y)))
        for axis, name in ((x_axis, x), (y_axis, y)):
            if getattr(part.spans[name], "logarithmic", False):
                axis["scale"] = {"type": "log", "nice": False}
        mark = {"type": "circle", "size": 60, "opacity": 1}
    colour = {"field": "value", "title": _label(column).split(" ")}
    if is_word:
        words = sorted({cell["value"] for cell in cells})
        colour |= {"type": "nominal", "scale": {"domain": words, "range": WORDS[: len(words)]}}
        colour["title"] = column
        for cell in cells:
            cell["letter"] = cell["value"][0].upper()
    else:
        scheme = "magma" if column.startswith("dE") else "viridis"
        colour |= {"type": "quantitative", "scale": {"scheme": scheme}}
    layer = [{"mark": mark, "encoding": {"color": colour}}]
    if is_word and part.design == "grid":
        text = {"field": "letter", "type": "nominal"}
        layer.append({"mark": {"type": "text"}, "encoding": {"text": text}})
    return {
        "data": {"values": cells},
        "width": 420,
        "height": 300,
        "encoding": {"x": x_axis, "y": y_axis},
        "layer": layer,
    }


def _lines(figure, table, part, data):
    x, series = figure["x"], figure.get("series")
    values = []
    for column in figure["values"]:
        for cell in _mean(data, (x, series) if series else (x,), column):
            values.append(cell | {"quantity": _label(column)})
    columns = figure["values"]
    unit = query.unit(table, columns[0])
    title = _label(columns[0]) if len(columns) == 1 else _common(columns)
    y_axis = {"field": "value", "type": "quantitative", "axis": {"title": _with(title, unit)}}
    logarithmic = figure.get("log", ())
    encoding = {"x": _field("x", table, x), "y": y_axis}
    for axis in ("x", "y"):
        encoding[axis]["scale"] = {"type": "log"} if axis in logarithmic else {"zero": axis == "y"}
    encoding["x"]["scale"]["nice"] = False
    if series:
        encoding["color"] = {
            "field": "y",
            "type": "ordinal",
            "title": _title(table, series),
            "scale": {"range": _inks(len({value["y"] for value in values}))},
        }
    if len(columns) > 1:
        encoding["strokeDash"] = {
            "field": "quantity",
            "type": "nominal",
            "title": None,
            "sort": [_label(column) for column in columns],
            "scale": {"range": [[1, 0], [6, 3], [2, 2], [8, 2, 2, 2]][: len(columns)]},
            "legend": {"labelLimit": 300, "symbolSize": 400},
        }
    layer = [{"mark": {"type": "line", "strokeWidth": 2}, "encoding": encoding}]
    if "rule" in figure:
        mark = {"type": "rule", "strokeDash": [3, 3], "color": "#8a8a8a"}
        layer.append({"mark": mark, "encoding": {"y": {"datum": figure["rule"]}}})
    return {"data": {"values": values}, "width": 460, "height": 300, "layer": layer}


def _mean(data, keys, column):
    """Return the mean of a column for each combination of keys; of words, the most frequent."""
    groups = defaultdict(list)
    for row in data:
        if row[column] is not None:
            groups[tuple(row[key] for key in keys)].append(row[column])
    cells = []
    for key, found in sorted(groups.items()):
        is_word = isinstance(found[0], str)
        value = max(sorted(set(found)), key=found.count) if is_word else sum(found) / len(found)
        cells.append(dict(zip(("x", "y"), key, strict=False)) | {"value": value})
    return cells


def _inks(count):
    """Return colours along viridis without its light end, which would not show on white."""
    import matplotlib

    colours = matplotlib.colormaps["viridis"]
    at = [0.8 * number / max(count - 1, 1) for number in range(count)]
    return [matplotlib.colors.to_hex(colours(place)) for place in at]


def _field(axis, table, name, kind="quantitative", **more):
    formatted = {"title": _title(table, name), "format": ".3~g"}
    return {"field": axis, "type": kind, "axis": formatted, **more}


def _title(table, column):
    return _with(_label(column), query.unit(table, column))


def _with(label, unit):
    return f"{label} ({unit})" if unit not in ("", "1") else label


def _label(column):
    return SYMBOLS.get(column, column.replace("_", " "))


def _common(columns):
    """Return what the names of several columns share, such as ``albedo`` of both halves."""
    words = [column.split("_") for column in columns]
    shared = [word for word in words[0] if all(word in other for other in words)]
    return " ".join(shared) or "value"
