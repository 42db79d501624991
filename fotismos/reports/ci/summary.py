"""What CI and people read of a run: gates, JUnit XML, a summary in Markdown, lines of a check."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from fotismos.comparisons import atomic
from fotismos.comparisons.departure.criterion import TOLERANCE
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.records.comparison import ComparisonRecord
from fotismos.comparisons.records.departure import Verdict, VisibleShare
from fotismos.heuristic.errors import FotismosError, InputError, OutputError
from fotismos.reports import verdict
from fotismos.reports.terminal.tables import escaped, markdown, printed
from fotismos.reports.terminal.words import number, percent, visible

if TYPE_CHECKING:
    from fotismos.comparisons.records.check import CheckRecord

STEP_SUMMARY = "GITHUB_STEP_SUMMARY"
"""The variable with the file whose Markdown GitHub, Forgejo and Gitea show."""

JUNIT_HEAD = b"<?xml version='1.0' encoding='utf-8'?>\n<testsuites name=\"fotismos "
"""How JUnit files of fotismos begin."""

SHOWN = 12
"""Quantities of a scene that are listed; all are in the record."""

# XML 1.0 forbids all other characters, even as references; a lone surrogate is no UTF-8 either.
NOT_IN_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


# --- Gates -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Gate:
    """The largest share of a scene's pixels that may differ visibly, and the share that does."""

    scene: str
    bound: float
    found: VisibleShare
    state: Verdict

    def cells(self) -> tuple[str, ...]:
        """Return its row of a table: scene, at most, share, from, to, result."""
        numbers = self.bound, self.found.value, self.found.low, self.found.high
        return self.scene, *map(percent, numbers), self.state

    def __str__(self) -> str:
        _, bound, share, low, high, state = self.cells()
        return (
            f"{share} of the pixels ({low} to {high}) differ by more than {LEADING.label}"
            f" {self.found.threshold:g}, at most {bound} may: {state}"
        )


GATE_HEADINGS = ("scene", "at most", "pixels that differ", "from", "to", "result")


def gates(
    records: Iterable[ComparisonRecord], bound: float | None, threshold: float = TOLERANCE
) -> list[Gate]:
    """Return a gate for each scene; none without a bound."""
    if bound is None:
        return []
    return [
        Gate(
            scene=record.scene,
            bound=bound,
            found=verdict.share(record, threshold),
            state=verdict.decision(record, threshold, bound),
        )
        for record in records
    ]


def gate_lines(gates: Sequence[Gate]) -> Iterator[str]:
    """Yield the lines on the gates of a run."""
    yield ""
    yield from printed([GATE_HEADINGS, *(gate.cells() for gate in gates)], right=1)
    yield gate_outcome(gates)


def gate_outcome(gates: Sequence[Gate]) -> str:
    """Return the line that says how it went."""
    states = [gate.state for gate in gates]
    outcomes: dict[Verdict, str] = {"fail": "failed", "undecided": "undecided", "pass": "passed"}
    counts = (
        f"{states.count(state)} {word}" for state, word in outcomes.items() if state in states
    )
    more = " More samples or repeats decide." if "undecided" in states else ""
    return f"gates: {', '.join(counts)}.{more}"


# --- Files -----------------------------------------------------------------------------------


def require_free(junit: Path | None, summary: Path | None, inputs: Iterable[str | Path]) -> None:
    """Ensure that the files for CI replace no input, and nothing that fotismos did not make.

    JUnit replaces only an earlier JUnit file; a summary is appended to Markdown, or to
    ``$GITHUB_STEP_SUMMARY``. Devices and pipes are free.
    """
    paths = [Path(file) for file in inputs]
    if junit and summary and os.path.realpath(junit) == os.path.realpath(summary):
        raise InputError(f"--junit {junit} and --summary: they are one file. Name two.")
    for option, path in (("--junit", junit), ("--summary", summary)):
        if path is None or not path.is_file():
            continue
        if any(file.exists() and file.samefile(path) for file in paths):
            raise InputError(
                f"{option} {path}: this file is an input of the same command. Name another one."
            )
        with path.open("rb") as file:
            head = file.read(len(JUNIT_HEAD))
        is_markdown = path.suffix in (".md", ".markdown")
        is_markdown |= os.environ.get(STEP_SUMMARY) == str(path)
        if head and not (is_markdown if option == "--summary" else head == JUNIT_HEAD):
            kind = "Markdown" if option == "--summary" else "a JUnit file of fotismos"
            raise InputError(
                f"{option} {path}: this file is not {kind}, and stays. Name another one."
            )


