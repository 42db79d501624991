"""Comparing the halves of a scene: both rendered pass by pass, and the difference measured."""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from time import perf_counter

import mitsuba as mi
import numpy as np

from comparisons import record, statistics
from comparisons.metrics import METRICS
from comparisons.record import Comparison, Images
from comparisons.significance import significance
from comparisons.spaces import DEFAULT_VIEWING, Viewing
from heuristic.errors import InputError
from heuristic.interpolation import Interpolation
from reference import halves, plan, rendering
from reference.gbuffer import gbuffer
from reference.halves import SAMPLER
from reference.pairing import Convention

LEVEL = 0.01
"""Chance that an image without any difference has one pixel marked as significant."""

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Options:
    """What can be chosen about a comparison.

    Parameters
    ----------
    seed
        Seed of the first pass; pass ``i`` has ``seed + i`` in both halves.
    spp
        Samples a pixel in all. They are split into an even number of passes: 16 where there are
        enough for 4 a pass, at least 2.
    resolution
        ``(width, height)`` in place of the film's own.
    convention
        How roughplastic and phong are paired.
    interpolation, tessellation
        How the heuristic half shades its surfaces, and how fine the meshes for it are.
    viewing
        How linear values are looked at.
    heuristic_variant
        Variant of the heuristic half where it is not the current one, as for RGB shading against a
        spectral reference.

    Raises
    ------
    InputError
        For fewer than 2 samples, a negative seed, or a resolution below 1.
    """

    seed: int = 0
    spp: int = 256
    resolution: tuple[int, int] | None = None
    convention: Convention = Convention.MATCHED
    interpolation: Interpolation = Interpolation.PHONG
    tessellation: int | None = None
    viewing: Viewing = DEFAULT_VIEWING
    heuristic_variant: str | None = None

    def __post_init__(self):
        if self.spp < 2:
            raise InputError(
                f"spp = {self.spp} is not allowed: the noise needs at least 2 samples."
            )
        if self.seed < 0:
            raise InputError(f"seed = {self.seed} is not allowed: give 0 or more.")
        if self.resolution is not None and min(self.resolution) < 1:
            width, height = self.resolution
            raise InputError(
                f"resolution {width}x{height} is not allowed: width and height are at least 1."
            )

    @property
    def passes(self):
        """Number of independent passes."""
        return max(2, min(16, self.spp // 4 // 2 * 2))

    @property
    def spp_of_a_pass(self):
        """Samples a pixel in each pass."""
        return max(1, self.spp // self.passes)


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
    progress = progress or _silent
    stages = _Stages()
    pair = _pair(source, options)
    chosen = plan.plan(pair)
    physical = pair.physical.instantiate()
    integrator = rendering.physical_integrator(chosen, pair.hide_emitters)
    reference = rendering.Renderer(physical, integrator, options.spp_of_a_pass, "reference image")
    heuristic = _heuristic_renderer(source, pair, options)
    stages.done("scene and pairing")
    estimates = _render(heuristic, reference, options, progress)
    stages.done("sums of passes", sum(heuristic.times) + sum(reference.times))
    width, height = (int(side) for side in physical.sensors()[0].film().crop_size())
    surface = gbuffer(physical, width, height)
    stages.done("geometry")
    metrics, images = _measure(estimates, surface, options)
    stages.done("metrics")

    data = {
        "scene": source.name,
        "variant": reference.variant,
        "heuristic_variant": heuristic.variant,
        "interpolation": options.interpolation.value,
        "seed": options.seed,
        "resolution": [width, height],
        "plan": record.plan_data(
            chosen, options.spp_of_a_pass * options.passes, options.passes, SAMPLER
        ),
        "viewing": options.viewing.record(),
        "metrics": metrics,
        "pixels": {"counted": int(images.counted.sum()), "total": width * height},
        "pairing": record.pairing_data(pair),
        "time": {
            "heuristic": record.times_data(heuristic.pass_times()),
            "reference": record.times_data(reference.pass_times()),
            "stages": stages.seconds,
        },
        "unrepresentable": [],
        "warnings": list(pair.warnings),
        "versions": record.versions(),
        "command": command,
    }
    return Comparison(data, images)


def _pair(source, options):
    return halves.pair(
        source,
        options.convention,
        options.resolution,
        options.interpolation,
        options.tessellation,
    )


def _heuristic_renderer(source, pair, options):
    """Make the heuristic half ready to render, in its own variant if it has one."""
    with rendering.variant(options.heuristic_variant or mi.variant()):
        if options.heuristic_variant:
            pair = _pair(source, options)
        scene = pair.heuristic.instantiate()
        return rendering.Renderer(scene, None, options.spp_of_a_pass, "heuristic image")


@dataclass(frozen=True)
class _Estimates:
    heuristic: rendering.Estimate
    reference: rendering.Estimate
    difference: rendering.Estimate


def _render(heuristic, reference, options, progress):
    """Render the passes of both halves in turn, so that a drift of the machine hits both."""
    sums = [rendering.Accumulator() for _ in range(3)]
    for number in range(options.passes):
        progress("rendering", number, options.passes)
        images = [half.render(options.seed + number) for half in (heuristic, reference)]
        images.append(mi.TensorXd(images[0]) - mi.TensorXd(images[1]))
        for total, image in zip(sums, images, strict=True):
            total.add(image)
    progress("rendering", options.passes, options.passes)
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
