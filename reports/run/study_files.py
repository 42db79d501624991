"""The output of a study: dataset, figures, lines for the terminal, and findings."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jinja2

from comparisons import atomic
from comparisons.study import dataset, query
from comparisons.study.design import Study
from comparisons.study.running import POINTS, Outcome
from heuristic.errors import InputError
from reports.charts import study_charts, vega
from reports.files import ownership

FIGURES = "figures"

Table = Any
"""A ``pyarrow.Table``: a dataset of points."""


@dataclass(frozen=True)
class Page:
    """A requested page of findings: its template, its file, and the dataset's file."""

    template: Path
    file: Path
    dataset: Path


def page(study: Study, file: Path, findings: Path | None) -> Page | None:
    """Check a study's figures, and find the template of its findings if requested.

    Raises
    ------
    InputError
        Before anything is rendered, if a figure cannot be drawn or the template is missing.
    """
    for figure in study.figures:
        try:
            study_charts.check(figure, study)
        except InputError as error:
            raise InputError(f"{file}: {error}") from error
    if findings is None:
        return None
    template = file.with_suffix(".md.j2")
    if not template.is_file():
        raise InputError(
            f"{template}: there is no such file. Write this template of the findings, or"
            " omit --findings."
        )
    return Page(template, findings, file.with_suffix(".parquet"))


def write(study: Study, outcome: Outcome, folder: Path, page: Page | None = None) -> Iterator[str]:
    """Write dataset, figures, and any page of findings; yields their paths."""
    place, figures = folder / f"{study.name}.parquet", folder / FIGURES
    ownership.write(place, dataset.file_of(outcome.table))
    for name, svg in drawn(study, outcome.table):
        ownership.write(ownership.folder(figures) / name, svg)
    yield str(place)
    yield str(figures)
    if page is not None:
        dataset.write(page.dataset, outcome.table)
        with atomic.explained(page.file):
            page.file.with_suffix("").mkdir(exist_ok=True)
        for name, svg in drawn(study, outcome.table):
            atomic.write(page.file.with_suffix("") / name, svg)
        atomic.write(page.file, findings(study, outcome.table, page))
        yield str(page.file)


def prepare(study: Study, folder: Path) -> Path:
    """Make a study's folder, and ensure that the study will replace only its own results.

    Raises
    ------
    InputError
        Before anything is rendered, naming what fotismos did not make.
    OutputError
        If the folder cannot be made.
    """
    ownership.require_free_folder(folder)
    ownership.folder(folder)
    ownership.require_free(folder / f"{study.name}.parquet")
    for name in (FIGURES, POINTS):
        ownership.require_free_folder(folder / name)
    ownership.folder(folder / POINTS)
    return folder


def drawn(study: Study, table: Table) -> Iterator[tuple[str, bytes]]:
    """Yield the names and contents of a study's figures, except of parts without a result."""
    with_result = {row["part"] for row in table.to_pylist() if row["error"] is None}
    for figure in (*study.figures, *study_charts.default_figures(study)):
        if figure["part"] in with_result:
            spec = study_charts.chart(figure, table, study)
            yield f"{figure['name']}.svg", vega.paper(spec)


def findings(study: Study, table: Table, page: Page) -> str:
    """Return the page of findings.

    The template takes all numbers from the dataset, by the functions of
    :class:`comparisons.study.query.Facts`. ``figure(name)`` is the number of a figure, and
    ``picture(name, text)`` the picture itself.
    """
    names = [figure["name"] for figure in study.figures]
    folder = page.file.stem

    def number(name: str) -> str:
        if name not in names:
            raise InputError(
                f"{page.template}: figure {name!r} is unknown; choose of {', '.join(names)}."
            )
        return f"figure {names.index(name) + 1}"

    def picture(name: str, text: str) -> str:
        return f"![{number(name).capitalize()}: {text}]({folder}/{name}.svg)"

    environment = jinja2.Environment(
        undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True,
        keep_trailing_newline=True, autoescape=False,
    )  # fmt: skip
    facts = query.Facts(table)
    functions = {name: getattr(facts, name) for name in dir(facts) if not name.startswith("_")}
    template = environment.from_string(page.template.read_text(encoding="utf-8"))
    return template.render(**functions, figure=number, picture=picture, study=study)


def summary(study: Study, outcome: Outcome) -> Iterator[str]:
    """Yield a line for each part: points, failures, and the range of the departure."""
    width = max(4, *(len(part.name) for part in study.parts))
    yield f"{'part':<{width}}  points  failed  mean ΔE2000: least  median   most"
    table: Table = outcome.table
    rows = table.to_pylist()
    for part in study.parts:
        own = [row for row in rows if row["part"] == part.name]
        good = sorted(row["dE2000"] for row in own if row["error"] is None)
        line = f"{part.name:<{width}}  {len(own):>6}  {len(own) - len(good):>6}"
        if good:
            line += f"  {good[0]:>18.2f}  {good[len(good) // 2]:>6.2f}  {good[-1]:>5.2f}"
        yield line
    if outcome.cached:
        yield f"{outcome.cached} points were cached by an earlier run."
    for row in [row for row in rows if row["error"] is not None][:3]:
        yield f"failed: {row['part']}, point {row['point']}: {row['error']}"
