"""The tables and the pictures of docs/shaders.md, from the shaders in docs/shaders."""

import runpy
from collections.abc import Iterator
from functools import partial
from textwrap import wrap
from typing import Any

from docs.figures.documents import DOCS, compared, draw, panels, replace
from docs.figures.model_figures import pictures, sheet
from fotismos.comparisons.audit import diagnosis
from fotismos.comparisons.case import open_case
from fotismos.comparisons.compare import compare
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.options import Options
from fotismos.comparisons.records.images import Comparison
from fotismos.reference.scene.source import Source
from fotismos.reports.terminal.table import Table, markdown

SHADERS = DOCS / "shaders"
NAMES = ("phong", "wrapped", "oren_nayar", "toon", "cook_torrance")
SCENES = ("lambert-sphere", "fig-8-9", "plastic-spheres")
PICTURED = SCENES[-1]
SIDE, SAMPLES = 192, 256

SPHERES = {
    ("map", "phong"): "phong",
    ("map", "harmonics"): "harmonics",
    ("map", "split_sum"): "split sum",
    ("lamps", "cook_torrance"): "points",
    ("lamps", "ltc"): "ltc",
}
"""Shaders of docs/scenes/spheres.py, by its light and their files."""


def link(name: str) -> str:
    """Return a link to a shader of docs/shaders."""
    return f"[{name.replace('_', ' ')}](shaders/{name}.py)"


def write() -> None:
    """Compare the shaders, and write their tables and pictures."""
    _write_comparisons()
    replace("shaders.md", "lamp", _lamp())
    replace("shaders.md", "mistakes", [f"- {words}" for words in diagnosis.recognised()])
    _write_spheres()


def _write_comparisons() -> None:
    """Compare each shader on each scene: the mean departure, and after the best exposure."""
    shown = []
    rows = []
    for name in NAMES:
        row = [link(name)]
        for scene in SCENES:
            comparison = _shaded(scene, name, resolution=(SIDE, SIDE), spp=SAMPLES)
            metric = comparison.record.metrics[LEADING.name]
            row.append(f"{metric.mean:.2f} ({metric.after_exposure.mean:.2f})")
            if scene == PICTURED:
                shown.append(comparison.images)
        rows.append(row)
    replace("shaders.md", "shaders", markdown(Table.of([("Shader", *SCENES), *rows])))
    row_of_pictures = [*(one.heuristic for one in shown), shown[0].reference]
    draw("shaders.png", pictures([*NAMES, "reference"], [row_of_pictures]))


def _lamp() -> Iterator[str]:
    """Yield what a representative point changes under a spherical lamp, on plastic and on metal."""
    file = SHADERS / "representative_point.py"
    bare = dict(runpy.run_path(str(file))["scene"])
    for name in ("ball 0", "ball 1", "ball 2"):
        alpha = bare[name]["bsdf"]["alpha"]
        metal = {"type": "roughconductor", "material": "none", "distribution": "ggx"}
        bare[name] = bare[name] | {"bsdf": metal | {"alpha": alpha}}
    measured = {}
    for function in (":center", ""):
        asked = Options(heuristic=f"{file}{function}", resolution=(192, 128), spp=SAMPLES)
        case = open_case(str(file), asked)
        sources = {"plastic": case.source, "metal": Source("metal", bare)}
        for kind, source in sources.items():
            metrics = compare(source, case.options).record.metrics
            measured[kind, function] = metrics["dE2000"].mean, metrics["rmse"].mean
    matt, metallic = (
        [measured[kind, function] for function in (":center", "")] for kind in ("plastic", "metal")
    )
    yield from wrap(
        "[representative_point.py](shaders/representative_point.py) uses `extent` for a lamp's"
        " highlight, after Karis (2013). Under a spherical lamp, the RMSE falls from"
        f" {matt[0][1]:.3f} to {matt[1][1]:.3f} on rough plastic, and the mean ΔE2000 from"
        f" {matt[0][0]:.2f} to {matt[1][0]:.2f}. On white metal the RMSE falls from"
        f" {metallic[0][1]:.2f} to {metallic[1][1]:.2f}, but the lobe gets too dark around the"
        f" highlight: the mean ΔE2000 rises from {metallic[0][0]:.2f} to {metallic[1][0]:.2f}.",
        width=110,
    )


def _write_spheres() -> None:
    """Compare shaders of environments and of lamps: on all spheres, the plastic and the gold."""
    scene = runpy.run_path(str(DOCS / "scenes/spheres.py"))["scene"]
    shown = []
    rows = []
    for light, name in SPHERES:
        comparison = _shaded(partial(scene, light), name, light, spp=2 * SAMPLES)
        shown.append(panels(comparison.images))
        record = comparison.record
        means = [record.metrics[LEADING.name].mean]
        for kind in ("plastic", "gold"):
            one = [region for region in record.objects if region.name.startswith(kind)]
            total = sum(region.mean_dE2000 * region.pixels for region in one)
            means.append(total / sum(region.pixels for region in one))
        rmse = record.metrics["rmse"].mean
        rows.append((link(name), light, *(f"{mean:.2f}" for mean in means), f"{rmse:.3f}"))
    head = "Shader", "Light", "all", "plastic", "gold", "RMSE"
    replace("shaders.md", "spheres", markdown(Table.of([head, *rows], right=2)))
    titles = "shader", "reference", LEADING.label
    labels = [*SPHERES.values()]
    drawn = sheet(titles, shown, labels, size=(2.88, 1.16), maps=len(shown))
    draw("shaders-spheres.webp", drawn)


def _shaded(scene: object, shader: str, name: str | None = None, **options: Any) -> Comparison:
    return compared(scene, name, heuristic=str(SHADERS / f"{shader}.py"), **options)
