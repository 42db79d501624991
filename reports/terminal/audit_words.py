"""An audit in words: its headline, and a sentence for each check."""

from collections.abc import Callable
from pathlib import Path

from comparisons.audit.audit_record import Audit, Checked
from heuristic.heuristics import in_file
from reports.terminal.printing import number

FAILURES: dict[str, Callable[[Checked], str]] = {
    "energy": lambda check: f"returns up to {number(check.value)} times the light it receives",
    "reciprocity": lambda check: "is not reciprocal",
    "horizon": lambda check: "jumps as the light sets",
    "light from below": lambda check: "shows light from behind the surface",
    "gradient": lambda check: f"has a wrong derivative {check.worst}",
    "sampling": lambda check: "is not sampled by its own density",
    "values": lambda check: "has values that no light has",
}
"""What the subject does if a check fails."""

MEANINGS = {
    "white furnace": "Under light of radiance 1 from all directions, a surface that absorbs nothing"
    " has the value 1 from everywhere. Below 1 it loses light, above 1 it is brighter than its"
    " surroundings.",
    "energy": "The share of the light from one direction that is returned in all directions. Above"
    " 1, light is created.",
    "reciprocity": "Exchanging light and viewer must not change the reflectance f. The map has the"
    " largest difference over all azimuths, relative to the mean of the two.",
    "horizon": "As the light sets, what it shows must fade without a jump. For each kind of"
    " material, this is the viewer who sees the largest one.",
    "light from below": "Light from behind an opaque surface must not show.",
    "gradient": "Dr.Jit’s derivative with respect to each number, compared with finite"
    " differences; the relative difference at nine tenths of the points is at most the one shown.",
    "sampling": "The directions drawn must have the density that the BSDF states.",
    "values": "Every value must be finite, and 0 or more: here, and wherever another check looked.",
}
"""What each check asks, for readers of the page."""


def titled(record: Audit) -> str:
    """Return a short name of the subject, with the parameters that were given."""
    found = in_file(record.subject)
    name = record.subject
    if found:
        name = f"{found[1]} ({Path(found[0]).name})" if found[1] else Path(found[0]).name
    return ", ".join([name, *(f"{key} {value}" for key, value in record.parameters.items())])


def headline(record: Audit) -> str:
    """Return a sentence that says what is wrong, the gravest first, or that nothing is."""
    failed = {check.name: check for check in record.checks if check.verdict == "does not hold"}
    told = [words(failed[name]) for name, words in FAILURES.items() if name in failed]
    if "white furnace" in failed:
        told.insert("energy" in failed, _furnace(failed["white furnace"]))
    if not told:
        return f"{titled(record)} conserves energy, is reciprocal, and fades as the light sets"
    *others, last = told
    return f"{titled(record)} {', '.join(others)}{' and ' if others else ''}{last}"


def _furnace(check: Checked) -> str:
    value = check.value or 0.0
    if value > 1:
        return f"looks up to {number(value)} times as bright as its surroundings"
    return f"loses up to {number(100 * (1 - value))} % of the light"


def found(value: float | None) -> str:
    """Return the value found; a count has no decimals."""
    return f"{value:g}" if value is not None and value == int(value) else number(value)
