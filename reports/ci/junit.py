"""The results of checks as JUnit XML, which CI services show as tests."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from reports.ci import lines

if TYPE_CHECKING:
    from reports.ci.checks import Result
    from reports.ci.gates import Outcome

NOT_IN_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def document(results: Sequence[Result]) -> bytes:
    """Return the XML document, one test case for each baseline."""
    statuses = [result.status for result in results]
    totals = {
        "name": "fotismos check",
        "tests": str(len(results)),
        "failures": str(statuses.count("failed")),
        "errors": str(statuses.count("error")),
        "time": f"{sum(result.seconds for result in results):.3f}",
    }
    root, suite = _roots(totals, skipped=0)
    for result in results:
        names = {"name": clean(result.name), "file": clean(result.path.as_posix())}
        time = f"{result.seconds:.3f}"
        case = SubElement(suite, "testcase", names, classname="fotismos.check", time=time)
        if result.status == "failed" and result.check:
            failure = SubElement(case, "failure", message=headline(result), type="moved")
            failure.text = clean("\n".join(lines.moved_lines(result.check)))
        elif result.status == "error":
            error = SubElement(case, "error", message=headline(result), type="error")
            error.text = headline(result)
    return _written(root)


def of_gates(outcomes: Sequence[Outcome]) -> bytes:
    """Return the XML document of a comparison's gates, one test case for each."""
    states = [outcome.state for outcome in outcomes]
    totals = {
        "name": "fotismos compare",
        "tests": str(len(outcomes)),
        "failures": str(states.count("failed")),
        "errors": "0",
    }
    root, suite = _roots(totals, skipped=states.count("undetermined"))
    for outcome in outcomes:
        name = clean(f"{outcome.scene}, {outcome.gate}")
        case = SubElement(suite, "testcase", name=name, classname="fotismos.compare")
        kind = {"failed": "failure", "undetermined": "skipped"}.get(outcome.state)
        if kind:
            SubElement(case, kind, message=clean(str(outcome)))
    return _written(root)


def _roots(totals: dict[str, str], skipped: int) -> tuple[Element, Element]:
    """Return the root of a document, and its one suite."""
    root = Element("testsuites", totals)
    return root, SubElement(root, "testsuite", totals, skipped=str(skipped))


def _written(root: Element) -> bytes:
    indent(root)
    return tostring(root, encoding="utf-8", xml_declaration=True)


def headline(result: Result) -> str:
    """Return one line on a baseline that did not pass."""
    if result.check is None:
        return clean(result.message)
    first, *others = result.check.moved
    more = f", and {len(others)} more" if others else ""
    return clean(
        f"{first.quantity} moved from {first.before:.6g} to {first.after:.6g}"
        f" (p = {first.p_corrected:.1g}){more}"
    )


def clean(text: str) -> str:
    """Return text with "�" for characters that XML and UTF-8 forbid; file names may have them."""
    return NOT_IN_XML.sub("�", text)
