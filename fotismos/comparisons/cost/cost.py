"""Study what accuracy costs on one scene."""

from typing import Any

import drjit as dr
import numpy as np
from msgspec import structs

from fotismos.comparisons import timing
from fotismos.comparisons.alignment import FINER, scene_edges
from fotismos.comparisons.attribution import find
from fotismos.comparisons.cost import engine
from fotismos.comparisons.cost.engine import Study
from fotismos.comparisons.cost.front import at_size, fronted, reach, sufficient
from fotismos.comparisons.cost.measure import (
    QUICK,
    QUICK_WIDTH,
    WIDTH,
    Effort,
    Measurements,
    Size,
    measure_ladder,
    reduced,
    requested,
)
from fotismos.comparisons.cost.methods import FULL_PLAN, all_methods
from fotismos.comparisons.cost.timed_pictures import EngineTimes
from fotismos.comparisons.departure.criterion import checked_threshold
from fotismos.comparisons.options import Options
from fotismos.comparisons.pictures import GivenPictures
from fotismos.comparisons.prepared import TEMPLATE_SPP
from fotismos.comparisons.records.cost import Choice, Cost, CostAttribution, EffectCost
from fotismos.comparisons.records.images import Causes
from fotismos.heuristic.errors import InputError
from fotismos.heuristic.program import versions
from fotismos.reference.pairing.settings import film_size
from fotismos.reference.planning.plan_record import Guard
from fotismos.reference.records import Machine, Pixels
from fotismos.reference.rendering.passes import Progress
from fotismos.reference.scene.source import Source

SPP = 64
"""Samples per pixel of the image to which effects add time."""


def cost(
    source: Source,
    options: Options | None = None,
    effort: Effort | None = None,
    progress: Progress | None = None,
    command: str = "",
    at: Size | None = None,
    causes: Causes | None = None,
    engine_times: EngineTimes | None = None,
) -> Study[Cost]:
    """Study what accuracy costs on one scene, in the current variant.

    For ``source``, ``options``, ``progress`` and ``command`` see
    :func:`fotismos.comparisons.compare.compare`, and
    :func:`fotismos.comparisons.cost.measure.measure_ladder` for an omitted resolution,
    ``options.spp``. ``at`` is a size to predict for: times follow from overhead and
    time per sample, while errors are not predicted. ``causes`` are those of the scene, if known.
    With ``engine_times``, pictures of another renderer are judged, too, and their size becomes that
    of the study.
    """
    progress = progress or (lambda *_: None)
    options = options or Options()
    effort = effort or Effort()
    for name in ("reference", "mask", "tone_map"):
        if getattr(options, name):
            raise InputError(
                f"`{name}` is for pictures without a scene: here all methods have the scene's own"
                " reference and surfaces. Omit it, or omit the scene."
            )
    # Before anything is rendered: pictures may be refused.
    given = GivenPictures()
    if engine_times:
        require_other_names(engine_times)
        given = engine.read(engine_times, options)
        options = given.sized(film_size(source.parse(), options.sensor), options)
    if at:
        size = options.resolution or reduced(source, options.changed(resolution=at), WIDTH)
        require_shape(at, size)
    found = measure_ladder(source, options, effort=effort, progress=progress, at=at)
    options = found.options
    ready = found.ready
    ladder = found.ladder
    counted = ready.counted
    predicted = at_size(found.points, found.methods, at) if at else ()
    ladder.forget()  # its scenes would slow later work
    judged = engine.judged(given, engine_times, truth(found)) if engine_times else None
    known = causes or find(ready, progress, most=found.size[0])
    made = Cost(
        scene=source.name,
        variant=ready.reference.variant,
        heuristic_variant=ladder.pairs.heuristic_variant,
        heuristic=options.heuristic,
        interpolation=options.polygon_shading,
        seed=options.seed,
        resolution=found.size,
        rounds=effort.rounds,
        threads=dr.thread_count(),
        # Every line holds the same number of processors, the median of all.
        processor_share=min(next(iter(found.lines.values())).processors / dr.thread_count(), 1.0),
        reference=found.converged,
        methods=found.methods,
        points=fronted(found.points),
        attribution=attribution(found, known),
        closure=known.record.closure,
        viewing=options.viewing,
        pixels=Pixels(counted=int(counted.sum()), total=counted.size),
        machine=Machine.here(),
        versions=versions(),
        command=command,
        guard=ready.guard or Guard(),
        at=at,
        predicted=fronted(predicted),
        left_out=ladder.left_out,
        engine=judged,
    )
    return Study(
        record=made,
        reference=found.reference.mean,
        settings=engine.shown(given, engine_times) if engine_times else {},
        methods=found.images,
    )


