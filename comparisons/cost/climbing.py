"""The ladder of one scene, timed and judged against a converged reference."""

import gc
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from comparisons.compare import Prepared, guarded
from comparisons.cost.cost_record import Measured
from comparisons.cost.effort import WIDTH, Effort, reduced
from comparisons.cost.judging import Judge, converged
from comparisons.cost.methods import Methods
from comparisons.cost.timing import Key, measure
from comparisons.departure.metric import Metric
from comparisons.departure.metrics import LEADING
from comparisons.options import Options
from reference.rendering.passes import Progress
from reference.rendering.sums import Estimate
from reference.scene.source import Source


@dataclass(frozen=True)
class Climbed:
    """A ladder whose methods were timed and judged.

    Attributes
    ----------
    options, effort
        Those used.
    ready
        The scene, paired, planned and guarded.
    methods
        The ladder.
    reference, groups
        The converged reference, and the means (R, H, W, 3) of groups of its passes.
    judge
        What measured the errors.
    measured, images
        See :func:`comparisons.cost.timing.measure`.
    """

    options: Options
    effort: Effort
    ready: Prepared
    methods: Methods
    reference: Estimate
    groups: np.ndarray
    judge: Judge
    measured: tuple[Measured, ...]
    images: Mapping[Key, np.ndarray]


def climb(
    source: Source,
    options: Options,
    effort: Effort,
    progress: Progress,
    metric: Metric = LEADING,
    at: tuple[int, int] | None = None,
) -> Climbed:
    """Time and judge every method of a scene's ladder, in the current variant.

    If ``options.resolution`` is omitted, that of ``at``, or of the film, is reduced to
    :data:`comparisons.cost.effort.WIDTH`. ``options.spp`` is the largest sample count of a Monte
    Carlo rung. Errors are means of ``metric``.

    Raises
    ------
    InputError
        When the scene cannot be read or paired, or none of its pixels sees a surface.
    NonFiniteError
        When a rendering holds a NaN or an infinity.
    """
    options.require_model("a study of cost")
    if options.resolution is None:
        shaped = replace(options, resolution=at)
        options = replace(options, resolution=reduced(source, shaped, WIDTH))
    if options.spp is not None:
        effort = replace(effort, largest=options.spp)
    ready = guarded(source, replace(options, spp=None, allow_empty=False))
    reference, groups = converged(ready, effort, options.seed, progress, groups=effort.replicates)
    judge = Judge(reference, ready.counted, options.viewing, metric)
    methods = Methods(source, options, ready, effort.depths, effort.stand_ins)
    measured, images = _measured(methods, effort, judge, options.seed, progress)
    return Climbed(options, effort, ready, methods, reference, groups, judge, measured, images)


def _measured(
    methods: Methods, effort: Effort, judge: Judge, seed: int, progress: Progress
) -> tuple[tuple[Measured, ...], dict[Key, np.ndarray]]:
    """Time and judge the rungs, then release their scenes, which would slow later work."""
    renderers = {
        (rung.name, spp): methods.renderer(rung.method, spp)
        for rung in methods.rungs
        for spp in (effort.counts if rung.monte_carlo else effort.deterministic)
    }
    gc.collect()  # release scenes that pairing left behind
    measured = measure(renderers, judge, effort.rounds, seed, progress)
    methods.forget()
    return measured