def write_junit(path: Path | None, document: Callable[[], bytes]) -> None:
    """Write a JUnit file, if one was requested."""
    if path is None:
        return
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        atomic.put(path, document())
    except (OSError, OutputError) as error:
        # `atomic.put` turns the system's error into advice on the folder of results.
        system = error.__cause__ or error
        reason = getattr(system, "strerror", None) or system
        raise InputError(
            f"--junit {path}: {reason}. Name a file that can be written to."
        ) from error


def append(path: Path | None, text: Callable[[], str]) -> None:
    """Append a summary to a file, if one was requested, and to ``$GITHUB_STEP_SUMMARY``."""
    step = os.environ.get(STEP_SUMMARY)
    for option, target in (("--summary", path), (STEP_SUMMARY, Path(step) if step else None)):
        if target is None or (option == STEP_SUMMARY and target == path):
            continue
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            with target.open("a", encoding="utf-8") as file:
                file.write(text())
        except OSError as error:
            raise OutputError(
                f"{option} {target}: {error.strerror or error}. Name a file that can be written to."
            ) from error


# --- JUnit -----------------------------------------------------------------------------------


def junit_of_checks(checks: Sequence[CheckRecord]) -> bytes:
    """Return the XML document of checks, one test case for each baseline."""
    cases = []
    for made in checks:
        names = {"name": made.name, "file": made.baseline, "time": f"{made.seconds:.3f}"}
        case = _element("testcase", {**names, "classname": "fotismos.check"})
        if made.status == "failed":
            failure = _element("failure", {"message": made.headline, "type": "moved"})
            failure.text = _clean("\n".join(moved_lines(made)))
            case.append(failure)
        elif made.status == "error":
            case.append(_element("error", {"message": made.message, "type": "error"}))
        cases.append(case)
    return _document("check", cases)


def junit_of_gates(gates: Sequence[Gate], errors: Mapping[str, FotismosError]) -> bytes:
    """Return the XML document of a comparison: a test case for each gate, and for each error."""
    cases = []
    for name, error in errors.items():
        case = _element("testcase", {"name": name, "classname": "fotismos.compare"})
        case.append(_element("error", {"message": str(error), "type": type(error).__name__}))
        cases.append(case)
    for gate in gates:
        case = _element("testcase", {"name": gate.scene, "classname": "fotismos.compare"})
        if gate.state != "pass":
            case.append(_element("failure", {"message": str(gate), "type": gate.state}))
        cases.append(case)
    return _document("compare", cases)


def _document(command: str, cases: Sequence[Element]) -> bytes:
    kinds = [child.tag for case in cases for child in case]
    totals = {"name": f"fotismos {command}", "tests": str(len(cases)), "skipped": "0"}
    totals |= {f"{kind}s": str(kinds.count(kind)) for kind in ("failure", "error")}
    # The name is the first attribute: by that `JUNIT_HEAD` recognises the file later.
    root = Element("testsuites", totals)
    SubElement(root, "testsuite", totals).extend(cases)
    indent(root)
    document: bytes = tostring(root, encoding="utf-8", xml_declaration=True)
    return document


def _element(tag: str, attributes: dict[str, str]) -> Element:
    return Element(tag, {name: _clean(text) for name, text in attributes.items()})


def _clean(text: str) -> str:
    """Return text with "�" for characters that XML and UTF-8 forbid; file names may have them."""
    return NOT_IN_XML.sub("�", text)


# --- Markdown --------------------------------------------------------------------------------


def of_comparison(
    scenes: Sequence[verdict.Studied],
    gates: Sequence[Gate],
    errors: Mapping[str, FotismosError],
    page: str,
    threshold: float = TOLERANCE,
) -> str:
    """Return the summary of a run: verdict, a row for each scene, gates, and errors."""
    headings = ("Scene", "Pixels that differ", f"Mean {LEADING.label}", "What makes it look right")
    rows: list[tuple[str, ...]] = []
    for record, cost in scenes:
        numbers = (
            percent(verdict.share(record, threshold).value),
            number(record.metrics[LEADING.name].mean),
        )
        wanted = (verdict.cause(record), verdict.sentence(record, cost, threshold))
        sentences = " ".join(filter(None, (*record.mistakes, *wanted)))
        rows.append((record.scene, *numbers, sentences))
    records = [record for record, _ in scenes]
    first = verdict.headline(records, threshold)
    second = verdict.most_missing(records, threshold)
    parts = ["### fotismos compare", escaped(f"{first} {second}".strip())]
    parts.append(_marked_down([headings, *rows]))
    if gates:
        rows = [gate.cells() for gate in gates]
        parts += [_marked_down([GATE_HEADINGS, *rows]), gate_outcome(gates)]
    parts += [escaped(f"{name}: {error}") for name, error in errors.items()]
    parts += [_where(page)] if page else []
    # The next summary may be appended to the same file.
    return "\n\n".join(parts) + "\n\n"


