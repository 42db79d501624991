"""Rows as one Parquet file, with units, meanings and provenance in its schema."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TypeGuard

import pyarrow as pa
import pyarrow.parquet as pq

from comparisons import atomic
from comparisons.record import versions
from comparisons.store import require_regular
from comparisons.study.columns import IDENTITY, PARAMETERS, Column, Row, results
from comparisons.study.design import OWN, Study
from heuristic.errors import InputError

TYPES = {str: pa.string(), int: pa.int64(), float: pa.float64()}


def table(study: Study, rows: list[Row]) -> pa.Table:
    """Return the rows of a study as a ``pyarrow.Table``.

    Each field's metadata has ``unit`` and ``description``; the schema's has ``title``, ``study``
    (the TOML text) and ``versions`` (JSON). Columns without any value are omitted; other missing
    values are null. No time or place is recorded, so equal studies give equal tables.
    """
    present = {name for row in rows for name, value in row.items() if value is not None}
    present |= {"part", "point", "error"}
    paths = sorted(present - {*IDENTITY, *PARAMETERS, *results()})
    own = {path: Column("", _meaning(path)) for path in paths}
    columns = IDENTITY | PARAMETERS | own | results()
    columns = {name: column for name, column in columns.items() if name in present}
    schema = pa.schema(
        [
            pa.field(
                name,
                TYPES[column.kind],
                metadata={"unit": column.unit, "description": column.meaning},
            )
            for name, column in columns.items()
        ],
        metadata={
            "title": study.title,
            "study": study.text,
            "versions": json.dumps(versions(), ensure_ascii=False),
        },
    )
    return pa.Table.from_pylist([{name: row.get(name) for name in columns} for row in rows], schema)


def _meaning(path: str) -> str:
    if path.startswith(OWN):
        return "parameter that the heuristic declares"
    return "parameter of the scene, by its path"


def fits(rows: object, points: Sequence[dict[str, float]]) -> TypeGuard[list[Row]]:
    """Return whether an object read from a file is rows of these points, fit for :func:`table`."""
    if not isinstance(rows, list) or len(rows) != len(points):
        return False
    known = IDENTITY | PARAMETERS | results()
    for row, point in zip(rows, points, strict=True):
        if not isinstance(row, dict) or not {*IDENTITY, *point, "error"} <= row.keys():
            return False
        columns = known | dict.fromkeys(point, Column("", "a parameter"))
        if any(row[name] != value for name, value in point.items()):
            return False
        if not all(name in columns and _is_of(columns[name], row[name]) for name in row):
            return False
    return True


def _is_of(column: Column, value: object) -> bool:
    if column.kind is float and type(value) is int:
        return abs(value) < 2**53
    return value is None or type(value) is column.kind


def write(path: str | Path, data: pa.Table) -> None:
    """Write a table to a Parquet file, atomically.

    Raises
    ------
    OutputError
        When it cannot be written.
    """
    atomic.write(Path(path), file_of(data))


def file_of(data: pa.Table) -> bytes:
    """Return the Parquet file of a table as bytes."""
    stream = pa.BufferOutputStream()
    pq.write_table(data, stream, compression="zstd", write_page_checksum=True)
    return stream.getvalue().to_pybytes()


def read(path: str | Path) -> pa.Table:
    """Read a dataset.

    Raises
    ------
    InputError
        When it is missing, or is not a Parquet file.
    """
    try:
        require_regular(path)
        found = pq.read_table(path, page_checksum_verification=True)
        found.validate(full=True)
        missing = {"part", "point", "error"} - set(found.column_names)
        if missing:
            raise pa.ArrowInvalid(f"it has no column {', '.join(sorted(missing))}")
        return found
    except (OSError, pa.ArrowException) as error:
        raise InputError(
            f"{path} cannot be read as a dataset: {error}. Run the study again."
        ) from error
