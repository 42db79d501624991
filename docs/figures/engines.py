"""The content of docs/engines.md: what approximations of engines lose on five scenes, and cost.

``./run docs --engines`` measures for ten minutes, and writes the page.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import log2
from statistics import median
from textwrap import wrap
from typing import Any

import numpy as np
import pyarrow as pa
from matplotlib import rc_context
from matplotlib.figure import Figure
from msgspec import structs
from pyarrow import csv, parquet

from docs.figures.documents import DOCS, draw, replace
from docs.figures.model_figures import GROUND, STYLE
from fotismos.comparisons import turns
from fotismos.comparisons.case import Case, open_case
from fotismos.comparisons.departure.colour import luminance
from fotismos.comparisons.departure.criterion import LIMIT, TOLERANCE
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.gallery.scenes import plastic_spheres
from fotismos.comparisons.ladder import climb
from fotismos.comparisons.ladder.methods import DIRECT, FULL_PLAN, Ladder
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import guarded
from fotismos.comparisons.records.cost import Method
from fotismos.comparisons.turns import Time
from fotismos.heuristic.convention import Floats
from fotismos.reference.records import Machine
from fotismos.reference.rendering.passes import passes
from fotismos.reference.rendering.sums import Accumulator
from fotismos.reports.files import images
from fotismos.reports.terminal.table import Table, markdown
from fotismos.reports.terminal.words import number, percent, seconds

WIDTH = 192
ROUNDS = 7
DAYLIGHT = {"type": "sunsky", "sun_direction": (-0.5, -0.6, 0.6), "turbidity": 4.0}

LAMP = "lamp"
SKY = "sky"
MAP = "map"
SCENES: Mapping[str, tuple[str | Callable[[], Any], str]] = {
    "Cornell box": ("cornell-box", LAMP),
    "textured room": (str(DOCS / "scenes/textured_room.py"), LAMP),
    "plastic, sky": (lambda: plastic_spheres() | {"lamp": DAYLIGHT}, SKY),
    "outdoors": (str(DOCS / "scenes/outdoors.py"), SKY),
    "spheres": (str(DOCS / "scenes/spheres.py"), MAP),
}
"""Each scene by its name, with the kind of light that it has."""


def _shaded(name: str, heuristic: str, shadows: bool = True) -> Method:
    heuristic = heuristic.replace("docs", str(DOCS), 1)
    return Method(name=name, family="kernel", shadows=shadows, heuristic=heuristic)


KERNEL = _shaded("kernel", "phong", shadows=False)
"""Phong's model without shadows: the time of a sample is 1."""

LTC = _shaded("ltc", "docs/shaders/ltc.py")
NO_INTERREFLECTION = structs.replace(DIRECT, name="no interreflection")
PATHS = structs.replace(FULL_PLAN, name="path tracing")
"""Again, with other seeds: it shows how much is noise."""

APPROXIMATIONS: Mapping[Method, tuple[str, ...]] = {
    _shaded("textbook ambient", "phong"): (LAMP, SKY, MAP),
    _shaded("hemisphere ambient", "hemisphere-ambient"): (LAMP, SKY, MAP),
    _shaded("harmonics", "docs/shaders/harmonics.py"): (SKY, MAP),
    _shaded("split sum", "docs/shaders/split_sum.py"): (SKY, MAP),
    _shaded("points for lamps", "docs/shaders/cook_torrance.py"): (LAMP,),
    LTC: (LAMP,),
    _shaded("hard shadow map", "shadow-map", shadows=False): (LAMP, SKY),
    NO_INTERREFLECTION: (LAMP, SKY, MAP),
    PATHS: (LAMP, SKY, MAP),
}
"""Approximations, and the kinds of light that they are made for."""


@dataclass(frozen=True, kw_only=True)
class Rendered:
    """A converged picture (H, W, 3), the time of a sample over the kernel's, and preparation."""

    picture: Floats
    time: float
    prepare_s: float


