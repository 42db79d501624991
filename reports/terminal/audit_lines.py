"""An audit in words: a table of its checks."""

from collections.abc import Iterator, Sequence

from comparisons.audit.audit_record import Audit
from reports.terminal import tables
from reports.terminal.audit_words import found


def lines(record: Audit) -> Iterator[str]:
    """Yield the lines of an audit."""
    given = ", ".join(f"{name} = {value}" for name, value in record.parameters.items())
    yield f"{record.subject}{given and ', '}{given}: {verdict(record)}"
    yield ""
    yield from tables.printed(_rows(record))
    if record.suspicions:
        yield from ("", *record.suspicions)


def verdict(record: Audit) -> str:
    """Return a phrase that names the checks that failed."""
    failed = [check.name for check in record.checks if check.verdict == "does not hold"]
    if not failed:
        return "all that was asked holds"
    return f"{', '.join(failed)} {'does' if len(failed) == 1 else 'do'} not hold"


def _rows(record: Audit) -> Iterator[Sequence[str]]:
    yield "check", "verdict", "found", "expected", "worst case"
    for check in record.checks:
        yield check.name, check.verdict, found(check.value), check.expected, check.worst
