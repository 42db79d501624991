"""Summaries in Markdown, fit for a comment on a pull request: a table and a link, no pictures."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from heuristic.errors import OutputError
from reports import verdict
from reports.ci import gates
from reports.ci.annotations import cell, table
from reports.page.scene_view import SceneView
from reports.terminal.printing import number, percent
from reports.terminal.tables import markdown

if TYPE_CHECKING:
    from reports.ci.checks import Result


def of_comparison(views: Sequence[SceneView], outcomes: Sequence[gates.Outcome], page: str) -> str:
    """Return the summary of a run: its finding, a row for each scene, and its gates.

    ``page`` is the address of the page, or its path.
    """
    found = [verdict.finding(v.record, v.cost.record if v.cost else None) for v in views]
    lead, usual = verdict.LEADING, verdict.USUAL
    rows = [("Scene", "Mostly lacks", f"Mean {lead.label}", f"Pixels above {usual:g}")]
    rows += [
        (cell(f.scene), f.cause or "", number(f.mean), percent(f.beyond[usual])) for f in found
    ]
    parts = ["### fotismos compare", " ".join(verdict.sentences(found)), _table(rows, 2)]
    if outcomes:
        cells = [[cell(text) for text in outcome.cells()] for outcome in outcomes]
        parts += [_table([gates.HEADINGS, *cells], 2), gates.verdict(outcomes)]
    return "\n\n".join([*parts, _link(page)]) + "\n\n"


def of_check(results: Sequence["Result"], level: float, page: str) -> str:
    """Return the summary of a check; ``page`` is empty if none was written."""
    return table(results, level) + (_link(page) + "\n\n" if page else "")


def append(path: Path, text: str) -> None:
    """Append a summary to a file, which is made if it does not exist.

    Raises
    ------
    OutputError
        If it cannot be written to.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a", encoding="utf-8") as file:
            file.write(text)
    except OSError as error:
        raise OutputError(
            f"--summary {path}: {error.strerror or error}. Name a file that can be written to."
        ) from error


def _table(rows: Sequence[Sequence[str]], right: int) -> str:
    return "\n".join(markdown(rows, right))


def _link(page: str) -> str:
    if page.startswith(("https://", "http://")):
        return f"[Pictures, maps and numbers]({page.replace(')', '%29').replace(' ', '%20')})"
    return f"Pictures, maps and numbers: `{page}`"
