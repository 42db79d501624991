"""Time and error of flat, Gouraud and Phong shading over the number of lights, on three meshes.

Chapter 6 interpolates to save time. What a lookup saves is the sum over the lights, so the saving
grows with their number.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from docs.figures.density import MARKS, near_sphere
from docs.figures.documents import draw, replace
from docs.figures.model_figures import GROUND, STYLE, quiet
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.heuristic.heuristics import Interpolation
from fotismos.reference.rendering.passes import passes
from fotismos.reference.rendering.renderer import Renderer, warm
from fotismos.reference.scene.source import Source
from fotismos.reports.terminal.words import number

COUNTS = (1, 4, 16, 64, 256)
"""Numbers of lights."""

FINENESS = {2: ":", 8: "-", 64: "--"}
"""Edges per quarter turn, 48, 960 and 65,024 faces, and the style of their lines."""

TYPICAL = 8
"""The fineness of the mesh that the sentence is about."""

SIDE, SPP, ROUNDS = 256, 4, 7


@dataclass(frozen=True)
class ShadingCost:
    """One shading of a mesh: processor time of a picture in seconds, and its mean ΔE2000.

    The error is that from the picture of the sphere itself, by the same rays.
    """

    shading: Interpolation
    fineness: int
    faces: int
    lights: int
    seconds: float
    error: float


def lit(count: int) -> dict[str, Any]:
    """Return figure 6.10's sphere, its light divided over points on a ring around the first."""
    scene = near_sphere()
    light = scene.pop("light")
    for place, angle in enumerate(2 * np.pi * np.arange(count) / count):
        x, y, z = light["position"]
        position = (x + np.cos(angle), y, z + np.sin(angle))
        scene[f"light {place}"] = light | {"position": position, "intensity": 1 / count}
    return scene


def write() -> None:
    """Render all meshes with all numbers of lights, in turns, and write the chart and sentences."""
    found = [cost for count in COUNTS for cost in _of_count(count)]
    draw("models-light-counts.svg", chart(found))
    replace("models.md", "light counts", sentences(found))


def _of_count(count: int) -> Iterator[ShadingCost]:
    source = Source(f"{count} lights", partial(lit, count))
    options = Options(resolution=(SIDE, SIDE))
    sphere = prepare(source, options)
    renderers: list[Renderer] = [sphere.heuristic.sampled(SPP)]
    meshes = []
    for shading in MARKS:
        for n in FINENESS:
            changed = options.changed(interpolation=shading.value, tessellation=n)
            renderer: Renderer = prepare(source, changed).heuristic
            renderers.append(renderer.sampled(SPP))
            meshes.append((shading, n, renderer.scene.shapes()[0].face_count()))
    for renderer in renderers:
        warm(renderer)
    *_, last = passes(renderers, options.seed, ROUNDS)
    exact, *images = map(np.array, last)
    distances = LEADING.against(exact, sphere.counted, options.viewing)
    for (shading, n, faces), renderer, image in zip(meshes, renderers[1:], images, strict=True):
        yield ShadingCost(
            shading=shading,
            fineness=n,
            faces=faces,
            lights=count,
            seconds=min(renderer.processor_times[-ROUNDS:]),
            error=LEADING.mean(distances(image)),
        )


def chart(found: Sequence[ShadingCost]) -> Figure:
    """Draw the time over that of Phong shading on the same mesh, and the error, over the lights."""
    phong = {
        (cost.fineness, cost.lights): cost.seconds
        for cost in found
        if cost.shading is Interpolation.PHONG
    }
    with rc_context(STYLE):
        figure = Figure(figsize=(6, 4.4), facecolor=GROUND, layout="constrained")
        time, error = figure.subplots(1, 2)
        for shading, (colour, shape, label) in MARKS.items():
            for fineness, line in FINENESS.items():
                chosen = [
                    cost for cost in found if (cost.shading, cost.fineness) == (shading, fineness)
                ]
                lights = [cost.lights for cost in chosen]
                ratios = [cost.seconds / phong[cost.fineness, cost.lights] for cost in chosen]
                style = {"color": colour, "marker": shape, "linestyle": line, "markersize": 4}
                style["label"] = f"{label}, {chosen[0].faces:,}"
                if shading is not Interpolation.PHONG:
                    time.loglog(lights, ratios, **style)
                error.loglog(lights, [cost.error for cost in chosen], **style)
        time.axhline(1, color=MARKS[Interpolation.PHONG][0], linewidth=1)
        time.set(xlabel="lights", ylabel="processor time, Phong shading = 1")
        error.set(xlabel="lights", ylabel="mean ΔE2000 to the sphere")
        time.yaxis.set_major_formatter("{x:g}")
        time.yaxis.set_minor_formatter("{x:g}")
        error.yaxis.set_major_formatter("{x:g}")
        for axes in (time, error):
            axes.xaxis.set_major_formatter("{x:g}")
            axes.set_xticks(COUNTS)
            axes.set_xticks([], minor=True)
            quiet(axes)
        handles, labels = error.get_legend_handles_labels()
        figure.legend(
            handles, labels, ncols=3, frameon=False, fontsize=7, loc="outside lower center"
        )
    return figure


def sentences(found: Sequence[ShadingCost]) -> Iterator[str]:
    """Yield what was measured on the typical mesh."""
    _, gouraud, phong = (
        [cost for cost in found if (cost.shading, cost.fineness) == (shading, TYPICAL)]
        for shading in MARKS
    )

    def ratios(costs: Sequence[ShadingCost]) -> list[float]:
        return [one.seconds / other.seconds for one, other in zip(costs, phong, strict=True)]

    counts = ", ".join(str(cost.lights) for cost in phong)
    times = ", ".join(map(number, ratios(gouraud)))
    yield (
        f"With {counts} lights on {phong[0].faces:,} faces, a picture in Gouraud shading takes"
        f" {times} times the processor time of one in Phong shading."
    )
    faster = [
        cost.lights for cost, ratio in zip(gouraud, ratios(gouraud), strict=True) if ratio < 1
    ]
    if faster:
        yield (
            f"So chapter 6's reason to interpolate, time, holds from some {min(faster)} lights on,"
            " while the error hardly depends on their number."
        )
