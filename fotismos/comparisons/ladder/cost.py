"""Study what accuracy costs on one scene: its ladder, and what each effect removes and adds."""

from collections.abc import Sequence
from dataclasses import replace

import drjit as dr
import numpy as np
from msgspec import structs

from fotismos.comparisons import turns
from fotismos.comparisons.attribution import find
from fotismos.comparisons.departure.criterion import checked_threshold
from fotismos.comparisons.halves import Halves
from fotismos.comparisons.ladder import engine
from fotismos.comparisons.ladder.climb import (
    QUICK,
    QUICK_WIDTH,
    WIDTH,
    Climb,
    Effort,
    climbed,
    reduced,
    requested,
)
from fotismos.comparisons.ladder.engine import Study
from fotismos.comparisons.ladder.front import cheapest, fronted
from fotismos.comparisons.ladder.methods import Step, all_methods
from fotismos.comparisons.ladder.timed_pictures import EngineTimes, TimedPicture
from fotismos.comparisons.options import Options
from fotismos.comparisons.pictures import GivenPictures, Pictures
from fotismos.comparisons.prepared import Prepared
from fotismos.comparisons.records.cost import Choice, Cost, CostAttribution, EffectCost, Method
from fotismos.comparisons.records.images import Causes, Comparison
from fotismos.comparisons.steps import PICTURES
from fotismos.comparisons.turns import UNSEEN
from fotismos.heuristic.errors import InputError
from fotismos.heuristic.program import versions
from fotismos.reference.pairing.settings import film_size
from fotismos.reference.planning.plan_record import Guard
from fotismos.reference.records import Interval, Machine, Pixels
from fotismos.reference.rendering.passes import Progress, Size
from fotismos.reference.scene.source import Source

ATTRIBUTED_SPP = 64
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
    :func:`fotismos.comparisons.ladder.climb.climbed` for an omitted resolution and
    ``options.spp``. ``at`` is a size to predict times for; errors are not predicted. ``causes`` are
    those of the scene, if known. With ``engine_times``, pictures of another renderer are judged,
    too, and their size becomes that of the study.
    """
    progress = progress or (lambda *_: None)
    options = options or Options()
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
    climb = climbed(source, options, effort or Effort(), progress, at=at)
    ready = climb.ready
    options = ready.options
    climb.ladder.forget()  # its scenes would slow later work
    judged = None
    if engine_times:
        judged = engine.engine(compared(given, engine_times, ready), engine_times)
    known = causes or find(ready, progress, most=climb.size[0])
    made = Cost(
        scene=source.name,
        variant=ready.reference.variant,
        heuristic_variant=climb.ladder.pairs.heuristic_variant,
        heuristic=options.heuristic,
        interpolation=options.polygon_shading,
        seed=options.seed,
        resolution=climb.size,
        rounds=climb.effort.rounds,
        threads=dr.thread_count(),
        processor_share=min(climb.processors() / dr.thread_count(), 1.0),
        reference=climb.converged(),
        methods=climb.methods(),
        points=fronted(climb.points(at)),
        stopped=climb.stopped,
        attribution=attribution(climb, known),
        closure=known.record.closure,
        viewing=options.viewing,
        pixels=Pixels(counted=int(ready.counted.sum()), total=ready.counted.size),
        machine=Machine.here(),
        versions=versions(),
        command=command,
        guard=ready.guard or Guard(),
        at=at,
        left_out=climb.ladder.left_out,
        engine=judged,
    )
    return Study(
        record=made,
        reference=climb.reference.mean,
        settings=engine.first_pictures(given, engine_times) if engine_times else {},
        methods=climb.images,
    )


def require_other_names(engine_times: EngineTimes) -> None:
    """Raise `InputError` if a setting has the name of a method."""
    known = {name for method in all_methods() for name in (method.name, *method.names)}
    for picture in engine_times.pictures:
        if picture.name in known:
            raise InputError(f"{picture.name!r} is a method of the study: give another name.")


def compared(
    given: GivenPictures, engine_times: EngineTimes, ready: Prepared
) -> dict[str, Comparison]:
    """Return the comparison of each setting's pictures with the scene's physical picture."""

    def halves(picture: TimedPicture, pictures: Pictures) -> Halves:
        both = ready.with_pictures(GivenPictures(image=pictures))
        # Nothing but the pictures is asked for: no doubt about the scene, and no terms.
        return replace(both, name=picture.name, has=PICTURES.needs)

    return engine.compare_all(given, engine_times, halves)


def quick(
    source: Source, options: Options, causes: Causes, progress: Progress, command: str
) -> Study[Cost]:
    """Study a compared scene with less effort, and predict for its own size; see :func:`cost`."""
    whole = requested(source, options)
    small = options.changed(resolution=reduced(source, options, QUICK_WIDTH), spp=None)
    return cost(source, small, QUICK, progress, command, at=whole, causes=causes)


def require_shape(target: Size, size: Size) -> None:
    """Reject a size of another shape than the study's."""
    (width, height), (wide, high) = sorted([size, target])
    if abs(high * width / wide - height) > 1:  # a pixel of the smaller one is tolerated
        raise InputError(
            f"{width}x{height} and {wide}x{high} differ in shape: give `resolution` the shape of"
            " `at`, or omit it."
        )


def attribution(climb: Climb, causes: Causes) -> CostAttribution:
    """Return what each effect removes, and what it adds to an image of the study's size.

    ``causes`` may be of another size. The steps lead from the kernel as requested to the full plan.
    """
    samples = ATTRIBUTED_SPP * climb.size[0] * climb.size[1]

    def adds(effect: str) -> Interval:
        return added([step for step in climb.steps if step.effect == effect], climb, samples)

    def takes(method: Method) -> Interval:
        seconds = samples * climb.time(method).per_sample
        return turns.middle(seconds, UNSEEN * float(np.median(seconds)))

    effects = (
        EffectCost(**structs.asdict(contribution), adds_s=adds(contribution.effect))
        for contribution in causes.record.effects
    )
    return CostAttribution(
        effects=tuple(effects),
        departure=causes.record.departure,
        size=causes.record.resolution,
        kernel_s=takes(climb.steps[0].before),
        plan_s=takes(climb.steps[-1].after),
        renderer_s=adds(""),
        resolution=climb.size,
        spp=ATTRIBUTED_SPP,
    )


def added(steps: Sequence[Step], climb: Climb, samples: int) -> Interval:
    """Return the seconds that steps add to an image of some samples."""
    total = np.zeros(climb.effort.rounds)
    unseen = []
    for step in steps:
        before = climb.time(step.before).per_sample
        after = climb.time(step.after).per_sample
        total += step.weight * (after - before)
        unseen += [step.weight * float(np.median(time)) for time in (before, after)]
    return turns.middle(samples * total, UNSEEN * samples * float(np.linalg.norm(unseen)))


def choose(
    source: Source, within: float, options: Options | None = None, progress: Progress | None = None
) -> Choice:
    """Measure the ladder of a scene, in the current variant, and choose from it.

    Errors are measured at a small size, times follow from the time per sample.
    """
    checked_threshold(within)
    options = options or Options()
    size = requested(source, options)
    climb = climbed(
        source,
        options.changed(resolution=None),
        Effort(),
        progress or (lambda *_: None),
        at=options.resolution,
        tolerance=within,
    )
    points = climb.points(size)
    return Choice(
        scene=source.name,
        resolution=size,
        measured=climb.size,
        within=within,
        points=points,
        textbook=climb.ladder.methods[0].name,
        chosen=cheapest(points, within),
        left_out=climb.ladder.left_out,
        stopped=climb.stopped,
    )
