"""The output of a study: dataset, figures, and lines for the terminal."""

from collections.abc import Iterator
from pathlib import Path

import pyarrow as pa

from fotismos.comparisons.study import dataset
from fotismos.comparisons.study.design import StudyFile
from fotismos.reports.charts import study_charts, vega
from fotismos.reports.files import results

FIGURES = "figures"


def write(study: StudyFile, table: pa.Table, folder: Path) -> tuple[Path, Path]:
    """Write dataset and figures, and return their places."""
    data = folder / f"{study.name}.parquet"
    figures = folder / FIGURES
    results.write(data, dataset.file_of(table))
    with_result = {row["part"] for row in table.to_pylist() if row["error"] is None}
    for figure in study_charts.all_figures(study):
        if figure.part in with_result:
            svg = vega.paper(study_charts.chart(figure, table, study))
            results.write(figures / f"{figure.name}.svg", svg)
    return data, figures


def summary(study: StudyFile, table: pa.Table, done: int) -> Iterator[str]:
    """Yield a line for each part: points, failures, and the range of the departure."""
    width = max(4, *(len(part.name) for part in study.parts))
    yield f"{'part':<{width}}  points  failed  mean ΔE2000: least  median   most"
    rows = table.to_pylist()
    for part in study.parts:
        of_part = [row for row in rows if row["part"] == part.name]
        good = sorted(row["dE2000"] for row in of_part if row["error"] is None)
        line = f"{part.name:<{width}}  {len(of_part):>6}  {len(of_part) - len(good):>6}"
        if good:
            line += f"  {good[0]:>18.2f}  {good[len(good) // 2]:>6.2f}  {good[-1]:>5.2f}"
        yield line
    if done < len(rows):
        yield f"{len(rows) - done} points were kept from an earlier run, or are shared."
    for row in [row for row in rows if row["error"] is not None][:3]:
        yield f"failed: {row['part']}, point {row['point']}: {row['error']}"
