"""Error and time of flat, Gouraud and Phong shading against the density of the mesh.

The sphere of figure 6.10 is seen so near that no outline shows: what is left is shading. All
meshes, and the sphere itself, are rendered in turn, with the same samples.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from docs.figures import documents
from docs.figures.model_figures import COLOURS, GROUND, STYLE, quiet
from fotismos.comparisons import turns
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.gallery import scenes
from fotismos.comparisons.ladder import climb
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.comparisons.turns import Time
from fotismos.heuristic.heuristics import Interpolation
from fotismos.reference.records import Interval
from fotismos.reference.rendering.renderer import Renderer
from fotismos.reference.rendering.sums import Accumulator
from fotismos.reference.scene.source import Source
from fotismos.reports.terminal.words import number

FINENESS = (2, 4, 8, 16, 32, 64)
"""Edges per quarter turn."""

SIDE, SPP, ROUNDS = 128, 64, 7
FIELD_OF_VIEW = 16.0
EXACT = "sphere"

MARKS = {
    Interpolation.FLAT: (COLOURS["L"], "s", "flat"),
    Interpolation.GOURAUD: (COLOURS["R"], "o", "Gouraud"),
    Interpolation.PHONG: (COLOURS["V"], "^", "Phong"),
}


@dataclass(frozen=True)
class Density:
    """One shading of a mesh: mean ΔE2000 to the sphere, and time per sample over the sphere's."""

    shading: Interpolation
    faces: int
    error: float
    ratio: Interval


def near_sphere() -> dict:
    """Return figure 6.10 through a longer lens."""
    scene = scenes.coarse_sphere()
    scene["sensor"]["fov"] = FIELD_OF_VIEW
    return scene


def write() -> None:
    """Measure, and write the chart and its sentences."""
    found = measured()
    documents.draw("models-density.svg", chart(found))
    documents.replace("models.md", "density", sentences(found))


def measured() -> list[Density]:
    """Render all meshes and the sphere itself in turn."""
    source, options = Source(EXACT, near_sphere), Options(resolution=(SIDE, SIDE))
    ready = prepare(source, options)
    kernel = replace(ready, reference=ready.heuristic, scene=ready.heuristic.scene)
    total = Accumulator()
    climb.converge(kernel, total, climb.REFERENCE_PASSES)
    distances = LEADING.against(total.mean(), ready.counted, options.viewing)
    firsts = {EXACT: ready.heuristic.sampled(SPP)}
    meshes: dict[str, tuple[Interpolation, int]] = {}
    for n in FINENESS:
        for shading in MARKS:
            changed = options.changed(interpolation=shading.value, tessellation=n)
            renderer: Renderer = prepare(source, changed).heuristic
            name = f"{shading.value} {n}"
            firsts[name] = renderer.sampled(SPP)
            meshes[name] = shading, renderer.scene.shapes()[0].face_count()
    errors: dict[str, list[float]] = {name: [] for name in meshes}
    for images in turns.in_turn(firsts, options.seed, ROUNDS):
        for name, found in errors.items():
            found.append(LEADING.mean(distances(np.array(images[name]))))
    times = {name: Time.of(half, (SIDE, SIDE), ROUNDS) for name, half in firsts.items()}
    return [
        Density(*mesh, float(np.mean(errors[name])), turns.ratio(times[name], times[EXACT]))
        for name, mesh in meshes.items()
    ]


def chart(found: Sequence[Density]) -> Figure:
    """Draw the errors against the number of faces, and against time."""
    with rc_context(STYLE):
        figure = Figure(figsize=(6, 3.4), facecolor=GROUND, layout="constrained")
        faces, time = figure.subplots(1, 2, sharey=True)
        for shading, (colour, shape, label) in MARKS.items():
            own = [one for one in found if one.shading is shading]
            errors, ratios = [one.error for one in own], [one.ratio for one in own]
            style = {"color": colour, "marker": shape, "label": label}
            faces.loglog([one.faces for one in own], errors, **style)
            ends = np.abs([(one.low - one.value, one.high - one.value) for one in ratios]).T
            time.errorbar([one.value for one in ratios], errors, xerr=ends, **style)
        faces.set(xlabel="faces", ylabel="mean ΔE2000 to the sphere's image")
        time.set(xlabel="time per sample, sphere = 1")
        faces.yaxis.set_major_formatter("{x:g}")
        for axes in (faces, time):
            quiet(axes)
        faces.legend(frameon=False)
    return figure


def sentences(found: Sequence[Density]) -> Iterator[str]:
    """Yield what was measured."""
    flat, gouraud, phong = ([one for one in found if one.shading is kind] for kind in MARKS)
    errors = (
        f"{row[0].faces:,} faces {', '.join(number(one.error) for one in row)}"
        for row in [(flat[i], gouraud[i], phong[i]) for i in (0, len(flat) // 2, -1)]
    )
    yield f"Mean ΔE2000 of flat, Gouraud and Phong shading: with {'; with '.join(errors)}."
    enough = [one.faces for one in gouraud if one.error <= phong[0].error]
    if enough:
        yield (
            f"Gouraud shading needs {min(enough):,} faces to be as near as Phong shading with"
            f" {phong[0].faces}."
        )
    times = [one.ratio.value / other.ratio.value for one, other in zip(gouraud, phong, strict=True)]
    yield (
        f"On the same mesh a sample of Gouraud shading takes {min(times):.2g} to"
        f" {max(times):.2g} times as long: with one light, interpolating stored intensities is no"
        " cheaper than shading."
    )
