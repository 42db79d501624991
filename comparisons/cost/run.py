"""What accuracy costs on one scene: the whole study."""

import os
import platform
from dataclasses import asdict, dataclass, replace
from itertools import count as count_from
from itertools import takewhile
from pathlib import Path

import numpy as np

from comparisons import record
from comparisons.compare import prepare
from comparisons.cost.front import Point, equal_error, equal_time, pareto
from comparisons.cost.lattice import Lattice
from comparisons.cost.measure import Judge, measure
from comparisons.cost.methods import Methods
from comparisons.cost.prices import prices
from comparisons.cost.split import split
from comparisons.options import Options
from heuristic.errors import InputError
from reference.gbuffer import gbuffer
from reference.rendering import Accumulator, Renderer

DETERMINISTIC_SPP = 16
"""Samples a pixel of rungs without random numbers, which the pixel filter alone needs."""

WIDTH = 128
"""Pixels: the default width of an image; costs are in proportion to the pixels."""


@dataclass(frozen=True)
class Effort:
    """How much is rendered for a study.

    Parameters
    ----------
    rounds
        Timed repeats of each rung, at least 2. From 6 on the median has a 95 % interval.
    largest
        Most samples a pixel of the Monte Carlo rungs, which begin at 4 and take powers of 4: at
        those the sampler is fastest.
    reference_spp
        Samples a pixel of each pass of the reference that errors are told against.
    replicate_spp
        Samples a pixel of each replicate for prices and parts.
    """

    rounds: int = 7
    largest: int = 64
    reference_spp: int = 64
    replicate_spp: int = 16

    def __post_init__(self):
        if self.rounds < 2:
            raise InputError(f"rounds = {self.rounds} is not allowed: give at least 2.")

    @property
    def counts(self):
        """The sample counts of the Monte Carlo rungs."""
        powers = takewhile(lambda count: count <= self.largest, (4**i for i in count_from(1)))
        return tuple(powers) or (self.largest,)


QUICK = Effort(rounds=3, largest=16)
"""For many scenes in one report, at :data:`QUICK_WIDTH`: there, tracing takes most of the time, so
that renderings are few and samples are not spared."""

QUICK_WIDTH = 48


@dataclass(frozen=True)
class Study:
    """What a study returns: the data of ``cost.json``, and images by name.

    Attributes
    ----------
    data
        Plain data.
    rungs
        ``{rung name: (H, W, 3)}``, of the most samples.
    parts
        ``{part: (H, W, 3)}``, signed and linear.
    effects
        ``{effect: (H, W)}``: the ΔE2000 that it removes.
    reference
        (H, W, 3).
    counted
        (H, W): the pixels that count.
    """

    data: dict
    rungs: dict
    parts: dict
    effects: dict
    reference: np.ndarray
    counted: np.ndarray


