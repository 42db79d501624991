"""Comparing the halves of a scene: render both pass by pass, and measure the difference."""

from __future__ import annotations

import gc
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from time import perf_counter
from typing import TYPE_CHECKING, Any

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
from comparisons.departure.spaces import Viewing
from comparisons.departure.statistics import histogram
from comparisons.options import Options
from comparisons.record import Comparison, Images
from comparisons.records import Pixels
from comparisons.render import Kept
from comparisons.terms import tracing
from heuristic import heuristics
from heuristic.arrays import Array, Scene
from heuristic.errors import InputError
from reference.pairing.halves import Pair
from reference.planning.plan import Plan, plan, sampler
from reference.rendering import memory
from reference.rendering.gbuffer import GBuffer, gbuffer, image_size, require_surface
from reference.rendering.guard import Guard, Verdict, examine_plan
from reference.rendering.passes import Progress
from reference.rendering.renderer import LARGEST_PASS, Renderer, physical_integrator, variant
from reference.scene import messages
from reference.scene.sampler import with_sampler
from reference.scene.source import Source

if TYPE_CHECKING:
    from comparisons.pictures.registration import Registration


@dataclass(frozen=True)
class Prepared:
    """A scene that is ready to be rendered: its halves, its plan, and a renderer for each half."""

    pair: Pair
    plan: Plan
    scene: Scene
    heuristic: Renderer
    reference: Renderer
    passes: int
    planning_seconds: float
    guard: Guard | None = None

    @property
    def surface(self) -> GBuffer:
        """What each pixel sees. It is traced each time: cached, it would take much memory."""
        found = gbuffer(self.scene, *image_size(self.scene))
        dr.flush_malloc_cache()
        return found

    @cached_property
    def counted(self) -> np.ndarray:
        """The pixels (H, W) that count: those that see a surface."""
        return self.surface.hit


def prepare(source: Source, options: Options | None = None) -> Prepared:
    """Pair and plan a scene in the current variant, and make both halves ready to render.

    Raises
    ------
    InputError
        When the scene cannot be read or paired, or its image is too large.
    """
    options = options or Options()
    if options.image:
        from comparisons.pictures import pictured

        options = pictured.sized(source, options)
    pair = options.pair(source)
    physical = with_sampler(pair.physical, sampler(options.everything)).instantiate()
    width, height = image_size(physical)
    if width * height > LARGEST_PASS:
        raise InputError(
            f"{source.name}: an image of {width}x{height} pixels is too large: at most"
            f" {LARGEST_PASS} pixels are allowed. Give a smaller --resolution."
        )
    memory.require(source.name, width, height)
    begin = perf_counter()
    chosen = plan(pair, physical, options.interpolation, options.everything)
    integrator = physical_integrator(chosen, physical, pair.hide_emitters)
    planning = perf_counter() - begin
    # Dr.Jit traces every live BSDF: those of finished scenes would slow this one.
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


def guarded(source: Source, options: Options | None = None) -> Prepared:
    """Prepare a scene with :func:`prepare`, and probe it before anything relies on its plan.

    If the probe disagrees with the plan, everything is simulated.

    Raises
    ------
    InputError
        See :func:`prepare`; also when no pixel sees a surface, unless the options allow it.
    """
    options = options or Options()
    ready = _probed(source, options)
    if not options.allow_empty:
        require_surface(ready.counted, source.name)
    return ready


def _probed(source: Source, options: Options) -> Prepared:
    ready = prepare(source, options)
    width, height = image_size(ready.scene)
    samples = ready.reference.spp * ready.passes * width * height
    hidden = ready.pair.hide_emitters
    found = examine_plan(ready.plan, ready.scene, hidden, samples, options.seed)
    if found.state is not Verdict.DISAGREED:
        return replace(ready, guard=found)
    whole = prepare(source, replace(options, everything=True))
    return replace(whole, plan=whole.plan.unpruned("guard", found.words), guard=found)


