"""The work of ``fotismos check``."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import click

from fotismos.comparisons.departure.criterion import LIMIT, TOLERANCE, checked_threshold
from fotismos.comparisons.processes.pool import Pool
from fotismos.comparisons.records.check import CheckRecord, Checks
from fotismos.reference.records import to_json
from fotismos.reports.ci import checks, summary
from fotismos.reports.ci.checks import Tolerance
from fotismos.reports.files import results
from fotismos.reports.jobs import command_line
from fotismos.reports.terminal.words import echo, is_quiet, tell


def run(
    pool: Pool,
    baseline: Path,
    update: bool,
    scenes: Sequence[str],
    with_images: bool,
    significance: float,
    changes: Mapping[str, Any],
    patterns: Mapping[Path, str],
    within: float | None,
    max_visible: float | None,
    inputs: Sequence[Path],
    output: Path,
    junit: Path | None,
    summary_file: Path | None,
    as_json: bool,
) -> int:
    """Check or update baselines, print what moved, and return the exit code."""
    # Before anything is rendered: an output that cannot be used is refused at once.
    summary.require_free(junit, summary_file, [*scenes, *inputs])
    shown = ""
    if update:
        outcomes = checks.update_all(
            pool,
            baseline,
            scenes=scenes,
            with_pictures=with_images,
            significance=significance,
            options=changes,
            patterns=patterns,
        )
    else:
        outcomes, shown = _examined(
            pool,
            baseline,
            significance=significance,
            changes=changes,
            patterns=patterns,
            tolerance=_tolerance(within, max_visible),
            output=output,
        )
    for outcome in outcomes:
        if outcome.status == "error":
            echo(f"fotismos: error: {outcome.message}", err=True)
    summary.write_junit(junit, lambda: summary.junit_of_checks(outcomes))
    summary.append(summary_file, lambda: summary.of_checks(outcomes, significance, shown))
    # 2, could not be checked, outweighs 1, moved.
    code = max(outcome.exit_code for outcome in outcomes)
    if as_json:
        record = Checks(passed=not code, significance=significance, checks=tuple(outcomes))
        click.echo(to_json(record), nl=False)
    elif not is_quiet():
        tell(summary.lines(outcomes, significance))
        if shown:
            click.echo(f"page: {shown}")
    elif code:
        click.echo(summary.outcome(outcomes, significance))
    return code


def _tolerance(within: float | None, max_visible: float | None) -> Tolerance | None:
    """Return the tolerance of two options, of which one may be omitted; None without both."""
    if within is None and max_visible is None:
        return None
    return Tolerance(
        within=checked_threshold(TOLERANCE if within is None else within),
        bound=LIMIT if max_visible is None else max_visible,
    )


def _examined(
    pool: Pool,
    baseline: Path,
    significance: float,
    changes: Mapping[str, Any],
    patterns: Mapping[Path, str],
    tolerance: Tolerance | None,
    output: Path,
) -> tuple[list[CheckRecord], str]:
    """Check the baselines; return the outcomes, and the page if there is anything to see."""
    with results.hold(output / "check", command_line(), ()) as folder:
        outcomes, views, moved = checks.examine_all(
            pool,
            baseline,
            significance=significance,
            seed=changes.get("seed"),
            folder=folder,
            patterns=patterns,
            tolerance=tolerance,
        )
        if not (views or moved):
            results.clear(folder, (results.PAGE, results.DETAILS))
            return outcomes, ""
        title = f"fotismos check: {summary.outcome(outcomes, significance)}"
        return outcomes, str(checks.write_page(folder, title, views, moved))
