"""What CI and people read of a run: gates, JUnit XML, a summary in Markdown, lines of a check."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import click

from fotismos.comparisons import atomic
from fotismos.comparisons.departure.criterion import TOLERANCE
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.records.comparison import ComparisonRecord
from fotismos.comparisons.records.departure import Gate, Verdict
from fotismos.heuristic.errors import FotismosError, InputError, OutputError
from fotismos.reports import verdict
from fotismos.reports.tables import SHOWN, moved
from fotismos.reports.terminal.table import Column, Table, escaped, markdown, printed
from fotismos.reports.terminal.words import echo, is_quiet, number, percent, tell, visible

if TYPE_CHECKING:
    from fotismos.comparisons.records.check import CheckRecord
    from fotismos.reports.jobs import Terminal
    from fotismos.reports.page.scene_view import SceneView

STEP_SUMMARY = "GITHUB_STEP_SUMMARY"
"""The variable with the file whose Markdown GitHub, Forgejo and Gitea show."""

JUNIT_HEAD = b"<?xml version='1.0' encoding='utf-8'?>\n<testsuites name=\"fotismos "
"""How JUnit files of fotismos begin."""

# XML 1.0 forbids all other characters, even as references; a lone surrogate is no UTF-8 either.
NOT_IN_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


# --- Gates -----------------------------------------------------------------------------------


GATES = (
    Column("scene", "scene"),
    Column("at most", "bound", percent, is_right=True),
    Column("pixels that differ", "visible.value", percent, is_right=True),
    Column("from", "visible.low", percent, is_right=True),
    Column("to", "visible.high", percent, is_right=True),
    Column("result", "state", is_right=True),
)
"""The table of gates."""


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
            visible=verdict.share(record, threshold),
            state=verdict.decision(record, threshold, bound),
        )
        for record in records
    ]


def sentence(gate: Gate) -> str:
    """Return what differs, what is allowed, and the result."""
    share = gate.visible
    shown = percent(share.value)
    if share.low != share.high:
        shown += f" ({percent(share.low)} to {percent(share.high)})"
    results: dict[Verdict, str] = {
        "pass": "it passes",
        "fail": "it fails",
        "undecided": "it is undecided, and more samples or repeats decide",
    }
    return (
        f"{shown} of the pixels differ by more than {LEADING.label} {share.threshold:g}, at most"
        f" {percent(gate.bound)} may: {results[gate.state]}."
    )


def gate_lines(gates: Sequence[Gate]) -> Iterator[str]:
    """Yield the lines on the gates of a run."""
    yield ""
    yield from printed(Table(GATES, gates))
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


def conclude(
    terminal: Terminal,
    folder: Path,
    views: Sequence[SceneView],
    errors: Mapping[str, FotismosError],
) -> int:
    """Print the gates of a comparison, write its files for CI, and return the exit code."""
    require_free(terminal.junit, terminal.summary, [])  # nor what this command wrote
    studied = [view.studied for view in views]
    found = gates([record for record, _ in studied], terminal.max_visible, terminal.within)
    code = int(any(gate.state != "pass" for gate in found))
    for line in gate_lines(found) if found else ():
        if code or not is_quiet():  # the reason of a failure is never lost
            echo(line, err=is_quiet())
    write_junit(terminal.junit, lambda: junit_of_gates(found, errors))
    page = str(folder / "index.html") if views else ""
    append(
        terminal.summary,
        lambda: of_comparison(studied, found, errors=errors, page=page, threshold=terminal.within),
    )
    return code


def conclude_checks(
    outcomes: Sequence[CheckRecord], terminal: Terminal, significance: float, page: str
) -> int:
    """Print what checks or updates found, unless as JSON, and write files for CI.

    Returns the exit code.
    """
    for record in outcomes:
        if record.status == "error":
            echo(f"fotismos: error: {record.message}", err=True)
    write_junit(terminal.junit, lambda: junit_of_checks(outcomes))
    append(terminal.summary, lambda: of_checks(outcomes, significance, page))
    # 2, could not be checked, outweighs 1, moved.
    code = max(record.exit_code for record in outcomes)
    if not (is_quiet() or terminal.as_json):
        tell(lines(outcomes, significance))
        if page:
            click.echo(f"page: {page}")
    elif code and not terminal.as_json:
        click.echo(outcome(outcomes, significance))
    return code


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
    for record in checks:
        names = {"name": record.name, "file": record.baseline, "time": f"{record.seconds:.3f}"}
        case = _element("testcase", {**names, "classname": "fotismos.check"})
        if record.status == "failed":
            failure = _element("failure", {"message": record.headline, "type": "moved"})
            failure.text = _clean("\n".join(moved_lines(record)))
            case.append(failure)
        elif record.status == "error":
            case.append(_element("error", {"message": record.message, "type": "error"}))
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
            case.append(_element("failure", {"message": sentence(gate), "type": gate.state}))
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
    rows: list[tuple[str, ...]] = [
        ("Scene", "Pixels that differ", f"Mean {LEADING.label}", "What makes it look right")
    ]
    for record, cost in scenes:
        wanted = (verdict.cause(record), verdict.sentence(record, cost, threshold))
        sentences = " ".join(filter(None, (*record.mistakes, *wanted)))
        share = percent(verdict.share(record, threshold).value)
        rows.append((record.scene, share, number(record.metrics[LEADING.name].mean), sentences))
    records = [record for record, _ in scenes]
    first = verdict.headline(records, threshold)
    second = verdict.most_missing(records, threshold)
    parts = ["### fotismos compare", escaped(f"{first} {second}".strip())]
    parts.append(_marked_down(Table.of(rows)))
    if gates:
        parts += [_marked_down(Table(GATES, gates)), gate_outcome(gates)]
    parts += [escaped(f"{name}: {error}") for name, error in errors.items()]
    parts += [_where(page)] if page else []
    # The next summary may be appended to the same file.
    return "\n\n".join(parts) + "\n\n"


def of_checks(checks: Sequence[CheckRecord], level: float, page: str) -> str:
    """Return the summary of checks; ``page`` is empty if none was written."""
    parts = [
        "### fotismos check",
        outcome(checks, level),
        _marked_down(Table(MOST_MOVED, checks)),
    ]
    parts += [
        escaped(f"{record.name}: {' '.join(record.causes)}") for record in checks if record.causes
    ]
    return "\n\n".join([*parts, *([_where(page)] if page else ())]) + "\n\n"


def _marked_down(table: Table) -> str:
    rows = [[escaped(cell) for cell in row] for row in table.texts()]
    return "\n".join(markdown(table, rows))


def _where(page: str) -> str:
    # A backtick in a path would end the code span.
    return f"Pictures, maps and numbers: {escaped(page) if '`' in page else f'`{visible(page)}`'}"


# --- Lines of a check ------------------------------------------------------------------------


def lines(checks: Sequence[CheckRecord], level: float) -> Iterator[str]:
    """Yield what moved in each scene, then a table of all scenes."""
    for record in checks:
        yield from _details(record)
    if len(checks) > 1:
        yield from printed(Table(CHECKED, checks))
        yield ""
    yield from dict.fromkeys(filter(None, (record.other_mitsuba for record in checks)))
    yield outcome(checks, level)


def outcome(checks: Sequence[CheckRecord], level: float) -> str:
    """Return the line that says how it went."""
    statuses = [record.status for record in checks]
    count = len(checks)
    moved = statuses.count("failed")
    errors = statuses.count("error")
    written = statuses.count("created") + statuses.count("updated")
    if written or "unchanged" in statuses:
        text = f"{written} of {count} baselines written"
    else:
        # A tolerance lets pictures move a little.
        has_gates = any(record.gate for record in checks)
        bad = "failed" if has_gates else "moved"
        good = "passed" if has_gates else "unmoved"
        text = f"{moved} of {count} {bad}" if moved else f"{count - errors} of {count} {good}"
        text += f" (significance {level:g} over all that was tested)"
    return text + (f"; {errors} could not be checked" if errors else "")


def moved_lines(record: CheckRecord) -> Iterator[str]:
    """Yield the table of what moved, by how much and how certain that is; and causes."""
    yield from printed(moved(record))
    others = len(record.moved or ()) - SHOWN
    if others > 0:
        yield f"and {others} more; {record.tested} means were tested"
    yield from record.causes


def _details(record: CheckRecord) -> Iterator[str]:
    if record.moved:
        yield f"{record.name}: {record.status}. {record.headline}"
    if record.message and record.status != "error":  # an error has its own line
        yield f"{record.name}: {record.message}"
    if not record.moved:
        return
    yield from ("  " + line for line in moved_lines(record))
    if record.versions_line:
        yield "  " + record.versions_line
    if record.pictures is not None:
        yield f"  pictures: {record.pictures}"
    if record.status == "failed":
        yield f"  if this is meant: {record.update_command}"
    yield ""


def _lead(end: str) -> Callable[[CheckRecord], float | str]:
    """Return what shows the leading metric ``before`` or ``after``; of pictures it has none."""
    return lambda record: (
        "" if record.metrics is None else getattr(record.metrics[LEADING.name], end)
    )


def _moved(record: CheckRecord) -> int | str:
    return "" if record.tested is None else len(record.moved or ())


def _tested(record: CheckRecord) -> int | str:
    return "" if record.tested is None else record.tested


CHECKED = (
    Column("baseline", "name"),
    Column("result", "status"),
    Column("moved", _moved, is_right=True),
    Column("of", _tested, is_right=True),
    Column(f"mean {LEADING.label}", _lead("before"), "{:.3f}".format, is_right=True),
    Column("now", _lead("after"), "{:.3f}".format, is_right=True),
    Column("time", "seconds", "{:.1f} s".format, is_right=True),
)
"""The columns of checks on a terminal."""

MOST_MOVED = (
    Column("Baseline", "name"),
    Column("Result", "status"),
    Column("What moved most", lambda record: record.headline or record.message),
    Column("Moved", _moved),
    Column("Of", _tested),
    Column(
        "p",
        lambda record: min((m.p_corrected for m in record.moved or ()), default=""),
        "{:.1g}".format,
    ),
)
"""The columns of checks in a summary."""