def require_other_names(engine_times: EngineTimes) -> None:
    """Raise `InputError` if a setting has the name of a method."""
    known = {name for method in all_methods() for name in (method.name, *method.names)}
    for picture in engine_times.pictures:
        if picture.name in known:
            raise InputError(f"{picture.name!r} is a method of the study: give another name.")


def truth(found: Measurements) -> engine.Truth:
    """Return what pictures of a scene are judged by: the reference of its methods."""
    textbook = np.array(found.ready.heuristic.sampled(TEMPLATE_SPP).render(0), float)
    return engine.Truth(
        reference=found.reference,
        counted=found.ready.counted,
        viewing=found.options.viewing,
        edges=scene_edges(found.ready.traced(FINER), textbook),
        textbook=textbook,
    )


def quick(
    source: Source,
    options: Options,
    causes: Causes,
    progress: Progress,
    command: str,
) -> Study[Cost]:
    """Study a compared scene with less effort, and predict for its own size; see :func:`cost`."""
    whole = requested(source, options)
    small = options.changed(resolution=reduced(source, options, QUICK_WIDTH), spp=None)
    return cost(source, small, QUICK, progress, command, whole, causes=causes)


def require_shape(target: Size, size: Size) -> None:
    """Reject a size of another shape than the study's."""
    (width, height), (wide, high) = sorted([size, target])
    if abs(high * width / wide - height) > 1:  # a pixel of the smaller one is tolerated
        raise InputError(
            f"{width}x{height} and {wide}x{high} differ in shape: give `resolution` the shape of"
            " `at`, or omit it."
        )


def attribution(found: Measurements, causes: Causes) -> CostAttribution:
    """Return what each effect removes, and what it adds to an image of the study's size.

    ``causes`` may be of another size.
    """
    samples = SPP * found.size[0] * found.size[1]
    # The steps lead from the kernel as requested to the full plan.
    first = found.steps[0].before
    last = found.steps[-1].after

    def adds(effect: str) -> Any:
        return timing.difference(
            [
                (step.weight, found.lines[step.before.name], found.lines[step.after.name])
                for step in found.steps
                if step.effect == effect
            ],
            samples,
        )

    def takes(name: str) -> Any:
        values = samples * found.lines[name].per_sample
        return timing.interval(values, timing.UNSEEN * float(values[0]))

    effects = (
        EffectCost(**structs.asdict(contribution), adds_s=adds(contribution.effect))
        for contribution in causes.record.effects
    )
    return CostAttribution(
        effects=tuple(effects),
        departure=causes.record.departure,
        size=causes.record.resolution,
        kernel_s=takes(first.name),
        plan_s=takes(last.name),
        renderer_s=adds(""),
        resolution=found.size,
        spp=SPP,
    )


def choose(
    source: Source, within: float, options: Options | None = None, progress: Progress | None = None
) -> Choice:
    """Measure the ladder of a scene, in the current variant, and choose from it.

    Errors are measured at a small size, times follow from the time per sample.
    """
    checked_threshold(within)
    options = options or Options()
    size = requested(source, options)
    small = options.changed(resolution=None)
    progress = progress or (lambda *_: None)
    found = measure_ladder(source, small, effort=Effort(), progress=progress, at=options.resolution)
    points = at_size(found.points, found.methods, size)
    full = next(method.name for method in found.methods if FULL_PLAN.name in method.names)
    of_full = [point for point in points if point.method == full]
    chosen = sufficient(points, within)
    return Choice(
        scene=source.name,
        resolution=size,
        measured=found.size,
        within=within,
        chosen=chosen,
        best=min(points, key=lambda point: (point.tolerance.value, point.seconds.value)),
        full=sufficient(of_full, within) or max(of_full, key=lambda point: point.spp),
        left_out=found.ladder.left_out,
        reach=None if chosen else reach(points, within),
    )
