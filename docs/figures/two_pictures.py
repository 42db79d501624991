"""The picture of docs/pictures.md: repeats of a scene, and repeats that lack a division by pi."""

from collections.abc import Iterator
from io import BytesIO

import fotismos  # isort: skip  it finds LLVM before Dr.Jit is imported

import numpy as np
from PIL import Image

from fotismos.comparisons.case import open_case
from fotismos.comparisons.comparison import Comparison
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.reports import verdict
from fotismos.reports.charts import figures
from fotismos.reports.files.images import webp

SCENE = "plastic-spheres"
RESOLUTION = (320, 240)
SAMPLES = 512
REPEATS = 4
DENSITY = 160


def made() -> Comparison:
    """Compare repeats of a path tracer with repeats of other seeds, which lack a division by pi."""
    case = open_case(SCENE, Options(resolution=RESOLUTION, spp=SAMPLES))
    half = prepare(case.source, case.options).reference
    theirs = [np.array(half.render(seed)) for seed in range(REPEATS)]
    mine = [np.pi * np.array(half.render(REPEATS + seed)) for seed in range(REPEATS)]
    return fotismos.compare(name="mine", image=mine, reference=theirs).comparison


def picture(comparison: Comparison) -> bytes:
    """Return both pictures and the map of their difference as a WebP file."""
    shown = figures.drawn(figures.strip(comparison), "png", DENSITY)
    return webp(Image.open(BytesIO(shown)).convert("RGB"))


def lines(comparison: Comparison) -> Iterator[str]:
    """Yield the picture of the page, and the sentences of the command."""
    record = comparison.record
    sentences = " ".join([verdict.headline([record]), verdict.cause(record)])
    yield "![Too bright, the reference, and the map of the difference](pictures.webp)"
    yield ""
    yield f"*{sentences}*"
