"""The content of docs/renderers.md: scenes by the kernel, POV-Ray, three.js and Mitsuba."""

from collections.abc import Iterator
from dataclasses import dataclass

import fotismos  # noqa: F401  isort: skip  it finds LLVM before Dr.Jit is imported

import numpy as np

from docs.engines import three_js
from docs.figures.from_tests import fact
from fotismos.comparisons.case import open_case
from fotismos.comparisons.compare import compare
from fotismos.comparisons.departure.metrics import leading_distance
from fotismos.comparisons.options import Options
from fotismos.comparisons.plain_scene import plain_scene
from fotismos.reports.terminal.tables import markdown

SCENES = ("fig-8-9", "fig-8-8c", "lambert-sphere", "plastic-spheres")
SIDE, SAMPLES = 192, 256
KERNEL, POVRAY, THREE, MITSUBA = "kernel", "POV-Ray", "three.js", "Mitsuba"


@dataclass(frozen=True)
class Rendered:
    """The images (H, W, 3) of a scene by renderer, and mean departures of all but the last."""

    images: dict[str, np.ndarray]
    departures: dict[str, float]
    from_kernel: dict[str, float]


def rendered() -> dict[str, Rendered]:
    """Render all scenes; keys are their names."""
    return {name: _rendered(name) for name in SCENES}


def table(found: dict[str, Rendered]) -> Iterator[str]:
    """Yield the table: the mean departure from Mitsuba; in brackets, from the kernel."""
    rows = [
        (name, *(_cell(one, renderer) for renderer in (KERNEL, POVRAY, THREE)))
        for name, one in found.items()
    ]
    yield from markdown([("Scene", KERNEL, POVRAY, THREE), *rows], right=1)


def _cell(one: Rendered, renderer: str) -> str:
    shown = f"{one.departures[renderer]:.2f}"
    return shown if renderer == KERNEL else f"{shown} ({one.from_kernel[renderer]:.2f})"


def _rendered(name: str) -> Rendered:
    asked = Options(resolution=(SIDE, SIDE), spp=SAMPLES)
    case = open_case(name, asked)
    kernel = compare(case.source, case.options).images
    fine = case.changed(tessellation=three_js.TESSELLATION)
    images = {
        KERNEL: kernel.heuristic,
        POVRAY: np.array(fact("drawn", name, SIDE)),
        THREE: three_js.drawn(plain_scene(fine.source, fine.options)),
        MITSUBA: kernel.reference,
    }
    departure = leading_distance(case.options.viewing)

    def mean(renderer: str, other: str) -> float:
        one, two = (images[each][kernel.counted].astype(float) for each in (renderer, other))
        return float(departure(one, two).mean())

    drawn = (KERNEL, POVRAY, THREE)
    return Rendered(
        images,
        {each: mean(each, MITSUBA) for each in drawn},
        {each: mean(each, KERNEL) for each in drawn},
    )
