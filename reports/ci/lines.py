"""The results of checks as lines for a terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from heuristic import program
from reports.terminal.tables import printed

if TYPE_CHECKING:
    from comparisons.check.check import Check
    from comparisons.check.moved import Move
    from reports.ci.checks import Result

SHOWN = 12
"""Quantities of a scene that are listed; all are in the record."""


def lines(results: Sequence[Result], level: float) -> Iterator[str]:
    """Yield what moved in each scene, then a table of all scenes."""
    for result in results:
        yield from _details(result)
    if len(results) > 1:
        yield from printed(_summary(results), right=2)
        yield ""
    yield verdict(results, level)


def verdict(results: Sequence[Result], level: float) -> str:
    """Return the line that says how it went."""
    count = len(results)
    updates = [r for r in results if r.status in ("created", "updated", "unchanged")]
    failed = sum(result.status == "failed" for result in results)
    errors = sum(result.status == "error" for result in results)
    if updates:
        written = sum(result.status in ("created", "updated") for result in updates)
        text = f"{written} of {count} baselines written"
    else:
        text = f"{failed} of {count} moved" if failed else f"{count - errors} of {count} unmoved"
        text += f" (significance {level:g} over all that was tested)"
    return text + (f"; {errors} could not be checked" if errors else "")


def moved_lines(check: Check) -> Iterator[str]:
    """Yield the table of what moved: from, to, by how many standard errors, and the p-value."""
    yield from printed(_moves(check), right=2)
    more = len(check.moved) - SHOWN
    if more > 0:
        yield f"and {more} more; {len(check.moves)} quantities were tested"


def _moves(check: Check) -> Iterator[Sequence[str]]:
    yield "what moved", "baseline", "now", "change", "standard errors", "p"
    for move in check.moved[:SHOWN]:
        old, new = move.before, move.after
        change = f"{100 * (new - old) / abs(old):+.2g} %" if old else f"{new - old:+.2g}"
        name, before, now, *certainty = moved_cells(move)
        yield name, before, now, change, *certainty


def moved_cells(move: Move) -> tuple[str, ...]:
    """Return the cells of a move: its name, from, to, standard errors and p-value."""
    errors = move.standard_errors
    return (
        move.quantity,
        f"{move.before:.6g}",
        f"{move.after:.6g}",
        "no noise" if errors is None else f"{errors:+.1f}",
        f"{move.p_corrected:.1g}",
    )


def versions_line(result: Result) -> str:
    """Return which versions changed since the baseline; empty for none."""
    changed = (result.versions or {}).items()
    changes = ", ".join(f"{name} {both.before} -> {both.after}" for name, both in changed)
    return f"versions since the baseline: {changes}" if changes else ""


def _details(result: Result) -> Iterator[str]:
    if result.check is None or not result.check.moved:
        if result.message:
            yield f"{result.name}: {result.message}"
        return
    yield f"{result.name}: {result.status}"
    yield from ("  " + line for line in moved_lines(result.check))
    if versions_line(result):
        yield "  " + versions_line(result)
    if result.folder is not None:
        yield f"  pictures: {result.folder}"
    if result.status == "failed":
        yield f"  if this is meant: {program.command('check', result.path, '--update')}"
    yield ""


def _summary(results: Sequence[Result]) -> Iterator[Sequence[str]]:
    yield "baseline", "result", "moved", "of", "mean ΔE2000", "now", "least p", "time"
    for result in results:
        cells = [""] * 5
        if result.check is not None:
            check = result.check
            old, new = (m.metrics["dE2000"].value for m in (check.before, check.after))
            least = min(move.p_corrected for move in check.moves)
            moved = f"{len(check.moved)}", f"{len(check.moves)}"
            cells = [*moved, f"{old:.3f}", f"{new:.3f}", f"{least:.2g}"]
        yield result.name, result.status, *cells, f"{result.seconds:.1f} s"