def of_checks(checks: Sequence[CheckRecord], level: float, page: str) -> str:
    """Return the summary of checks; ``page`` is empty if none was written."""
    rows: list[tuple[str, ...]] = [
        ("Baseline", "Result", "What moved most", "Baseline", "Now", "Standard errors", "p")
    ]
    for made in checks:
        cells: tuple[str, ...] = (made.message, "", "", "", "")
        if made.moved and (most := made.largest):
            what, *numbers = most.cells()
            cells = (f"{what}, {most.change} ({len(made.moved)} in all)", *numbers)
        rows.append((made.name, made.status, *cells))
    parts = ["### fotismos check", outcome(checks, level), _marked_down(rows, right=3)]
    parts += [escaped(f"{made.name}: {' '.join(made.causes)}") for made in checks if made.causes]
    return "\n\n".join([*parts, *([_where(page)] if page else ())]) + "\n\n"


def _marked_down(rows: Sequence[Sequence[str]], right: int = 1) -> str:
    return "\n".join(markdown([[*map(escaped, row)] for row in rows], right))


def _where(page: str) -> str:
    # A backtick in a path would end the code span.
    return f"Pictures, maps and numbers: {escaped(page) if '`' in page else f'`{visible(page)}`'}"


# --- Lines of a check ------------------------------------------------------------------------


def lines(checks: Sequence[CheckRecord], level: float) -> Iterator[str]:
    """Yield what moved in each scene, then a table of all scenes."""
    for made in checks:
        yield from _details(made)
    if len(checks) > 1:
        yield from printed(_table(checks), right=2)
        yield ""
    yield from dict.fromkeys(filter(None, (made.other_mitsuba for made in checks)))
    yield outcome(checks, level)


def outcome(checks: Sequence[CheckRecord], level: float) -> str:
    """Return the line that says how it went."""
    statuses = [made.status for made in checks]
    count = len(checks)
    moved = statuses.count("failed")
    errors = statuses.count("error")
    written = statuses.count("created") + statuses.count("updated")
    if written or "unchanged" in statuses:
        text = f"{written} of {count} baselines written"
    else:
        # A tolerance lets pictures move a little.
        has_gates = any(made.gate for made in checks)
        bad = "failed" if has_gates else "moved"
        good = "passed" if has_gates else "unmoved"
        text = f"{moved} of {count} {bad}" if moved else f"{count - errors} of {count} {good}"
        text += f" (significance {level:g} over all that was tested)"
    return text + (f"; {errors} could not be checked" if errors else "")


def moved_lines(made: CheckRecord) -> Iterator[str]:
    """Yield the table of what moved: from, to, by how many standard errors, p-value; and causes."""
    moved = made.moved or ()
    rows: list[tuple[str, ...]] = [
        ("what moved", "baseline", "now", "change", "standard errors", "p")
    ]
    for move in moved[:SHOWN]:
        name, before, now, *certainty = move.cells()
        rows.append((name, before, now, move.change, *certainty))
    yield from printed(rows, right=2)
    if len(moved) > SHOWN:
        yield f"and {len(moved) - SHOWN} more; {made.tested} quantities were tested"
    yield from made.causes


def _details(made: CheckRecord) -> Iterator[str]:
    if made.message and made.status != "error":  # an error has its own line
        yield f"{made.name}: {made.message}"
    if not made.moved:
        return
    yield f"{made.name}: {made.status}. {made.headline}"
    yield from ("  " + line for line in moved_lines(made))
    if made.versions_line:
        yield "  " + made.versions_line
    if made.pictures is not None:
        yield f"  pictures: {made.pictures}"
    if made.status == "failed":
        yield f"  if this is meant: {made.update_command}"
    yield ""


def _table(checks: Sequence[CheckRecord]) -> Iterator[Sequence[str]]:
    yield "baseline", "result", "moved", "of", "mean ΔE2000", "now", "time"
    for made in checks:
        cells = [""] * 4
        if made.tested is not None:
            cells[:2] = f"{len(made.moved or ())}", f"{made.tested}"
        if made.metrics is not None:
            lead = made.metrics["dE2000"]
            cells[2:] = f"{lead.before:.3f}", f"{lead.after:.3f}"
        yield made.name, made.status, *cells, f"{made.seconds:.1f} s"
