"""Comparing the halves of a scene: both rendered pass by pass, and the difference measured."""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from time import perf_counter

import mitsuba as mi
import numpy as np

from comparisons import record, reference_limits, statistics
from comparisons.metrics import METRICS
from comparisons.options import Options
from comparisons.record import Comparison, Images
from comparisons.significance import significance
from reference import halves
from reference.gbuffer import gbuffer
from reference.halves import Pair
from reference.plan import Plan, plan, sampler
from reference.rendering import Accumulator, Estimate, Renderer, physical_integrator, variant

LEVEL = 0.01
"""Chance that an image without any difference has one pixel marked as significant."""

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


def prepare(source, options=None):
    """Pair and plan a scene in the current variant, and make both halves ready to render.

    Raises
    ------
    InputError
        When the scene cannot be read or paired.
    """
    options = options or Options()
    pair = _pair(source, options)
    physical = halves.with_sampler(pair.physical, sampler(options.everything)).instantiate()
    begin = perf_counter()
    chosen = plan(pair, physical, options.interpolation, options.everything)
    integrator = physical_integrator(chosen, physical, pair.hide_emitters)
    planning = perf_counter() - begin
    passes, spp = _passes(options.spp or chosen.spp, chosen.passes)
    return Prepared(
        pair=pair,
        plan=chosen,
        scene=physical,
        heuristic=_heuristic_renderer(source, pair, chosen, spp, options),
        reference=Renderer(physical, integrator, spp, "reference image"),
        passes=passes,
        planning_seconds=planning,
    )


def compare(source, options=None, progress=None, command=""):
    """Compare the heuristic with the physical half of a scene, in the current variant.

    Parameters
    ----------
    source : reference.scene.Source
        The scene.
    options : Options, optional
        What is rendered, and how it is judged.
    progress : callable, optional
        Called as ``progress(stage, done, total)`` after each pass.
    command
        How to repeat the comparison, for the record.

    Returns
    -------
    Comparison

    Raises
    ------
    InputError
        When the scene cannot be read or paired.
    NonFiniteError
        When a rendering holds a NaN or an infinity.
    """
    options = options or Options()
    stages = _Stages()
    ready = prepare(source, options)
    heuristic, reference = ready.heuristic, ready.reference
    stages.done("scene and pairing", ready.planning_seconds)
    stages.seconds["planning"] = ready.planning_seconds
    estimates = _render(ready, options.seed, progress or _silent)
    stages.done("sums of passes", sum(heuristic.times) + sum(reference.times))
    width, height = (int(side) for side in ready.scene.sensors()[0].film().crop_size())
    surface = gbuffer(ready.scene, width, height)
    stages.done("geometry")
    metrics, images = _measure(estimates, surface, options)
    stages.done("metrics")
    limits = reference_limits.find(
        reference_limits.of_scene(ready.scene, width, height),
        estimates.reference.mean,
        estimates.reference.standard_error,
        images.counted,
    )
    stages.done("limits of the reference")

    data = {
        "scene": source.name,
        "variant": reference.variant,
        "heuristic_variant": heuristic.variant,
        "interpolation": options.interpolation.value,
        "seed": options.seed,
        "resolution": [width, height],
        "plan": record.plan_data(ready.plan, reference.spp * ready.passes, ready.passes),
        "viewing": options.viewing.record(),
        "metrics": metrics,
        "pixels": {"counted": int(images.counted.sum()), "total": width * height},
        "limits": limits.data(),
        "pairing": record.pairing_data(ready.pair),
        "time": {
            "heuristic": record.times_data(heuristic.pass_times()),
            "reference": record.times_data(reference.pass_times()),
            "stages": stages.seconds,
        },
        "unrepresentable": record.unrepresentable_data(ready.pair),
        "integrator_given": ready.pair.integrator,
        "overridden": record.overridden_data(ready.pair, ready.plan, reference.spp * ready.passes),
        "warnings": list(ready.pair.warnings),
        "versions": record.versions(),
        "command": command,
    }
    return Comparison(data, images)


def _passes(spp, wanted):
    """Return the number of passes, which is even, and the samples a pixel of each."""
    passes = max(2, min(wanted, spp // 4 // 2 * 2))
    return passes, max(1, spp // passes)


def _pair(source, options):
    return halves.pair(
        source,
        options.convention,
        options.resolution,
        options.interpolation,
        options.tessellation,
        prune=not options.everything,
        sensor=options.sensor,
    )


def _heuristic_renderer(source, pair, chosen, spp, options):
    """Make the heuristic half ready to render, in its own variant if it has one."""
    with variant(options.heuristic_variant or mi.variant()):
        if options.heuristic_variant:
            pair = _pair(source, options)
        scene = halves.with_sampler(pair.heuristic, chosen.sampler).instantiate()
        return Renderer(scene, None, spp, "heuristic image")


@dataclass(frozen=True)
class _Estimates:
    heuristic: Estimate
    reference: Estimate
    difference: Estimate


def _render(ready, seed, progress):
    """Render the passes of both halves in turn, so that a drift of the machine hits both."""
    sums = [Accumulator() for _ in range(3)]
    for number in range(ready.passes):
        progress("rendering", number, ready.passes)
        images = [half.render(seed + number) for half in (ready.heuristic, ready.reference)]
        images.append(mi.TensorXd(images[0]) - mi.TensorXd(images[1]))
        for total, image in zip(sums, images, strict=True):
            total.add(image)
    progress("rendering", ready.passes, ready.passes)
    return _Estimates(*(total.estimate() for total in sums))


def _measure(estimates, surface, options):
    """Compute all metrics and maps over the pixels whose centre sees a surface.

    The doubt in question is that of the difference: what both halves share cancels in it.
    """
    test, reference = estimates.heuristic.mean, estimates.reference.mean
    noise = estimates.difference.noise
    counted = surface.hit
    metrics, maps = {}, {}
    for name, metric in METRICS.items():
        summary, maps[name] = statistics.summarise(
            metric, test, reference, counted, options.viewing, noise
        )
        metrics[name] = asdict(summary)
    metrics["rmse"] = asdict(statistics.summarise_rmse(test, reference, counted, noise))
    ratio, maps["log2_luminance"] = statistics.summarise_log2_luminance(test, reference, counted)
    metrics["log2_luminance"] = asdict(ratio)
    significant = significance(
        estimates.difference.mean,
        estimates.difference.standard_error,
        estimates.difference.passes,
        max(int(counted.sum()), 1),
        LEVEL,
        magnitude=np.maximum(np.abs(test), np.abs(reference)),
    )
    fraction = float(significant[counted].mean()) if counted.any() else 0.0
    metrics["significant"] = {"fraction": fraction, "level": LEVEL}
    images = Images(
        heuristic=test,
        reference=reference,
        reference_stderr=estimates.reference.standard_error,
        position=surface.position,
        normal=surface.normal,
        maps=maps,
        significant=significant,
        counted=counted,
    )
    return metrics, images


class _Stages:
    """Wall time by stage, without that of the two renderings."""

    def __init__(self):
        self.seconds = {}
        self._begin = perf_counter()

    def done(self, name, rendering=0.0):
        now = perf_counter()
        self.seconds[name] = now - self._begin - rendering
        self._begin = now


def _silent(stage, done, total):
    """Report no progress."""
