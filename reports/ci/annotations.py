"""What CI services show next to a change: annotations, and a summary as a table.

=====================  ==================  ======================================================
Service                Known by            What is written
=====================  ==================  ======================================================
GitHub Actions (and    GITHUB_ACTIONS      ``::error`` lines; a table in ``GITHUB_STEP_SUMMARY``
Forgejo, Gitea)
GitLab                 GITLAB_CI           ``gl-code-quality-report.json`` in the results' folder
Azure Pipelines        TF_BUILD            ``##vso[task.logissue]`` lines; the table by
                                           ``task.uploadsummary``
TeamCity               TEAMCITY_VERSION    ``##teamcity[buildProblem]`` lines
=====================  ==================  ======================================================

All others get the table in the log, as people do.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from heuristic.errors import InputError
from reports.ci import junit, lines
from reports.files import ownership
from reports.terminal.tables import markdown

if TYPE_CHECKING:
    from reports.ci.checks import Result

GITHUB = str.maketrans({"%": "%25", "\r": "%0D", "\n": "%0A"})
GITHUB_PROPERTY = GITHUB | str.maketrans({":": "%3A", ",": "%2C"})
AZURE = str.maketrans({"%": "%AZP25", "\r": "%0D", "\n": "%0A"})
AZURE_PROPERTY = str.maketrans({"%": "%AZP25", ";": "%3B", "]": "%5D"})
TEAMCITY = str.maketrans({c: f"|{c}" for c in "'|[]"} | {"\n": "|n", "\r": "|r"})
"""How each service escapes the characters that its lines are made of."""


def annotate(
    results: Sequence[Result],
    folder: Path,
    level: float,
    environment: Mapping[str, str] | None = None,
    written: Path | None = None,
) -> list[str]:
    """Write the files that the CI service reads, and return the lines that it looks for.

    Parameters
    ----------
    results
        One for each baseline.
    folder
        Folder of the results.
    level
        Significance of the whole command.
    environment
        Environment variables; if omitted, this process's.
    written
        A file that ``--summary`` has already written the table to.

    Raises
    ------
    InputError
        If a file cannot be written to.
    """
    variables = os.environ if environment is None else environment
    try:
        return _annotate(results, folder, level, variables, written)
    except OSError as error:
        raise InputError(
            f"{error.filename or folder}: {error.strerror or error}. This is where the CI service"
            " reads results: ensure that it can be written to."
        ) from error


def _annotate(
    results: Sequence[Result],
    folder: Path,
    level: float,
    variables: Mapping[str, str],
    written: Path | None,
) -> list[str]:
    bad = [result for result in results if result.exit_code]
    if variables.get("GITHUB_ACTIONS") == "true":
        summary = variables.get("GITHUB_STEP_SUMMARY")
        if summary and Path(summary) != written:
            with Path(summary).open("a", encoding="utf-8") as file:
                file.write(table(results, level))
        return [_github(result, variables) for result in bad]
    if variables.get("GITLAB_CI") == "true":
        report = [_code_quality(result) for result in bad]
        folder.mkdir(parents=True, exist_ok=True)
        content = json.dumps(report, indent=2, ensure_ascii=False)
        ownership.write(folder / "gl-code-quality-report.json", content)
        return []
    if variables.get("TF_BUILD"):
        folder.mkdir(parents=True, exist_ok=True)
        path = (folder / "summary.md").resolve()
        ownership.write(path, table(results, level))
        return [*map(_azure, bad), f"##vso[task.uploadsummary]{path}"]
    if variables.get("TEAMCITY_VERSION"):
        return [_teamcity(result) for result in bad]
    return []


def table(results: Sequence[Result], level: float) -> str:
    """Return the results as a Markdown table."""
    headings = ("Baseline", "Result", "What moved most", "Baseline", "Now", "Standard errors", "p")
    rows = [headings, *([*map(cell, _cells(result))] for result in results)]
    head = ["### fotismos check", "", lines.verdict(results, level), ""]
    return "\n".join([*head, *markdown(rows, right=3)]) + "\n\n"


def _cells(result: Result) -> tuple[str, ...]:
    if result.check is None or not result.check.moved:
        return result.name, result.status, result.message, "", "", "", ""
    moved = result.check.moved
    what, *numbers = lines.moved_cells(moved[0])
    return result.name, result.status, f"{what} ({len(moved)} in all)", *numbers


def cell(text: str) -> str:
    """Return text in one line that Markdown shows unchanged; `markdown` escapes bars."""
    text = junit.clean(" ".join(text.split())).replace("&", "&amp;").replace("<", "&lt;")
    return re.sub(r"([\\`*_\[\]])", r"\\\1", text)


def _title(result: Result) -> str:
    """Name the baseline, and say whether it could be checked; the headline says what moved."""
    name = junit.clean(result.name)
    return f"fotismos check: {name}" + " not checked" * (result.status == "error")


def _github(result: Result, variables: Mapping[str, str]) -> str:
    place = os.path.relpath(result.path, variables.get("GITHUB_WORKSPACE") or ".")
    file = junit.clean(Path(place).as_posix()).translate(GITHUB_PROPERTY)
    title = _title(result).translate(GITHUB_PROPERTY)
    return f"::error file={file},title={title}::{junit.headline(result).translate(GITHUB)}"


def _azure(result: Result) -> str:
    place = junit.clean(os.path.relpath(result.path)).translate(AZURE_PROPERTY)
    text = junit.headline(result).translate(AZURE)
    return f"##vso[task.logissue type=error;sourcepath={place}]{_title(result)}: {text}"


def _teamcity(result: Result) -> str:
    text = f"{_title(result)}: {junit.headline(result)}".translate(TEAMCITY)
    text = "".join(c if ord(c) < 128 else f"|0x{ord(c):04X}" for c in text)
    return f"##teamcity[buildProblem description='{text}']"


def _code_quality(result: Result) -> dict[str, Any]:
    path = junit.clean(Path(os.path.relpath(result.path)).as_posix())
    return {
        "description": f"{_title(result)}: {junit.headline(result)}",
        "check_name": "fotismos check",
        # One per baseline, however its numbers move: GitLab compares branches by it.
        "fingerprint": hashlib.sha256(path.encode()).hexdigest(),
        "severity": "critical" if result.status == "error" else "major",
        "location": {"path": path, "lines": {"begin": 1}},
    }