def cost(source, options=None, effort=None, progress=None, command=""):
    """Study what accuracy costs on one scene, in the current variant.

    Parameters
    ----------
    source, options, progress, command
        As of :func:`comparisons.compare.compare`. ``options.spp`` are the most samples of a Monte
        Carlo rung. Without a resolution, the film's own is reduced to :data:`WIDTH`.
    effort : Effort, optional
        How much is rendered.

    Returns
    -------
    Study

    Raises
    ------
    InputError
        When the scene cannot be read or paired.
    NonFiniteError
        When a rendering holds a NaN or an infinity.
    """
    options, effort = options or Options(), effort or Effort()
    progress = progress or _silent
    options = replace(options, resolution=options.resolution or default_resolution(source, options))
    if options.spp is not None:
        effort = replace(effort, largest=options.spp)
    ready = prepare(source, replace(options, spp=None))
    width, height = (int(side) for side in ready.scene.sensors()[0].film().crop_size())
    counted = gbuffer(ready.scene, width, height).hit
    reference = _converged(ready, effort, options.seed, progress)
    judge = Judge(reference, counted, options.viewing)

    methods = Methods(source, options, ready)
    renderers = {
        (rung.name, spp): methods.renderer(rung.method, spp)
        for rung in methods.rungs
        for spp in (effort.counts if rung.monte_carlo else (DETERMINISTIC_SPP,))
    }
    measured = measure(renderers, judge, effort.rounds, options.seed, progress)
    seed = options.seed + 2_000_000
    lattice = Lattice(source, options, ready, methods.between, effort.replicate_spp, seed)
    progress("pricing effects", 0, 1)
    priced = prices(lattice, judge, options.seed)
    parts, whole = split(lattice, counted, options.viewing)
    progress("pricing effects", 1, 1)

    points = [Point(m.rung, m.spp, m.seconds.median, m.error) for m in measured]
    front = {(point.method, point.spp) for point in pareto(points)}
    data = {
        "scene": source.name,
        "variant": ready.reference.variant,
        "heuristic_variant": methods.heuristic_variant,
        "interpolation": options.interpolation.value,
        "seed": options.seed,
        "resolution": [width, height],
        "rounds": effort.rounds,
        "reference": {
            "integrator": ready.plan.integrator,
            "max_depth": ready.plan.max_depth,
            "spp": effort.reference_spp * reference.passes,
            "passes": reference.passes,
            "noise_floor": judge.floor,
            "mean_variance": judge.variance,
        },
        "rungs": [
            {"name": rung.name, "names": list(rung.names), "monte_carlo": rung.monte_carlo}
            for rung in methods.rungs
        ],
        "points": [_without(m, "image") | {"pareto": (m.rung, m.spp) in front} for m in measured],
        "equal_time": [asdict(row) for row in equal_time(points)],
        "equal_error": [asdict(row) for row in equal_error(points)],
        "prices": {
            **_without(priced, "effects"),
            "effects": [_without(price, "map") for price in priced.effects],
        },
        "split": {
            "parts": [_without(part, "map") for part in parts],
            "departure": _without(whole, "map"),
        },
        "viewing": options.viewing.record(),
        "pixels": {"counted": int(counted.sum()), "total": width * height},
        "machine": machine(),
        "versions": record.versions(),
        "command": command,
    }
    return Study(
        data=data,
        rungs={m.rung: m.image for m in measured},
        parts={part.name: part.map for part in parts},
        effects={price.effect: price.map for price in priced.effects},
        reference=reference.mean,
        counted=counted,
    )


def quick(source, options=None, progress=None, command=""):
    """Study a scene as :func:`cost` does, in little time: for many scenes in one report."""
    options = options or Options()
    small = default_resolution(source, options, QUICK_WIDTH)
    return cost(source, replace(options, resolution=small), QUICK, progress, command)


def default_resolution(source, options, width=WIDTH):
    """Return the film's resolution, reduced to a width; smaller films stay as they are."""
    from reference import halves, preparation

    graph = halves.pair(source, options.convention).physical
    ((_, film),) = graph.children(graph.nodes(preparation.SENSOR)[0], preparation.FILM)
    props = graph.props(film)
    given = int(props.get("width", 768)), int(props.get("height", 576))
    if given[0] <= width:
        return given
    return width, max(1, round(given[1] * width / given[0]))


def machine():
    """Return what times depend on: processor, cores that may be used, system."""
    return {
        "processor": _processor(),
        "cores": len(os.sched_getaffinity(0))
        if hasattr(os, "sched_getaffinity")
        else os.cpu_count() or 1,
        "system": f"{platform.system()} {platform.machine()}",
    }


def _processor():
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def _converged(ready, effort, seed, progress):
    """Render the reference that errors are told against, with seeds that no rung has."""
    renderer = Renderer(
        ready.scene, ready.reference.integrator, effort.reference_spp, "reference image"
    )
    total = Accumulator()
    for number in range(ready.plan.passes):
        progress("reference", number, ready.plan.passes)
        total.add(renderer.render(seed + 1_000_000 + number))
    return total.estimate()


def _without(item, *names):
    """Return the fields of a record as plain data, without the arrays that are named."""
    plain = replace(item, **dict.fromkeys(names)) if names else item
    return {key: value for key, value in asdict(plain).items() if key not in names}


def _silent(stage, done, total):
    """Report no progress."""
