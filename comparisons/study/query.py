"""Queries of a dataset: the rows of a part at given parameters, and single values."""

from math import isclose
from typing import Any

import numpy as np
import pyarrow as pa

from comparisons.study.columns import Row
from heuristic.errors import InputError, unknown


def rows(table: pa.Table, part: str, where: dict[str, Any] | None = None) -> list[Row]:
    """Return the rows of a part that have a result.

    ``where`` maps columns to a value or a list of values; numbers match to six digits.

    Raises
    ------
    InputError
        When there is no such part or column, or nothing matches.
    """
    where = where or {}
    parts = sorted(set(table["part"].to_pylist()))
    if part not in parts:
        raise unknown("part", part, parts)
    for name in where:
        require(table, name)
    chosen = table.filter(pa.array([value == part for value in table["part"].to_pylist()]))
    found = [
        row
        for row in chosen.to_pylist()
        if row["error"] is None and all(_matches(row[name], value) for name, value in where.items())
    ]
    if not found:
        raise InputError(f"no point of part {part!r} has {where or 'a result'}.")
    return found


def require(table: pa.Table, column: str) -> None:
    """Ensure that a column exists.

    Raises
    ------
    InputError
        Listing the columns, if it is missing.
    """
    if column not in table.column_names:
        raise unknown("column", column, table.column_names)


def unit(table: pa.Table, column: str) -> str:
    """Return the unit of a column, from its metadata."""
    return table.schema.field(column).metadata[b"unit"].decode()


class Facts:
    """Single values of a dataset, for a page of findings."""

    def __init__(self, table: pa.Table) -> None:
        self._table = table

    def value(self, part: str, column: str, **where: Any) -> float:
        """Return a column's value at one point, or its mean over the points that match."""
        return float(np.mean(self._values(part, column, where)))

    def largest(self, part: str, column: str, **where: Any) -> float:
        """Return the largest value of a column."""
        return float(max(self._values(part, column, where)))

    def smallest(self, part: str, column: str, **where: Any) -> float:
        """Return the smallest value of a column."""
        return float(min(self._values(part, column, where)))

    def quantile(self, part: str, column: str, q: float, **where: Any) -> float:
        """Return a quantile of a column."""
        return float(np.quantile(self._values(part, column, where), q))

    def share_below(self, part: str, column: str, limit: float, **where: Any) -> float:
        """Return the share of points whose value is below a limit."""
        return float(np.mean(np.array(self._values(part, column, where)) < limit))

    def share_of(self, part: str, column: str, name: str, **where: Any) -> float:
        """Return the share of points whose value is ``name``."""
        return float(np.mean([value == name for value in self._values(part, column, where)]))

    def at_largest(self, part: str, column: str, parameter: str, **where: Any) -> Any:
        """Return a parameter's value where a column is largest."""
        return max(rows(self._table, part, where), key=lambda row: row[column])[parameter]

    def count(self, part: str) -> int:
        """Return the number of points of a part that have a result."""
        return len(rows(self._table, part))

    def _values(self, part: str, column: str, where: dict[str, Any]) -> list[Any]:
        require(self._table, column)
        return [row[column] for row in rows(self._table, part, where) if row[column] is not None]


def _matches(found: Any, wanted: Any) -> bool:
    if isinstance(wanted, list):
        return any(_matches(found, value) for value in wanted)
    if isinstance(found, float):
        return isclose(found, wanted, rel_tol=1e-6, abs_tol=1e-9)
    return found == wanted
