"""An audit in words: a table of its checks."""

from collections.abc import Iterator, Sequence

from comparisons.audit.audit_record import Audit
from reports.terminal import tables
from reports.terminal.printing import number


def lines(record: Audit) -> Iterator[str]:
    """Yield the lines of an audit."""
    given = ", ".join(f"{name} = {value}" for name, value in record.parameters.items())
    yield f"{record.subject}{given and ', '}{given}: {verdict(record)}"
    yield ""
    yield from tables.printed(_rows(record))
    if record.suspicions:
        yield from ("", *record.suspicions)


def verdict(record: Audit) -> str:
    """Return in a phrase what does not hold."""
    failed = [check.name for check in record.checks if check.verdict == "does not hold"]
    return (
        f"{', '.join(failed)} do not hold"
        if len(failed) > 1
        else (f"{failed[0]} does not hold" if failed else "all that was asked holds")
    )


def _rows(record: Audit) -> Iterator[Sequence[str]]:
    yield "check", "verdict", "found", "expected", "worst case"
    for check in record.checks:
        yield check.name, check.verdict, _found(check.value), check.expected, check.worst


def _found(value: float | None) -> str:
    """Return what was found; a count has no decimals."""
    return f"{value:g}" if value is not None and value == int(value) else number(value)
