"""The content of docs/engines.md: what approximations of engines lose on five scenes, and cost.

``./run docs --engines`` measures for 15 minutes on an idle machine, and writes the page.
"""

import runpy
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from math import log2
from pathlib import Path
from statistics import median
from typing import Any

import fotismos  # noqa: F401  isort: skip  it finds LLVM before Dr.Jit is imported

import numpy as np
import pyarrow as pa
from matplotlib import rc_context
from matplotlib.figure import Figure
from msgspec import structs
from pyarrow import csv, parquet

from docs.figures.from_tests import ROOT
from docs.figures.model_figures import GROUND, STYLE
from fotismos.comparisons.case import Case, open_case
from fotismos.comparisons.comparison import machine
from fotismos.comparisons.cost import measure, times
from fotismos.comparisons.cost.cost_record import Method
from fotismos.comparisons.cost.methods import DIRECT, Ladder
from fotismos.comparisons.departure.colour import luminance
from fotismos.comparisons.departure.criterion import TOLERANCE
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.gallery.scenes import plastic_spheres
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import guarded
from fotismos.heuristic.convention import Floats
from fotismos.reference.records import Interval
from fotismos.reference.rendering.gbuffer import image_size
from fotismos.reference.rendering.renderer import passes
from fotismos.reference.rendering.sums import Accumulator
from fotismos.reports.files import images
from fotismos.reports.terminal.tables import markdown
from fotismos.reports.terminal.words import number, percent

SHADERS = ROOT / "docs/shaders"
SCENES = ROOT / "docs/scenes"
WIDTH = 192
ROUNDS = 7
FEW_PASSES = 2
REFERENCE = "reference"
KERNEL = Method(name="kernel", family="kernel", heuristic="phong")
"""Phong's model without shadows: the time of its samples is 1."""

LAMP = "lamp"
SKY = "sun and sky"
MAP = "map"


def _still_life() -> dict[str, Any]:
    """Return the plastic spheres under a sky instead of their lamp."""
    sky = runpy.run_path(str(SCENES / "outdoors.py"))["scene"]["sky"]
    return plastic_spheres() | {"lamp": sky}


LIT: Mapping[str, tuple[str | Callable[[], Any], str]] = {
    "Cornell box": ("cornell-box", LAMP),
    "textured room": (str(SCENES / "textured_room.py"), LAMP),
    "plastic, sky": (_still_life, SKY),
    "outdoors": (str(SCENES / "outdoors.py"), SKY),
    "spheres": (str(SCENES / "spheres.py"), MAP),
}
"""Scenes by name, and the kind of their light."""


@dataclass(frozen=True)
class Approximation:
    """A way to shade: a method with its heuristic, and the kinds of light for which it is made."""

    method: Method
    lights: tuple[str, ...] = (LAMP, SKY, MAP)


def _shaded(name: str, heuristic: str, *lights: str) -> Approximation:
    """Return an approximation by a heuristic, with shadow rays unless it has its own shadows."""
    shadows = heuristic != "shadow-map"
    method = Method(name=name, family="kernel", shadows=shadows, heuristic=heuristic)
    return Approximation(method, lights or (LAMP, SKY, MAP))


DIRECT_LIGHT = structs.replace(DIRECT, name="no interreflection")
"""Path tracing of direct light alone."""

APPROXIMATIONS = (
    _shaded("textbook ambient", "phong"),
    _shaded("hemisphere ambient", "hemisphere-ambient"),
    _shaded("harmonics", str(SHADERS / "harmonics.py"), SKY, MAP),
    _shaded("split sum", str(SHADERS / "split_sum.py"), SKY, MAP),
    _shaded("points for lamps", str(SHADERS / "cook_torrance.py"), LAMP),
    _shaded("ltc", str(SHADERS / "ltc.py"), LAMP),
    _shaded("hard shadow map", "shadow-map", LAMP, SKY),
    Approximation(DIRECT_LIGHT),
)


