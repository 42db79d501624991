"""The results of checks as JUnit XML, which CI services show as tests."""

import re
from xml.etree import ElementTree

from reports.ci import lines

NOT_IN_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def document(results):
    """Return the XML document, one test case for each baseline."""
    suite = {
        "name": "fotismos check",
        "tests": str(len(results)),
        "failures": str(sum(result.status == "failed" for result in results)),
        "errors": str(sum(result.status == "error" for result in results)),
        "skipped": "0",
        "time": f"{sum(result.seconds for result in results):.3f}",
    }
    root = ElementTree.Element("testsuites", {k: v for k, v in suite.items() if k != "skipped"})
    element = ElementTree.SubElement(root, "testsuite", suite)
    for result in results:
        _case(element, result)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)


def _case(suite, result):
    case = ElementTree.SubElement(
        suite,
        "testcase",
        name=_clean(result.name),
        classname="fotismos.check",
        file=_clean(result.path.as_posix()),
        time=f"{result.seconds:.3f}",
    )
    if result.status == "failed":
        text = "\n".join(lines.moved_lines(result.check))
        failure = ElementTree.SubElement(case, "failure", message=headline(result), type="moved")
        failure.text = _clean(text)
    elif result.status == "error":
        message = _clean(result.message)
        error = ElementTree.SubElement(case, "error", message=message, type="error")
        error.text = message


def headline(result):
    """Return one line on a baseline that did not pass."""
    if result.check is None:
        return _clean(result.message)
    first, *others = result.check.moved
    more = f", and {len(others)} more" if others else ""
    return _clean(
        f"{first.quantity} moved from {first.before:.6g} to {first.after:.6g}"
        f" (p = {first.p_corrected:.1g}){more}"
    )


def _clean(text):
    return NOT_IN_XML.sub("�", text)