@dataclass(frozen=True, kw_only=True)
class Measured(Rendered):
    """What an approximation loses on a scene, and costs.

    ``visible`` is the share of the pixels above :data:`TOLERANCE`, ``visible_direct`` that against
    a reference without interreflection, ``de2000`` the mean. ``stops`` is the ratio of the mean
    luminances on a display, and ``stops_direct`` that to the reference without interreflection: the
    bias of the whole, and that of direct light.
    """

    scene: str
    approximation: str
    visible: float
    visible_direct: float
    de2000: float
    stops: float
    stops_direct: float


def write() -> None:
    """Measure all approximations on each scene, in turn, and write the page and its tables."""
    rows = [row for scene in SCENES for row in on_scene(scene)]
    plain = [{key: value for key, value in vars(one).items() if key != "picture"} for one in rows]
    found = pa.Table.from_pylist(plain)
    csv.write_csv(found, DOCS / "engines.csv")
    parquet.write_table(found, DOCS / "engines.parquet")
    replace("engines.md", "lead", lead(rows))
    replace("engines.md", "table", table(rows))
    replace("engines.md", "bias", bias(rows))
    draw("engines.webp", chart(rows))


def on_scene(name: str) -> Iterator[Measured]:
    """Yield what is measured on a scene."""
    scene, light = SCENES[name]
    case = open_case(scene, Options(), name=name)
    case = case.changed(resolution=climb.reduced(case.source, case.options, WIDTH))
    ready = guarded(case.source, case.options)
    total = Accumulator()
    climb.converge(ready, total, climb.REFERENCE_PASSES)
    reference = total.mean()
    served = [method for method, lights in APPROXIMATIONS.items() if light in lights]
    rendered = {method.name: _rendered(case, method) for method in served}
    direct = rendered[NO_INTERREFLECTION.name].picture
    counted = ready.counted
    distances = LEADING.against(reference, counted, case.options.viewing)
    to_direct = LEADING.against(direct, counted, case.options.viewing)
    for approximation, one in rendered.items():
        errors = distances(one.picture)
        yield Measured(
            scene=name,
            approximation=approximation,
            visible=float(np.mean(errors > TOLERANCE)),
            visible_direct=float(np.mean(to_direct(one.picture) > TOLERANCE)),
            de2000=LEADING.mean(errors),
            stops=_stops(one.picture[counted], reference[counted]),
            stops_direct=_stops(one.picture[counted], direct[counted]),
            **vars(one),
        )


def _stops(pixels: Floats, reference: Floats) -> float:
    """Return how much brighter pixels are than a reference's: 1 is twice as bright."""
    return log2(_shown(pixels) / _shown(reference))


def _shown(pixels: Floats) -> float:
    """Return the mean luminance on a display, on which a lamp counts as white."""
    return float(luminance(np.clip(pixels, 0, 1)).mean())


def _rendered(case: Case, method: Method) -> Rendered:
    """Render an approximation, and time it in turn with the kernel in the same scene."""
    options = case.options.changed(heuristic=method.heuristic or "phong")
    ready = guarded(case.source, options)
    ladder = Ladder(ready)
    size, spp = turns.timed_size(ready.reference)
    firsts = {one.name: ladder.renderer(one, spp) for one in (KERNEL, method)}
    for _ in turns.in_turn(firsts, options.seed, ROUNDS, size=size):
        pass
    times = {name: Time.of(renderer, size, ROUNDS) for name, renderer in firsts.items()}
    total = Accumulator()
    renderer = firsts[method.name].sampled(climb.REFERENCE_SPP)
    for one in passes([renderer], options.seed, climb.REFERENCE_PASSES):
        total.add(one[0])
    return Rendered(
        picture=total.mean(),
        time=turns.ratio(times[method.name], times[KERNEL.name]).value,
        prepare_s=firsts[method.name].preparation,
    )


