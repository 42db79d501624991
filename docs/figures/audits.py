"""The content of docs/audit.md: audits of shaders and of some Mitsuba BSDFs."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from docs.figures.documents import DOCS, replace, write_table
from docs.figures.examples import link
from fotismos.comparisons import atomic
from fotismos.comparisons.audit.checks import Audit, Checked, audit
from fotismos.comparisons.audit.furnace import single_scattering
from fotismos.heuristic import plugins
from fotismos.reports.charts import vega
from fotismos.reports.run import audit_files
from fotismos.reports.terminal.table import Table, markdown
from fotismos.reports.terminal.words import number

SHADERS = DOCS / "shaders"
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
BSDFS: tuple[Any, ...] = (
    ("diffuse", {}),
    ("roughplastic", {"alpha": 0.1}),
    ("roughplastic", {"alpha": 0.5}),
    ("roughconductor", {"alpha": 0.3}),
    ("principled", {"roughness": 0.5}),
    ("roughdielectric", {"alpha": 0.3}),
    ("principled", {"roughness": 0.5, "spec_trans": 0.5}),
    ("principled", {"roughness": 0.5, "spec_trans": 1.0}),
)

CASES = ((0.5, 0.5), (0.75, 0.5), (1, 0.5), (1, 1))
"""Roughness and N.V of the cases of three.js #33983."""


def write() -> None:
    """Audit the shaders, some BSDFs, and the lobes of engines."""
    plugins.register()
    shaders = {name: audit("heuristic", name, {}) for name in (PICTURED, "blinn")}
    for name in SHADED:
        shaders[link(name)] = audit("heuristic", str(SHADERS / f"{name}.py"), {})
    bsdfs = {}
    for plugin, given in BSDFS:
        words = "".join(f", {name} {value:g}" for name, value in given.items())
        bsdfs[f"`{plugin}`{words}"] = audit("bsdf", plugin, given)
    engines = {name: audit("heuristic", str(SHADERS / file), {}) for name, file in ENGINES.items()}
    replace("audit.md", "audits", _failures(shaders | bsdfs))
    atomic.write(DOCS / "audit.svg", vega.paper(audit_files.lobes(shaders[PICTURED])))
    rows = [
        (f"[{name}](shaders/{ENGINES[name].partition(':')[0]})",
         *(_cell(record.named(check)) for check in ARGUED))
        for name, record in engines.items()
    ]  # fmt: skip
    replace("audit.md", "engines", markdown(Table.of([("Form", *ARGUED), *rows])))
    write_table("lobes", _lobes(engines | bsdfs))
    head = "roughness", "N.V", "one reflection", "before", "after"
    cases = ((*case, *(f"{shown:.2f}" for shown in _three_js(*case))) for case in CASES)
    write_table("three-js", [head, *cases])


def _failures(found: Mapping[str, Audit]) -> Iterator[str]:
    """Yield a line for each subject: the worst value of each check that does not hold."""
    for title, record in found.items():
        failed = [
            f"{check.name} {number(check.value)}"
            for check in record.checks
            if check.verdict == "does not hold"
        ]
        yield f"- {title}: {', '.join(failed) or 'all hold'}"


def _cell(check: Checked) -> str:
    if check.verdict == "does not hold":
        return number(check.value)
    return {"holds": "holds", "not asked": "–"}[check.verdict]


def _lobes(found: Mapping[str, Audit]) -> Iterator[tuple[str, ...]]:
    """Yield what each white material shows in the furnace, and returns, over angles in degrees."""
    yield "form", "material", "angle", "seen", "returned"
    for form, record in found.items():
        for curve in record.curves:
            for angle, seen, returned in zip(
                record.angles, curve.seen, curve.returned, strict=True
            ):
                yield form, curve.material, f"{angle:g}", f"{seen:.2f}", f"{returned:.2f}"


def _three_js(roughness: float, cosine: float) -> tuple[float, float, float]:
    """Return what a white metal shows by three.js: one reflection, and before and after #33983.

    Both read the lobe's albedo E from a texture of 16 by 16 texels.
    """
    texels = (np.arange(16) + 0.5) / 16
    shown = [[_albedo(each, cosine) for cosine in texels] for each in texels]
    read = RegularGridInterpolator((texels, texels), shown)

    def texture(cosines: np.ndarray) -> np.ndarray:
        places = np.stack(np.broadcast_arrays(roughness, cosines), axis=-1)
        return read(np.clip(places, texels[0], texels[-1]))

    nodes, weights = np.polynomial.legendre.leggauss(64)
    cosines, weights = (nodes + 1) / 2, weights / 2
    viewer, light = texture(np.array(cosine)), texture(cosines)
    lost = (1 - viewer) * (1 - light)
    added = 2 * np.pi * weights @ (cosines * viewer * light * lost / (1 - lost))
    single = _albedo(roughness, cosine)
    return single, single + float(added), single / float(viewer[0])


def _albedo(roughness: float, cosine: float) -> float:
    return single_scattering(float(roughness**2), float(np.rad2deg(np.arccos(cosine))))
