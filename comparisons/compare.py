"""Comparing the halves of a scene: both rendered pass by pass, and the difference measured."""

import gc
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from time import perf_counter

import drjit as dr
import mitsuba as mi
import numpy as np
from msgspec import structs

from comparisons import record, render
from comparisons.comparison import (
    ComparisonRecord,
    PictureRecord,
    Significant,
    TimeSpent,
)
from comparisons.departure import limits, marks, objects, regions, statistics
from comparisons.departure.metrics import LEADING, METRICS, RATIO, drawn
from comparisons.departure.statistics import histogram
from comparisons.options import Options
from comparisons.record import Comparison, Images
from comparisons.records import Pixels
from comparisons.terms import tracing
from heuristic import heuristics
from heuristic.errors import InputError
from reference.pairing.halves import Pair
from reference.planning.plan import Plan, plan, sampler
from reference.rendering import memory
from reference.rendering.gbuffer import GBuffer, gbuffer, image_size, require_surface
from reference.rendering.guard import Guard, Verdict, examine_plan
from reference.rendering.renderer import LARGEST_PASS, Renderer, physical_integrator, variant
from reference.scene import messages
from reference.scene.sampler import with_sampler

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Prepared:
    """A scene that is ready to be rendered: its halves, its plan, and a renderer for each half."""

    pair: Pair
    plan: Plan
    scene: object
    heuristic: Renderer
    reference: Renderer
    passes: int
    planning_seconds: float
    guard: Guard | None = None

    @property
    def surface(self) -> GBuffer:
        """What each pixel sees, traced each time: it is large beside the sums of the passes."""
        found = gbuffer(self.scene, *image_size(self.scene))
        dr.flush_malloc_cache()
        return found

    @cached_property
    def counted(self) -> np.ndarray:
        """The pixels (H, W) that count, which are those that see a surface."""
        return self.surface.hit


def prepare(source, options=None):
    """Pair and plan a scene in the current variant, and make both halves ready to render."""
    options = options or Options()
    if options.image:
        from comparisons.pictures import pictured

        options = pictured.sized(source, options)
    pair = options.pair(source)
    physical = with_sampler(pair.physical, sampler(options.everything)).instantiate()
    width, height = image_size(physical)
    if width * height > LARGEST_PASS:
        raise InputError(
            f"{source.name}: an image of {width}x{height} pixels is too large:"
            f" {LARGEST_PASS} pixels are allowed. Give a smaller one with --resolution."
        )
    memory.require(source.name, width, height)
    begin = perf_counter()
    chosen = plan(pair, physical, options.interpolation, options.everything)
    integrator = physical_integrator(chosen, physical, pair.hide_emitters)
    planning = perf_counter() - begin
    # Dr.Jit traces every BSDF that is alive: those of scenes that are done with slow this one.
    gc.collect()
    planned = render.schedule(chosen, width * height, options.spp, options.noise)
    if len(options.image) > 1:
        planned = render.Schedule.of(planned.spp * planned.passes, len(options.image))
    return Prepared(
        pair=pair,
        plan=chosen,
        scene=physical,
        heuristic=_heuristic_renderer(source, pair, chosen, planned.spp, options),
        reference=Renderer(physical, integrator, planned.spp, "reference image"),
        passes=planned.passes,
        planning_seconds=planning,
    )


def guarded(source, options=None):
    """Prepare a scene as :func:`prepare` does, and probe it before anything relies on its plan.

    Where the probe disagrees with the plan, everything is simulated.

    Raises
    ------
    InputError
        As :func:`prepare`, and where no pixel sees a surface, unless the options allow that.
    """
    options = options or Options()
    ready = _probed(source, options)
    if not options.allow_empty:
        require_surface(ready.counted, source.name)
    return ready


def _probed(source, options):
    ready = prepare(source, options)
    width, height = image_size(ready.scene)
    samples = ready.reference.spp * ready.passes * width * height
    hidden = ready.pair.hide_emitters
    found = examine_plan(ready.plan, ready.scene, hidden, samples, options.seed)
    if found.state is not Verdict.DISAGREED:
        return replace(ready, guard=found)
    whole = prepare(source, replace(options, everything=True))
    return replace(whole, plan=whole.plan.unpruned("guard", found.words), guard=found)


def compare(source, options=None, progress=None, command="", kept=None):
    """Compare the heuristic with the physical half of a scene, in the current variant.

    Parameters
    ----------
    source : reference.scene.source.Source
        The scene.
    options : Options, optional
        What is rendered, and how it is judged.
    progress : callable, optional
        Called as ``progress(stage, done, total)`` after each pass.
    command
        How to repeat the comparison, for the record.
    kept : optional
        Where the passes of an interrupted run are, and those of this one go
        (:func:`comparisons.render.render`).

    Returns
    -------
    Comparison

    Raises
    ------
    InputError
        When the scene cannot be read or paired, or no pixel of it sees a surface.
    NonFiniteError
        When a rendering holds a NaN or an infinity.
    """
    options = options or Options()
    said: list[str] = []
    with messages.collected(said):
        comparison = _compare(source, options, progress, command, kept)
    told = messages.counted([*source.said, *said])
    made = structs.replace(comparison.record, warnings=(*comparison.record.warnings, *told))
    return replace(comparison, record=made)