def compare(
    source: Source,
    options: Options | None = None,
    progress: Progress | None = None,
    command: str = "",
    kept: Kept | None = None,
    with_terms: bool = True,
) -> Comparison:
    """Compare the heuristic half of a scene with the physical one, in the current variant.

    Parameters
    ----------
    source
        The scene.
    options
        What to render, and how to judge it.
    progress
        Called as ``progress(stage, done, total)`` after each pass.
    command
        How to repeat the comparison, for the record.
    kept
        Holds the passes of an interrupted run, and takes those of this one
        (:func:`comparisons.render.render`).
    with_terms
        Whether to read the terms of equation 8.10.

    Returns
    -------
    Comparison

    Raises
    ------
    InputError
        When the scene cannot be read or paired, or no pixel sees a surface.
    NonFiniteError
        When a rendering holds a NaN or an infinity.
    """
    options = options or Options()
    said: list[str] = []
    with messages.collected(said):
        comparison = _compare(source, options, progress, command, kept, with_terms)
    told = messages.counted([*source.said, *said])
    made = structs.replace(comparison.record, warnings=(*comparison.record.warnings, *told))
    return replace(comparison, record=made)


def _compare(
    source: Source,
    options: Options,
    progress: Progress | None,
    command: str,
    kept: Kept | None,
    with_terms: bool,
) -> Comparison:
    stages = _Stages()
    ready = guarded(source, options)
    heuristic: Any = ready.heuristic  # a renderer, or pictures in its place
    reference, guard = ready.reference, ready.guard
    assert guard is not None
    stages.done("scene and pairing", ready.planning_seconds + guard.seconds)
    stages.seconds |= {"planning": ready.planning_seconds, "guard": guard.seconds}
    width, height = image_size(ready.scene)
    # Before any long rendering: a picture may be flipped.
    place = heuristic.located(ready.scene) if options.image else None
    estimates = render.render(ready, options, ready.counted, progress, kept)
    # Passes of an earlier run took no time in this one.
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
    terms, no_terms = tracing.trace(ready, options) if with_terms else (None, "")
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
            *record.guard_warnings(guard),
            *record.path_warnings(ready),
            *record.lamp_warnings(ready),
        ),
        versions=record.versions(),
        command=command,
        noise_target=estimates.stop,
        picture=picture,
        suspicions=_suspicions(options),
        **numbers,
    )
    return Comparison(made, images, terms, no_terms)


def _heuristic_renderer(
    source: Source, pair: Pair, chosen: Plan, spp: int, options: Options
) -> Any:
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


def _picture(place: Registration, options: Options, images: Images) -> PictureRecord:
    """Return the record of the pictures, and what is odd about them."""
    from comparisons.pictures import suspicions

    shown, reference = (each[images.counted] for each in (images.heuristic, images.reference))
    found = PictureRecord(
        files=options.image,
        transfer=options.transfer,
        repeats=len(options.image),
        shift=None if place.x is None or place.y is None else (place.x, place.y),
        edges=place.correlation,
        ratio=suspicions.ratios(shown, reference),
    )
    given = images.heuristic, images.reference, images.counted
    return structs.replace(found, odd=tuple(suspicions.told(found, *given)))


def _suspicions(options: Options) -> tuple[str, ...]:
    """Return what seems to be wrong with a user's heuristic."""
    if options.image or heuristics.named(options.heuristic).is_own:
        return ()
    from comparisons.audit import diagnosis

    return diagnosis.told(options.heuristic)


def _measure(
    estimates: render.Rendered, surface: GBuffer, options: Options, exact: bool
) -> tuple[dict[str, Any], Images]:
    """Compute fields of the record, and maps over the pixels that see a surface.

    The relevant uncertainty is that of the difference, in which shared noise cancels.
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


def leading_distance(viewing: Viewing) -> Callable[[Array, Array], Array]:
    """Return the leading metric, ``(test, reference) -> (N,)``, for colours (N, 3)."""
    return lambda test, reference: LEADING.against(reference, ..., viewing)(test)


class _Stages:
    """Wall time by stage, without the two renderings."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._begin = perf_counter()

    def done(self, name: str, rendering: float = 0.0) -> None:
        now = perf_counter()
        self.seconds[name] = now - self._begin - rendering
        self._begin = now
