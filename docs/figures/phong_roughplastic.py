"""The page on Phong and roughplastic: ``phong_roughplastic.md.j2`` with its numbers."""

from pathlib import Path
from typing import Any

import jinja2
import numpy as np
import pyarrow as pa

from fotismos.comparisons.study import dataset
from fotismos.comparisons.study.design import StudyFile

TEMPLATE = Path(__file__).with_suffix(".md.j2")


class Facts:
    """The functions of the template: single values of a dataset, and the figures of its study.

    ``where`` selects points by columns (:func:`fotismos.comparisons.study.dataset.rows`).
    """

    def __init__(self, study: StudyFile, table: pa.Table) -> None:
        self._figures = [figure.name for figure in study.figures]
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

    def at_largest(self, part: str, column: str, parameter: str, **where: Any) -> Any:
        """Return a parameter's value where a column is largest."""
        rows = dataset.rows(self._table, part, where)
        return max(rows, key=lambda row: row[column])[parameter]

    def count(self, part: str) -> int:
        """Return the number of points of a part that have a result."""
        return len(dataset.rows(self._table, part))

    def figure(self, name: str) -> str:
        """Return the number of a figure."""
        return f"figure {self._figures.index(name) + 1}"

    def picture(self, name: str, text: str) -> str:
        """Return the picture of a figure."""
        return f"![{self.figure(name).capitalize()}: {text}](phong-roughplastic/{name}.svg)"

    def _values(self, part: str, column: str, where: dict[str, Any]) -> list[Any]:
        rows = dataset.rows(self._table, part, where)
        return [row[column] for row in rows if row[column] is not None]


def page(study: StudyFile, table: pa.Table) -> str:
    """Return the page."""
    facts = Facts(study, table)
    functions = {name: getattr(facts, name) for name in dir(facts) if not name.startswith("_")}
    environment = jinja2.Environment(
        undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True,
        keep_trailing_newline=True, autoescape=False,
    )  # fmt: skip
    template = environment.from_string(TEMPLATE.read_text(encoding="utf-8"))
    return template.render(**functions, study=study)
