"""The tables and the picture of docs/shaders.md, from the shaders in docs/shaders."""

import runpy
from collections.abc import Iterator
from functools import partial
from textwrap import wrap

import fotismos  # noqa: F401  isort: skip  it finds LLVM before Dr.Jit is imported

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from docs.figures import model_figures
from docs.figures.from_tests import ROOT, fact
from fotismos.comparisons.case import open_case
from fotismos.comparisons.compare import compare
from fotismos.comparisons.comparison import Comparison
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.options import Options
from fotismos.reference.scene.source import Source
from fotismos.reports.charts import figures
from fotismos.reports.files import images
from fotismos.reports.terminal.tables import markdown

SHADERS = ROOT / "docs/shaders"
NAMES = ("phong", "wrapped", "oren_nayar", "toon", "cook_torrance")
SCENES = ("lambert-sphere", "fig-8-9", "plastic-spheres")
PICTURED = SCENES[-1]
SIDE, SAMPLES = 192, 256

SPHERES = {
    ("map", "phong"): "phong",
    ("map", "harmonics"): "harmonics",
    ("map", "split_sum"): "split sum",
    ("lamps", "cook_torrance"): "lamps as points",
    ("lamps", "ltc"): "lamps by ltc",
}
"""Shaders of docs/scenes/spheres.py, by its light and their files."""


def comparisons() -> dict[tuple[str, str], Comparison]:
    """Compare each shader on each scene; keys are the names of both."""
    return {(name, scene): _compared(name, scene) for name in NAMES for scene in SCENES}


def table(found: dict[tuple[str, str], Comparison]) -> Iterator[str]:
    """Yield the table of departures: the mean, its noise, and the mean after the best exposure."""
    rows = [(_link(name), *(_cell(found[name, scene]) for scene in SCENES)) for name in NAMES]
    yield from markdown([("Shader", *SCENES), *rows], right=1)


def pictures(found: dict[tuple[str, str], Comparison]) -> dict[str, np.ndarray]:
    """Return the images of one scene, by shader."""
    shown = {name: found[name, PICTURED].images.heuristic for name in NAMES}
    return shown | {"reference": found[NAMES[0], PICTURED].images.reference}


def lamp() -> Iterator[str]:
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


def spheres() -> dict[tuple[str, str], Comparison]:
    """Compare shaders of environments and of lamps on spheres; keys are those of `SPHERES`."""
    scene = runpy.run_path(str(ROOT / "docs/scenes/spheres.py"))["scene"]
    found = {}
    for light, name in SPHERES:
        asked = Options(heuristic=str(SHADERS / f"{name}.py"), spp=2 * SAMPLES)
        case = open_case(partial(scene, light), asked, name=light)
        found[light, name] = compare(case.source, case.options)
    return found


def table_of_spheres(found: dict[tuple[str, str], Comparison]) -> Iterator[str]:
    """Yield the departures on the spheres: over all, over the plastic ones, and over the gold."""
    rows = []
    for (light, name), comparison in found.items():
        record = comparison.record
        means = [record.metrics[LEADING.name].mean]
        for kind in ("plastic", "gold"):
            one = [region for region in record.objects if region.name.startswith(kind)]
            total = sum(region.mean_dE2000 * region.pixels for region in one)
            means.append(total / sum(region.pixels for region in one))
        rmse = record.metrics["rmse"].mean
        rows.append((_link(name), light, *(f"{mean:.2f}" for mean in means), f"{rmse:.3f}"))
    yield from markdown([("Shader", "Light", "all", "plastic", "gold", "RMSE"), *rows], right=2)


def picture_of_spheres(found: dict[tuple[str, str], Comparison]) -> Figure:
    """Draw each shader beside the reference, and the error beside both."""
    titles = "shader", "reference", LEADING.label
    with rc_context(model_figures.STYLE):
        figure = Figure(figsize=(9.6, 1.22 * len(found) + 0.3), facecolor=model_figures.GROUND)
        grid = figure.subplots(len(found), 3)
        figure.subplots_adjust(0.03, 0, 0.93, 0.955, wspace=0.02, hspace=0.03)
        for line, (key, comparison) in zip(grid, found.items(), strict=True):
            shown = comparison.images
            error = images.error_map(shown.maps[LEADING.name], LEADING.map_range[1])
            pictures = images.tonemap(shown.heuristic), images.tonemap(shown.reference), error
            for axes, picture in zip(line, pictures, strict=True):
                axes.imshow(picture.convert("RGB"), interpolation="none", aspect="auto")
                axes.axis("off")
            line[0].text(-0.02, 0.5, SPHERES[key], rotation=90, ha="right", va="center",
                         fontsize=9, transform=line[0].transAxes)  # fmt: skip
        for axes, title in zip(grid[0], titles, strict=True):
            axes.set_title(title, pad=4)
        figures.legend(figure, figure.add_axes((0.94, 0.02, 0.012, 0.93)))
    return figure


def mistakes() -> Iterator[str]:
    """Yield the names of the mistakes that tests make on purpose."""
    yield f"{'; '.join(fact('mistakes'))}."


def _compared(name: str, scene: str) -> Comparison:
    asked = Options(heuristic=str(SHADERS / f"{name}.py"), resolution=(SIDE, SIDE), spp=SAMPLES)
    case = open_case(scene, asked)
    return compare(case.source, case.options)


def _link(name: str) -> str:
    return f"[{name.replace('_', ' ')}](shaders/{name}.py)"


def _cell(comparison: Comparison) -> str:
    metric = comparison.record.metrics[LEADING.name]
    return f"{metric.mean:.2f} ({metric.after_exposure.mean:.2f})"
