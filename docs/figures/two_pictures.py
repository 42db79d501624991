"""The picture of docs/pictures.md: repeats of a scene, and repeats that lack a division by pi."""

import numpy as np

import fotismos
from docs.figures.documents import draw, replace
from fotismos.comparisons.case import open_case
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.reports import verdict
from fotismos.reports.charts import figures

SCENE = "plastic-spheres"
RESOLUTION = (320, 240)
SAMPLES = 512
REPEATS = 4


def write() -> None:
    """Compare a path tracer with other seeds of it, which lack a division by pi."""
    case = open_case(SCENE, Options(resolution=RESOLUTION, spp=SAMPLES))
    half = prepare(case.source, case.options).reference
    theirs = [np.array(half.render(seed)) for seed in range(REPEATS)]
    mine = [np.pi * np.array(half.render(REPEATS + seed)) for seed in range(REPEATS)]
    comparison = fotismos.compare(name="mine", image=mine, reference=theirs).comparison
    draw("pictures.webp", figures.strip(comparison))
    record = comparison.record
    lines = (
        "![Too bright, the reference, and the map of the difference](pictures.webp)",
        "",
        f"*{verdict.headline([record])} {verdict.cause(record)}*",
    )
    replace("pictures.md", "two pictures", lines)
