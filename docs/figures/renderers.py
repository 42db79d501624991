"""The content of docs/renderers.md: scenes by the kernel, POV-Ray, three.js and Mitsuba."""

import numpy as np

from docs.engines import three_js
from docs.figures.documents import draw, fact, replace
from docs.figures.model_figures import pictures
from fotismos.comparisons.case import open_case
from fotismos.comparisons.compare import compare
from fotismos.comparisons.departure.metrics import leading_distance
from fotismos.comparisons.options import Options
from fotismos.comparisons.plain_scene import plain_scene
from fotismos.reports.terminal.table import Table, markdown

SCENES = ("fig-8-9", "fig-8-8c", "lambert-sphere", "plastic-spheres")
SIDE, SAMPLES = 192, 256
KERNEL, POVRAY, THREE, MITSUBA = "kernel", "POV-Ray", "three.js", "Mitsuba"


def write() -> None:
    """Render all scenes with each program, and write their pictures and the table."""
    found = {}
    rows = []
    for scene in SCENES:
        found[scene], cells = _rendered(scene)
        rows.append((scene, *cells))
    replace(
        "renderers.md",
        "renderers",
        markdown(Table.of([("Scene", KERNEL, POVRAY, THREE), *rows])),
    )
    programs = (KERNEL, POVRAY, THREE, MITSUBA)
    shown = [[found[scene][program] for scene in SCENES] for program in programs]
    draw("renderers.png", pictures(SCENES, shown))


def _rendered(name: str) -> tuple[dict[str, np.ndarray], list[str]]:
    """Return the images (H, W, 3) of a scene by program, and the mean departures from Mitsuba.

    In brackets are those from the kernel.
    """
    case = open_case(name, Options(resolution=(SIDE, SIDE), spp=SAMPLES))
    kernel = compare(case.source, case.options).images
    fine = case.changed(tessellation=three_js.TESSELLATION)
    images = {
        KERNEL: kernel.heuristic,
        POVRAY: np.array(fact("drawn", name, SIDE)),
        THREE: three_js.drawn(plain_scene(fine.source, fine.options)),
        MITSUBA: kernel.reference,
    }
    departure = leading_distance(case.options.viewing)

    def mean(renderer: str, other: str) -> str:
        one, two = (images[each][kernel.counted].astype(float) for each in (renderer, other))
        return f"{float(departure(one, two).mean()):.2f}"

    cells = [mean(KERNEL, MITSUBA)]
    for renderer in (POVRAY, THREE):
        cells.append(f"{mean(renderer, MITSUBA)} ({mean(renderer, KERNEL)})")
    return images, cells
