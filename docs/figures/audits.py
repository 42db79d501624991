"""The content of docs/audit.md: audits of shaders and of some Mitsuba BSDFs."""

from collections.abc import Iterator
from typing import Any

import fotismos  # noqa: F401  isort: skip  it finds LLVM before Dr.Jit is imported

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from docs.figures.from_tests import ROOT
from fotismos.comparisons.audit.checks import Audit, Checked, audit
from fotismos.comparisons.audit.furnace import single_scattering
from fotismos.reports.terminal.tables import markdown
from fotismos.reports.terminal.words import number, percent

SHADERS = ROOT / "docs/shaders"
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

GITHUB = "https://github.com/"
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


def audits() -> dict[str, Audit]:
    """Return all audits, by their names in the table."""
    found = {name: audit("heuristic", name, {}) for name in (PICTURED, "blinn")}
    for name in SHADED:
        link = f"[{name.replace('_', ' ')}](shaders/{name}.py)"
        found[link] = audit("heuristic", str(SHADERS / f"{name}.py"), {})
    return found | bsdfs()


def bsdfs() -> dict[str, Audit]:
    """Return the audits of :data:`BSDFS`, by their names in the table."""
    found = {}
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


def threads(found: dict[str, Audit], bsdfs: dict[str, Audit]) -> Iterator[str]:
    """Yield the table of threads: what each claims, and numbers from the audits."""

    def at(form: str, material: str, *degrees: float) -> list[str]:
        record = found[form]
        (curve,) = (each for each in record.curves if each.material == material)
        return [f"{curve.returned[record.angles.index(each)]:.2f}" for each in degrees]

    def most(form: str, kind: str) -> float:
        return max(max(c.returned) for c in found[form].curves if c.material.startswith(kind))

    def inside(title: str) -> float:
        return bsdfs[title].curves[0].returned[-1]

    smooth, rough = "glossy, alpha 0.1", "glossy, alpha 1"
    phong, gltf, layered = "three.js, MeshPhong", "glTF, Fresnel’s mix", "layered by albedo"
    plastic = (each for each in found[layered].curves if "glossy" in each.material)
    seen = [value for each in plastic for value in each.seen]
    changed = found[layered].named("reciprocity").value or 0.0
    cases = (three_js(*each) for each in ((0.5, 0.5), (0.75, 0.5), (1, 0.5), (1, 1)))
    tables = zip(*cases, strict=True)
    single, before, after = (", ".join(f"{value:.2f}" for value in each) for each in tables)
    mixed = [at(form, "mixed, alpha 0.1", 0)[0] for form in (gltf, layered)]
    apart = np.mean([float(at(gltf, f"{kind}, alpha 0.1", 0)[0]) for kind in ("glossy", "metal")])
    whole, half = (inside(f"`principled`, roughness 0.5, spec_trans {s}") for s in ("1", "0.5"))
    rows = (
        ({"three.js #9248": "mrdoob/three.js/issues/9248"},
         "MeshPhong's lobe takes no light from the base.",
         f"White plastic returns {most(phong, 'glossy'):.2f} at most; a white metal of `alpha` 0.1"
         f" loses far more: it returns {at(phong, 'metal, alpha 0.1', 60)[0]} at 60°."),
        ({"three.js #32101": "mrdoob/three.js/pull/32101",
          "Filament #10140": "google/filament/issues/10140"},
         "If base and lobe are just added, surfaces are too bright.",
         "White plastic of `alpha` 0.1 returns {} at 0°, {} at 80° and {} at 89°.".format(
             *at("Filament", smooth, 0, 80, 89))),
        ({"three.js #33985": "mrdoob/three.js/pull/33985"},
         "Weighting the base by 1 − F(V.H), as glTF does, conserves energy.",
         "Up to 45°: {}. At 80° {} remains, at 89° {}.".format(*at(gltf, smooth, 45, 80, 89))),
        ({"three.js #33983": "mrdoob/three.js/pull/33983"},
         "The lobe times 1 + F0 (1/E − 1) returns what one reflection loses.",
         f"Its four cases, to 0.01: one reflection {single}; before {before}; after {after}. The"
         " rest is lost because E's 16 × 16 texels end before a roughness of 1."),
        ({"bevy #24246": "bevyengine/bevy/pull/24246",
          "Godot #123428": "godotengine/godot/pull/123428"},
         "What lies between plastic and metal loses energy.",
         f"With one F0 for both, half metal of `alpha` 0.1 returns {mixed[0]} (glTF) and"
         f" {mixed[1]} (layered) at 0°; shaded apart, then mixed, {apart:.2f}."),
        ({"bevy #24552": "bevyengine/bevy/pull/24552"},
         "Burley's base may account for the light that the lobe takes.",
         "On smooth plastic in part: {}, not {}, at 80°. On rough plastic it adds: {}, not {}, at"
         " 89°.".format(*at("bevy", smooth, 80), *at("Filament", smooth, 80),
                        *at("bevy", rough, 89), *at("Filament", rough, 89))),
        ({"bevy #23818": "bevyengine/bevy/pull/23818"},
         "Giving the base what the lobe's albedo leaves conserves energy, but is not reciprocal.",
         f"White plastic shows {min(seen):.2f} to {max(seen):.2f}, the best of the five; *f*"
         f" changes by up to {percent(changed)} if light and viewer are exchanged."),
        ({"mitsuba3 #465": "mitsuba-renderer/mitsuba3/issues/465"},
         "`principled` loses light from within if `spec_trans` is between 0 and 1.",
         f"In Mitsuba 3.9.1, `roughness` 0.5: at normal incidence {half:.2f} remains with 0.5,"
         f" {whole:.2f} with 1."),
    )  # fmt: skip
    linked = [
        (", ".join(f"[{name}]({GITHUB}{place})" for name, place in links.items()), *words)
        for links, *words in rows
    ]
    yield from markdown([("Thread", "Its claim, in our words", "The numbers"), *linked], right=3)


def three_js(roughness: float, cosine: float) -> tuple[float, float, float]:
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


def table(found: dict[str, Audit]) -> Iterator[str]:
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
