"""Options for CI: bounds, a JUnit file, a summary in Markdown."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from comparisons import atomic
from heuristic.errors import InputError
from reports.jobs import Within
from reports.terminal import verbosity

if TYPE_CHECKING:
    from reports.page.scene_view import SceneView


class Share(click.ParamType):
    """A percentage with its sign, from 0 % to 100 %, as a share from 0 to 1."""

    name = "share"

    def convert(
        self, value: str, parameter: click.Parameter | None, context: click.Context | None
    ) -> float:
        digits, sign, rest = value.strip().partition("%")
        try:
            share = float(digits) / 100.0
        except ValueError:
            share = math.nan
        if not (sign and not rest and 0.0 <= share <= 1.0):
            told = f"{value!r} is not a percentage: give one from 0% to 100%, such as 5%."
            self.fail(told, parameter, context)
        return share


_file = click.Path(path_type=Path, dir_okay=False)

bounds = (
    click.option(
        "--max-mean",
        type=Within(min=0, max=1000),
        metavar="DE",
        help="Exit code 1 if a scene's mean ΔE2000 is larger, by more than noise.",
    ),
    click.option(
        "--max-visible",
        type=Share(),
        metavar="P%",
        help="Exit code 1 if a larger share of a scene's pixels has ΔE2000 above 2, by more than"
        " noise.",
    ),
)

files = (
    click.option("--junit", type=_file, metavar="FILE", help="Write a JUnit XML file."),
    click.option(
        "--summary",
        type=_file,
        metavar="FILE",
        help="Append a summary in Markdown, such as for a comment on a pull request.",
    ),
    click.option(
        "--link", metavar="URL", help="Where the page will be, for the summary. [default: its path]"
    ),
)


def with_options(*options: Callable) -> Callable:
    """Return a decorator that adds options to a command."""

    def add(command: Callable) -> Callable:
        for option in reversed(options):
            command = option(command)
        return command

    return add


def write_junit(path: Path | None, document: Callable[[], bytes]) -> None:
    """Write a JUnit file, if one was requested.

    Raises
    ------
    InputError
        If it cannot be written to.
    """
    if path is None:
        return
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        atomic.put(path, document())
    except OSError as error:
        raise InputError(
            f"--junit {path}: {error.strerror or error}. Name a file that can be written to."
        ) from error


@dataclass
class Judge:
    """Judges the scenes at the end of a run, and writes the requested files.

    ``words`` are the values of this module's options.
    """

    words: dict[str, Any]
    exit_code: int = 0

    def __call__(self, folder: Path, views: Sequence[SceneView]) -> None:
        """Set the exit code: 1 if a gate failed."""
        if not any(value is not None for value in self.words.values()):
            return
        from reports.ci import gates, junit, summaries

        bounds = gates.Gates(self.words["max_mean"], self.words["max_visible"])
        outcomes = bounds.judge([view.record for view in views])
        if outcomes:
            verbosity.tell(gates.lines(outcomes))
        self.exit_code = int(any(outcome.state == gates.FAILED for outcome in outcomes))
        write_junit(self.words["junit"], lambda: junit.of_gates(outcomes))
        page = self.words["link"] or str(folder / "index.html")
        if self.words["summary"] is not None:
            summaries.append(self.words["summary"], summaries.of_comparison(views, outcomes, page))
