"""An audit in words: its verdict, and a table of the checks."""

from collections.abc import Iterator
from pathlib import Path

from comparisons.audit.checks import Audit, Checked
from heuristic.heuristics import in_file
from reports.terminal import tables
from reports.terminal.words import number


def headline(record: Audit) -> str:
    """Return the subject with its parameters, and which checks failed."""
    name = record.subject
    if place := in_file(name):
        file = Path(place[0]).name
        name = f"{place[1]} ({file})" if place[1] else file
    title = ", ".join([name, *(f"{key} {value}" for key, value in record.parameters.items())])
    failed = [check.name for check in record.checks if check.verdict == "does not hold"]
    if not failed:
        return f"{title}: all that was asked holds"
    return f"{title}: {', '.join(failed)} {'does' if len(failed) == 1 else 'do'} not hold"


def value_of(check: Checked) -> str:
    """Return the value of a check; a count has no decimals."""
    value = check.value
    return f"{value:g}" if value is not None and value == int(value) else number(value)


def lines(record: Audit) -> Iterator[str]:
    """Yield the lines of an audit."""
    yield headline(record)
    yield ""
    rows = [
        (check.name, check.verdict, value_of(check), check.expected, check.worst)
        for check in record.checks
    ]
    yield from tables.printed([("check", "verdict", "found", "expected", "worst case"), *rows])
    if record.mistakes:
        yield from ("", *record.mistakes)