@dataclass(frozen=True)
class Measured:
    """What an approximation loses on a scene, and costs.

    ``visible`` is the share of the pixels above :data:`TOLERANCE`, ``de2000`` the mean, ``stops``
    the mean luminance over the reference's as a binary logarithm; ``visible_direct`` is the share
    against a reference without interreflection, ``visible_noise`` that of the reference's noise
    alone. ``time`` is a sample's over the kernel's.
    """

    scene: str
    approximation: str
    visible: float
    de2000: float
    stops: float
    visible_direct: float
    visible_noise: float
    time: float
    time_low: float
    time_high: float
    prepare_s: float


@dataclass(frozen=True)
class Taken:
    """The converged picture (H, W, 3) of an approximation, its time over the kernel's, and more."""

    picture: Floats
    time: Interval
    prepare_s: float


@dataclass(frozen=True)
class Found:
    """What is measured on a scene, and its pictures by approximation, the reference last."""

    measured: tuple[Measured, ...]
    pictures: Mapping[str, Floats]


def measured() -> dict[str, Found]:
    """Measure each scene, in turn."""
    found = {}
    for name, (scene, light) in LIT.items():
        found[name] = _measured(name, scene, light)
        print(name, flush=True)
    return found


def _measured(name: str, scene: Any, light: str) -> Found:
    """Render the reference of a scene, and all approximations that serve its light."""
    case = open_case(scene, Options(), name=name)
    case = case.changed(resolution=measure.reduced(case.source, case.options, WIDTH))
    ready = guarded(case.source, case.options)
    reference = measure.converged(ready, case.options.seed, progress=None)
    methods = [one.method for one in APPROXIMATIONS if light in one.lights]
    taken = {method.name: _taken(case, method) for method in methods}
    truths = {"all": reference.mean, "direct": taken[DIRECT_LIGHT.name].picture}
    against = {
        key: LEADING.against(truth, ready.counted, case.options.viewing)
        for key, truth in truths.items()
    }
    noise = _share(against["all"](reference.mean + reference.noise))
    bright = luminance(reference.mean[ready.counted]).mean()
    rows = []
    for key, one in taken.items():
        errors = against["all"](one.picture)
        rows.append(
            Measured(
                scene=name,
                approximation=key,
                visible=_share(errors),
                de2000=LEADING.mean(errors),
                stops=log2(luminance(one.picture[ready.counted]).mean() / bright),
                visible_direct=_share(against["direct"](one.picture)),
                visible_noise=noise,
                time=one.time.value,
                time_low=one.time.low,
                time_high=one.time.high,
                prepare_s=one.prepare_s,
            )
        )
    pictures = {key: one.picture for key, one in taken.items()}
    return Found(tuple(rows), pictures | {REFERENCE: reference.mean})


def _taken(case: Case, method: Method) -> Taken:
    """Render an approximation, and time it in turn with the kernel in the same scene."""
    options = case.options.changed(heuristic=method.heuristic or "phong")
    ready = guarded(case.source, options)
    ladder = Ladder(case.source, options, ready)
    firsts = {one.name: ladder.renderer(one, 4) for one in (KERNEL, method)}
    width, height = image_size(ready.scene)
    pixels = width * height
    renderers = measure.tried(firsts, dict.fromkeys(firsts, (4,)), pixels)
    measure.rendered(renderers, lambda _: (0.0, 0.0), (), ROUNDS, options.seed, None, "timing")
    lines = measure.timed(renderers, ROUNDS, pixels)
    total = Accumulator()
    renderer = firsts[method.name].sampled(measure.REFERENCE_SPP)
    # Without random light only the pixel filter is random.
    count = FEW_PASSES if method.is_kernel else measure.REFERENCE_PASSES
    for one in passes([renderer], options.seed, count):
        total.add(one.images[0])
    prepare_s = getattr(firsts[method.name].integrator, "preparation", 0.0)
    ratio = times.ratio(lines[method.name], lines[KERNEL.name])
    return Taken(picture=total.mean(), time=ratio, prepare_s=prepare_s)


def _share(errors: Floats) -> float:
    return float(np.mean(errors > TOLERANCE))
