"""The content of docs/audit.md: audits of this project's shaders and some Mitsuba BSDFs."""

from collections.abc import Iterator
from pathlib import Path

import heuristic  # noqa: F401  isort: skip  it finds LLVM before Dr.Jit is imported

from comparisons.audit.audit import audit
from comparisons.audit.audit_record import Audit, Checked
from reports.terminal.printing import number
from reports.terminal.tables import markdown

SHADERS = Path(__file__).parent / "shaders"
PICTURED = "phong"
BSDFS = (
    ("diffuse", {}),
    ("roughplastic", {"alpha": 0.1}),
    ("roughplastic", {"alpha": 0.5}),
    ("roughconductor", {"alpha": 0.3}),
    ("principled", {"roughness": 0.5}),
)


def audits() -> dict[str, Audit]:
    """Return all audits, by their names in the table."""
    found = {name: audit("heuristic", name, {}) for name in (PICTURED, "blinn")}
    for path in sorted(SHADERS.glob("*.py")):
        if path.stem != PICTURED:
            link = f"[{path.stem.replace('_', ' ')}](shaders/{path.name})"
            found[link] = audit("heuristic", str(path), {})
    for plugin, given in BSDFS:
        words = "".join(f", {name} {value:g}" for name, value in given.items())
        found[f"`{plugin}`{words}"] = audit("bsdf", plugin, given)
    return found


def table(found: dict[str, Audit]) -> Iterator[str]:
    """Yield the table of checks: *holds*, or the worst value found."""
    first = next(iter(found.values()))
    rows = [(name, *map(_cell, record.checks)) for name, record in found.items()]
    yield from markdown([("", *(check.name for check in first.checks)), *rows], right=1)


def _cell(check: Checked) -> str:
    if check.verdict == "does not hold":
        return number(check.value)
    return {"holds": "holds", "not asked": "–"}[check.verdict]
