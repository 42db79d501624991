"""Rendering both halves of a scene for a fit."""

from dataclasses import dataclass

import mitsuba as mi
import numpy as np

from comparisons.compare import Prepared
from comparisons.fit.recorder import Recorder
from comparisons.fit.samples import Surface
from comparisons.options import Options
from heuristic.errors import InputError
from reference.rendering.passes import Progress, passes
from reference.rendering.renderer import variant
from reference.rendering.sums import Accumulator, Estimate, add_difference
from reference.scene.graph import Graph, properties

VARIANT = "llvm_ad_rgb"


def filter_by_box(graph: Graph) -> None:
    """Give the films of a scene a box filter."""
    for film in graph.nodes(mi.ObjectType.Film):
        for key, _ in graph.children(film, mi.ObjectType.ReconstructionFilter):
            graph.detach(film, key)
    for sensor in graph.nodes(mi.ObjectType.Sensor):
        if not graph.children(sensor, mi.ObjectType.Film):
            film = graph.add(mi.ObjectType.Film, properties("hdrfilm"))
            graph.attach(sensor, "film", film)
    for film in graph.nodes(mi.ObjectType.Film):
        box = graph.add(mi.ObjectType.ReconstructionFilter, properties("box"))
        graph.attach(film, "rfilter", box)


@dataclass(frozen=True)
class Rendered:
    """Both halves' passes: the image of the paired parameters, the reference, and the surface."""

    before: np.ndarray
    reference: Estimate
    difference: Estimate
    surface: Surface | None
    counted: np.ndarray


def render(
    ready: Prepared, options: Options, progress: Progress, with_surface: bool = True
) -> Rendered:
    """Render the passes of both halves in turn, and keep the heuristic half's surface if asked."""
    if ready.heuristic.variant != VARIANT:
        raise InputError(
            f"variant {ready.heuristic.variant}: parameters are fitted in RGB. Give"
            f" --heuristic-variant {VARIANT}."
        )
    recorder = Recorder(ready.heuristic) if with_surface else None
    sums = [Accumulator() for _ in range(3)]
    halves = (ready.heuristic, ready.reference)
    for one in passes(halves, options.seed, ready.passes, progress=progress):
        add_difference(sums, one.images)
        if recorder:
            recorder.render(one.seed)
    before, reference, difference = (total.estimate() for total in sums)
    with variant(VARIANT):
        surface = recorder.surface() if recorder else None
        return Rendered(before.mean, reference, difference, surface, ready.counted)