def lead(rows: Sequence[Measured]) -> Iterator[str]:
    """Yield the finding in a few sentences."""
    shaded = [one for one in rows if one.approximation != PATHS.name]
    right = sum(one.visible <= LIMIT for one in shaded)
    best = min(shaded, key=lambda one: one.visible)
    ltc = "; ".join(
        f"on *{one.scene}*, {percent(one.visible)} and {percent(one.visible_direct)}"
        for one in rows
        if one.approximation == LTC.name
    )
    look = "looks" if right == 1 else "look"
    yield from wrap(
        f"**{right} of {len(shaded)} pictures {look} right**: at most {100 * LIMIT:g} % of the"
        f" pixels differ visibly, by more than {LEADING.label} {TOLERANCE:g}. The nearest is"
        f" {best.approximation} on *{best.scene}*: {percent(best.visible)}. Under lamps, most of"
        " what is missing is light from other surfaces. With ltc, these shares of the pixels differ"
        f" from the physical picture, and from a physical picture without that light: {ltc}.",
        width=110,
    )


def chart(rows: Sequence[Measured]) -> Figure:
    """Draw each picture, and the share of its pixels that differ visibly."""
    shown = {(one.approximation, one.scene): one for one in rows}
    with rc_context(STYLE):
        figure = Figure(figsize=(5.6, 8.6), facecolor=GROUND)
        grid = figure.subplots(len(APPROXIMATIONS), len(SCENES))
        figure.subplots_adjust(0.2, 0.005, 0.995, 0.92, wspace=0.05, hspace=0.32)
        for line, method in zip(grid, APPROXIMATIONS, strict=True):
            for axes, scene in zip(line, SCENES, strict=True):
                axes.axis("off")
                one = shown.get((method.name, scene))
                if one is None:
                    axes.text(0.5, 0.5, "–", ha="center", va="center")
                    continue
                axes.imshow(images.tonemap(one.picture).convert("RGB"), interpolation="antialiased")
                axes.set_title(f"{100 * one.visible:.1f} %", pad=2)
            box = line[0].get_position()
            figure.text(0.2, box.y0 + box.height / 2, method.name.replace(" ", "\n"),
                        ha="right", va="center")  # fmt: skip
        for axes, scene in zip(grid[0], SCENES, strict=True):
            box = axes.get_position()
            figure.text(box.x0 + box.width / 2, 0.95, scene.replace(" ", "\n"), ha="center")
    return figure


def table(rows: Sequence[Measured]) -> Iterator[str]:
    """Yield the errors of each approximation by scene, its time and that of its preparation."""
    lines = []
    for method in APPROXIMATIONS:
        own = {one.scene: one for one in rows if one.approximation == method.name}
        cells = (number(own[scene].de2000) if scene in own else "–" for scene in SCENES)
        time = median(one.time for one in own.values())
        prepare = median(one.prepare_s for one in own.values())
        lines.append((method.name, *cells, f"{time:.2f}", seconds(prepare) if prepare else "–"))
    yield from markdown(
        Table.of([("Approximation", *SCENES, "time", "preparation"), *lines], right=1)
    )
    yield ""
    yield (
        f"Pictures are {WIDTH} pixels wide. Times are from {ROUNDS} rounds on"
        f" {Machine.here().processor}, {Machine.here().cores} cores."
    )


def bias(rows: Sequence[Measured]) -> Iterator[str]:
    """Yield the bias of each shader by scene: that of direct light, and of all light."""
    lines = []
    for method in filter(lambda one: one.is_kernel, APPROXIMATIONS):
        own = {one.scene: one for one in rows if one.approximation == method.name}
        lines.append((method.name, *(_stops_of(own.get(scene)) for scene in SCENES)))
    yield from markdown(Table.of([("Approximation", *SCENES), *lines]))


def _stops_of(one: Measured | None) -> str:
    """Return the bias of direct light, and of all light."""
    return "–" if one is None else f"{one.stops_direct:+.2f}/{one.stops:+.2f}"
