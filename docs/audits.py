"""The content of docs/audit.md: audits of shaders and of some Mitsuba BSDFs."""

from collections.abc import Iterator
from pathlib import Path

import heuristic  # noqa: F401  isort: skip  it finds LLVM before Dr.Jit is imported

from comparisons.audit.checks import Audit, Checked, audit
from reports.terminal.tables import markdown
from reports.terminal.words import number

SHADERS = Path(__file__).parent / "shaders"
PICTURED = "phong"
SHADED = ("cook_torrance", "oren_nayar", "toon", "wrapped")
ENGINES = {
    "three.js, MeshPhong": "mesh_phong.py",
    "Filament": "standard_material.py:filament",
    "bevy": "standard_material.py:bevy",
    "glTF, Fresnel’s mix": "standard_material.py:gltf",
    "layered by albedo": "standard_material.py:layered",
}
"""Lobes of engines, by their published formulas."""

ARGUED = ("white furnace", "energy", "reciprocity")
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
    for name in SHADED:
        link = f"[{name.replace('_', ' ')}](shaders/{name}.py)"
        found[link] = audit("heuristic", str(SHADERS / f"{name}.py"), {})
    for plugin, given in BSDFS:
        words = "".join(f", {name} {value:g}" for name, value in given.items())
        found[f"`{plugin}`{words}"] = audit("bsdf", plugin, given)
    return found


def engines() -> dict[str, Audit]:
    """Return the audits of :data:`ENGINES` by their names."""
    return {name: audit("heuristic", str(SHADERS / file), {}) for name, file in ENGINES.items()}


def argued(found: dict[str, Audit]) -> Iterator[str]:
    """Yield the table of engines: *holds*, or the worst value found."""
    rows = [
        (f"[{name}](shaders/{ENGINES[name].partition(':')[0]})",
         *(_cell(record.named(check)) for check in ARGUED))
        for name, record in found.items()
    ]  # fmt: skip
    yield from markdown([("Form", *ARGUED), *rows], right=1)


def table(found: dict[str, Audit]) -> Iterator[str]:
    """Yield the table of checks that do not hold for all: *holds*, or the worst value found."""
    first = next(iter(found.values()))
    names = [check.name for check in first.checks]
    shown = [
        name
        for name in names
        if any(record.named(name).verdict == "does not hold" for record in found.values())
    ]
    rows = [
        (title, *(_cell(record.named(name)) for name in shown)) for title, record in found.items()
    ]
    yield from markdown([("", *shown), *rows], right=1)
    yield ""
    yield f"Hold for all: {', '.join(name for name in names if name not in shown)}."


def _cell(check: Checked) -> str:
    if check.verdict == "does not hold":
        return number(check.value)
    return {"holds": "holds", "not asked": "–"}[check.verdict]
