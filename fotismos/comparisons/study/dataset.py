"""The dataset of a study: its columns, the measures in them, and its Parquet file.

Each field's metadata has ``unit`` and ``description``; the schema's has ``title``, ``study`` (the
TOML text) and ``versions`` (JSON). No time or place is recorded, so equal studies give equal files.
"""

from __future__ import annotations

import json
from math import isclose
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from msgspec.structs import replace

from fotismos.comparisons.atomic import require_regular
from fotismos.comparisons.departure.metrics import LEADING, METRICS, RATIO
from fotismos.comparisons.records.departure import DEFAULT_VIEWING
from fotismos.comparisons.records.images import Comparison
from fotismos.comparisons.study.design import OWN, StudyFile, stated
from fotismos.comparisons.study.scenes import PHONG, ROUGHPLASTIC, SCENES
from fotismos.heuristic.errors import InputError, InstallationError, unknown
from fotismos.heuristic.program import installation, versions
from fotismos.reference.planning.effects import PRUNED

if TYPE_CHECKING:
    import pyarrow as pa  # loaded late: see arrow()

Row: TypeAlias = dict[str, Any]
"""Values by column."""


Column: TypeAlias = tuple[str, str, type]
"""A column's unit (``1`` for pure numbers), its meaning, and its Python type."""

STEPS = ("form", *(effect.label for effect in PRUNED))
"""The steps between the halves, in the order in which they are added to the textbook picture: the
form of BSDFs and lights, then one effect after another."""

DIMMED = {"quarter": 1 / 4, "sixteenth": 1 / 16}
"""Further light levels at which the departure is measured: visibility depends on the level."""

LUMINANCE = "display-linear, 1 for a white diffuse surface that faces the light"
IDENTITY: dict[str, Column] = {
    "part": ("", "part of the study", str),
    "point": ("", "number of the point in its part", int),
}
PARAMETERS: dict[str, Column] = {
    name: (parameter.unit, parameter.meaning, float)
    for scene in SCENES.values()
    for name, parameter in (ROUGHPLASTIC | PHONG | scene).items()
}
HALVES = {
    "specular": ("1", "the {}'s specular part (scene lobe: in the mirror direction)"),
    "albedo": ("1", "share of the light that the {} reflects"),
    "specular_albedo": ("1", "share that the {}'s specular part reflects"),
    "peak": ("deg", "view angle at which the {}'s specular part peaks, in the plane of incidence"),
}
"""Unit and meaning of columns that both halves have."""


def results() -> dict[str, Column]:
    """Return the columns of results, including the departure in each metric."""
    name = LEADING.name
    label = LEADING.label
    numbers = {
        "heuristic": f"mean of the textbook picture, {LUMINANCE}",
        "reference": f"mean of the physical picture, {LUMINANCE}",
        name: LEADING.heading,
        f"{name}_p95": f"{label}, 95th percentile",
        f"{name}_noise": f"{label} that the noise of the comparison alone would cause",
        f"{name}_shape": f"{label}, mean, after the best exposure",
        **{f"{name}_{part}": f"{label}, mean, under a {part} of the light" for part in DIMMED},
        "exposure": f"factor on the textbook picture that minimises {label}",
        **{name: metric.heading for name, metric in METRICS.items()},
    }
    changes = {
        STEPS[0]: "RMS change by the physical BSDFs and lights, without shadows",
        **{effect.label: f"RMS change by {effect.step}" for effect in PRUNED},
    }
    return {
        **{key: ("1", meaning, float) for key, meaning in numbers.items()},
        RATIO.name: (RATIO.unit, "mean ratio of luminances, textbook to physical", float),
        **{key: ("1", meaning, float) for key, meaning in changes.items()},
        "dominant": ("", f"the largest of {', '.join(STEPS[:-1])} and {STEPS[-1]}", str),
        **{
            f"{key}_{half}": (unit, meaning.format(half), float)
            for key, (unit, meaning) in HALVES.items()
            for half in ("heuristic", "reference")
        },
        "miss": ("1", "largest relative miss of the pairing, 0 if it is exact", float),
        "error": ("", "why there is no result; empty if there is one", str),
    }


# --- Measures -------------------------------------------------------------------------------------


def measures(comparison: Comparison) -> Row:
    """Return the columns of a comparison whose metrics are all computed."""
    record = comparison.record
    images = comparison.images
    summary = record.metrics[LEADING.name]
    test = images.heuristic[images.counted]
    truth = images.reference[images.counted]
    # Both models are linear in the light: less of it is a lower exposure of both images.
    levels = {part: replace(DEFAULT_VIEWING, exposure=factor) for part, factor in DIMMED.items()}
    dimmed = {
        f"{LEADING.name}_{part}": float(LEADING(test, truth, viewing).mean())
        for part, viewing in levels.items()
    }
    return {
        "heuristic": float(test.mean(dtype=float)),
        "reference": float(truth.mean(dtype=float)),
        **{name: metric.mean for name, metric in record.metrics.items()},
        f"{LEADING.name}_p95": summary.p95,
        f"{LEADING.name}_noise": summary.noise_floor,
        f"{LEADING.name}_shape": summary.after_exposure.mean,
        **dimmed,
        "exposure": summary.after_exposure.exposure,
        RATIO.name: record.log2_luminance.mean,
    }