def _compare(source, options, progress, command, kept):
    stages = _Stages()
    ready = guarded(source, options)
    heuristic, reference = ready.heuristic, ready.reference
    stages.done("scene and pairing", ready.planning_seconds + ready.guard.seconds)
    stages.seconds |= {"planning": ready.planning_seconds, "guard": ready.guard.seconds}
    width, height = image_size(ready.scene)
    # Before anything is rendered that takes long: a picture may be turned over.
    place = ready.heuristic.located(ready.scene) if options.image else None
    estimates = render.render(ready, options, ready.counted, progress, kept)
    # Passes of an earlier run took their time then, not now.
    rendering = sum(heuristic.times[-estimates.new :]) + sum(reference.times[-estimates.new :])
    stages.done("sums of passes", rendering if estimates.new else 0.0)
    numbers, images = _measure(
        estimates, ready.surface, options, ready.plan.exact and not options.image
    )
    picture = _picture(place, options, images) if place else None
    stages.done("metrics")
    faults = limits.count(
        ready.scene,
        estimates.reference,
        estimates.standard_error,
        images.counted,
    )
    stages.done("limits of the reference")
    terms, no_terms = tracing.trace(ready, options)
    stages.done("terms")
    made = ComparisonRecord(
        scene=source.name,
        variant=reference.variant,
        heuristic_variant=heuristic.variant,
        heuristic=f"picture {', '.join(options.image)}" if options.image else options.heuristic,
        interpolation=options.interpolation.value,
        seed=options.seed,
        resolution=(width, height),
        plan=record.plan_record(ready, estimates.passes),
        viewing=options.viewing,
        pixels=Pixels(counted=int(images.counted.sum()), total=width * height),
        limits=faults,
        regions=regions.find(images.maps[LEADING.name], images.counted),
        histograms={name: histogram(images.maps[name][images.counted]) for name in drawn()},
        pairing=record.pairing(ready.pair),
        time=TimeSpent(
            heuristic=record.times(heuristic.pass_times()),
            reference=record.times(reference.pass_times()),
            stages=stages.seconds,
        ),
        unrepresentable=record.unrepresentable(ready.pair),
        integrator_given=ready.pair.integrator,
        overridden=record.overridden(ready.pair, ready.plan, reference.spp * ready.passes),
        warnings=(
            *(picture.odd if picture else ()),
            *ready.pair.warnings,
            *record.guard_warnings(ready.guard),
            *record.path_warnings(ready),
        ),
        versions=record.versions(),
        command=command,
        noise_target=estimates.stop,
        picture=picture,
        suspicions=_suspicions(options),
        **numbers,
    )
    return Comparison(made, images, terms, no_terms)


def _heuristic_renderer(source, pair, chosen, spp, options):
    """Make the heuristic half ready to render, in its own variant if it has one."""
    with variant(options.heuristic_variant or mi.variant()):
        if options.heuristic_variant:
            pair = options.pair(source)
        scene = with_sampler(pair.heuristic, chosen.sampler).instantiate()
        made = Renderer(scene, None, spp, "heuristic image")
        if not options.image:
            return made
        from comparisons.pictures import pictured

        return pictured.Pictured(pictured.read(options), made)


def _picture(place, options, images):
    """Return the record of the pictures, and what is odd about them."""
    from comparisons.pictures import suspicions

    shown, reference = (each[images.counted] for each in (images.heuristic, images.reference))
    found = PictureRecord(
        files=options.image,
        transfer=options.transfer,
        repeats=len(options.image),
        shift=None if place.x is None else (place.x, place.y),
        edges=place.correlation,
        ratio=suspicions.ratios(shown, reference),
    )
    given = images.heuristic, images.reference, images.counted
    return structs.replace(found, odd=tuple(suspicions.told(found, *given)))


def _suspicions(options):
    """Return what seems to be wrong with a user's own heuristic."""
    if options.image or heuristics.named(options.heuristic).is_own:
        return ()
    from comparisons.audit import diagnosis

    return diagnosis.told(options.heuristic)


def _measure(estimates, surface, options, exact):
    """Compute numbers, as fields of the record, and maps over the pixels that see a surface.

    The doubt in question is that of the difference: what both halves share cancels in it.
    """
    test, reference = estimates.heuristic, estimates.reference
    noise = estimates.difference.noise
    counted = surface.hit
    metrics, maps = {}, {}
    for name, metric in METRICS.items():
        metrics[name], found = statistics.summarise(
            metric,
            test,
            reference,
            counted,
            options.viewing,
            noise,
            estimates.difference.grouped,
        )
        if metric.drawn:
            maps[name] = found
    ratio, maps[RATIO.name] = statistics.summarise_log2_luminance(test, reference, counted)
    significant = marks.find(
        estimates.difference, test, counted, leading_distance(options.viewing), exact=exact
    )
    error = maps[LEADING.name]
    shapes, seen = objects.find(error, counted, surface.shape, surface.bsdf)
    materials, made_of = objects.find(error, counted, surface.bsdf)
    images = Images(
        heuristic=test,
        reference=reference,
        reference_stderr=estimates.standard_error,
        position=surface.position,
        normal=surface.normal,
        maps=maps,
        significant=significant,
        counted=counted,
        objects=seen,
        materials=made_of,
    )
    numbers = {
        "objects": shapes,
        "materials": materials,
        "metrics": metrics,
        "log2_luminance": ratio,
        "significant": Significant(
            fraction=statistics.share(significant[counted] == marks.MARKED),
            undetermined=statistics.share(significant[counted] == marks.UNDETERMINED),
            level=marks.LEVEL,
        ),
    }
    return numbers, images


def leading_distance(viewing):
    """Return ``(test, reference) -> (N,)``: distances of colours (N, 3) in the leading metric."""
    return lambda test, reference: LEADING.against(reference, ..., viewing)(test)


class _Stages:
    """Wall time by stage, without that of the two renderings."""

    def __init__(self):
        self.seconds = {}
        self._begin = perf_counter()

    def done(self, name, rendering=0.0):
        now = perf_counter()
        self.seconds[name] = now - self._begin - rendering
        self._begin = now