# --- The file -------------------------------------------------------------------------------------


def arrow() -> Any:
    """Return the module pyarrow, an extra; `InstallationError` if it is not installed."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError as error:
        raise InstallationError(
            "pyarrow is not installed, and a study writes its dataset with it. Install it:"
            f" {installation('pyarrow')}"
        ) from error
    return pyarrow


def table(study: StudyFile, rows: list[Row]) -> pa.Table:
    """Return the rows of a study; columns without any value are omitted."""
    pa = arrow()
    present = {name for row in rows for name, value in row.items() if value is not None}
    present |= {"part", "point", "error"}
    meanings = {True: "parameter that the heuristic declares",
                False: "parameter of the scene, by its path"}  # fmt: skip
    declared = {
        path: ("", meanings[path.startswith(OWN)], float)
        for path in sorted(present - {*IDENTITY, *PARAMETERS, *results()})
    }
    columns = IDENTITY | PARAMETERS | declared | results()
    columns = {name: column for name, column in columns.items() if name in present}
    kinds = {str: pa.string(), int: pa.int64(), float: pa.float64()}
    fields = [
        pa.field(name, kinds[kind], metadata={"unit": unit, "description": meaning})
        for name, (unit, meaning, kind) in columns.items()
    ]
    software = json.dumps(versions(), ensure_ascii=False)
    schema = pa.schema(fields, {"title": study.title, "study": study.text, "versions": software})
    return pa.Table.from_pylist([{name: row.get(name) for name in columns} for row in rows], schema)


def file_of(data: pa.Table) -> bytes:
    """Return the Parquet file of a table."""
    pa = arrow()
    stream = pa.BufferOutputStream()
    pa.parquet.write_table(data, stream, compression="zstd", write_page_checksum=True)
    content: bytes = stream.getvalue().to_pybytes()
    return content


def read(path: str | Path) -> pa.Table:
    """Read a dataset; ``InputError`` if it is missing, damaged, or not one of a study."""
    pa = arrow()
    try:
        require_regular(path)
        data = pa.parquet.read_table(path, page_checksum_verification=True)
        data.validate(full=True)
        missing = {"part", "point", "error"} - set(data.column_names)
        if missing:
            raise pa.ArrowInvalid(f"it has no column {', '.join(sorted(missing))}")
        return data
    except (OSError, pa.ArrowException) as error:
        raise InputError(
            f"{path} cannot be read as a dataset: {error}. Run the study again."
        ) from error


def rows(data: pa.Table, part: str, where: dict[str, Any] | None = None) -> list[Row]:
    """Return the rows of a part that have a result.

    ``where`` maps columns to a value or a list of values; numbers match to six digits.
    """
    for name in where or {}:
        require(data, name)
    of_part = [row for row in data.to_pylist() if row["part"] == part and row["error"] is None]
    matching = [
        row for row in of_part if all(_matches(row[k], v) for k, v in (where or {}).items())
    ]
    if not matching:
        raise InputError(f"no point of part {part!r} has {where or 'a result'}.")
    return matching


def check_figures(study: StudyFile) -> None:
    """Ensure that figures show columns that datasets may have, and points that a grid has."""
    for figure in study.figures:
        where = f"figure {figure.name!r}:"
        part = next(part for part in study.parts if part.name == figure.part)
        known = {*part.levels, *IDENTITY, *PARAMETERS, *results(), *stated(figure.chart, "as")}
        for column in stated(figure.chart, "field"):
            if column not in known:
                raise unknown(f"{where} column", column, sorted(known))
        for name, allowed in figure.where.items():
            values = part.levels[name].values
            is_there = any(_matches(value, allowed) for value in values)
            if part.design == "grid" and not is_there:
                listed = ", ".join(f"{value:g}" for value in values)
                raise InputError(
                    f"{where} no point has {name} = {allowed}. Give values among {listed}."
                )


def require(data: pa.Table, column: str) -> None:
    """Ensure that a column exists."""
    if column not in data.column_names:
        raise unknown("column", column, data.column_names)


def unit(data: pa.Table, column: str) -> str:
    """Return the unit of a column, from its metadata."""
    unit: str = data.schema.field(column).metadata[b"unit"].decode()
    return unit


def _matches(value: Any, allowed: Any) -> bool:
    if isinstance(allowed, list):
        return any(_matches(value, choice) for choice in allowed)
    if isinstance(value, float):
        return isclose(value, allowed, rel_tol=1e-6, abs_tol=1e-9)
    return bool(value == allowed)
