"""The ladder of one scene, timed and judged against a converged reference."""

import gc
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from comparisons.compare import Prepared, guarded
from comparisons.cost.cost_record import Measured
from comparisons.cost.effort import DETERMINISTIC_SPP, WIDTH, Effort, reduced
from comparisons.cost.methods import Methods
from comparisons.cost.prediction import require_shape
from comparisons.cost.timing import Judge, measure
from comparisons.departure.metric import Metric
from comparisons.departure.metrics import LEADING
from comparisons.options import Options
from reference.rendering.passes import Stream, passes
from reference.rendering.renderer import Renderer
from reference.rendering.sums import Accumulator, Estimate, Mean
from reference.scene.source import Source


@dataclass(frozen=True)
class Climbed:
    """A ladder whose methods were timed and judged.

    Attributes
    ----------
    options, effort
        As rendered.
    ready
        The scene, paired, planned and guarded.
    methods
        The ladder.
    reference, groups
        What errors are told against, and the means (R, H, W, 3) of its passes in groups.
    judge
        What told the errors.
    measured, images
        Of :func:`comparisons.cost.timing.measure`.
    """

    options: Options
    effort: Effort
    ready: Prepared
    methods: Methods
    reference: Estimate
    groups: np.ndarray
    judge: Judge
    measured: tuple[Measured, ...]
    images: Mapping[tuple[str, int], np.ndarray]


def climb(
    source: Source,
    options: Options,
    effort: Effort,
    progress: Callable[..., Any],
    metric: Metric = LEADING,
    at: tuple[int, int] | None = None,
) -> Climbed:
    """Time and judge every method of a scene's ladder, in the current variant.

    Without a resolution, the film's own is reduced to :data:`comparisons.cost.effort.WIDTH`;
    ``options.spp`` are the most samples of a Monte Carlo rung. ``metric`` tells errors; ``at`` is a
    size that the one rendered is to have the shape of.

    Raises
    ------
    InputError
        When the scene cannot be read or paired, or no pixel of it sees a surface.
    NonFiniteError
        When a rendering holds a NaN or an infinity.
    """
    options.require_model("a study of cost")
    if options.resolution is None:
        shaped = replace(options, resolution=at)
        options = replace(options, resolution=reduced(source, shaped, WIDTH))
    elif at is not None:
        require_shape(options.resolution, at)
    if options.spp is not None:
        effort = replace(effort, largest=options.spp)
    ready = guarded(source, replace(options, spp=None, allow_empty=False))
    reference, groups = _converged(ready, effort, options.seed, progress)
    judge = Judge(reference, ready.counted, options.viewing, metric)
    methods = Methods(source, options, ready, effort.depths)
    measured, images = _measured(methods, effort, judge, options.seed, progress)
    return Climbed(options, effort, ready, methods, reference, groups, judge, measured, images)


def _measured(methods, effort, judge, seed, progress):
    """Time and judge the rungs; their scenes are released, since they slow what follows."""
    renderers = {
        (rung.name, spp): methods.renderer(rung.method, spp)
        for rung in methods.rungs
        for spp in (effort.counts if rung.monte_carlo else (DETERMINISTIC_SPP,))
    }
    gc.collect()  # scenes that pairing left behind
    measured = measure(renderers, judge, effort.rounds, seed, progress)
    methods.forget()
    return measured


def _converged(ready, effort, seed, progress):
    """Render the reference that errors are told against, with seeds that no rung has.

    Returns its :class:`~reference.rendering.sums.Estimate`, and the means (R, H, W, 3) of its
    passes in as many groups as there are replicates.
    """
    renderer = Renderer(
        ready.scene, ready.reference.integrator, effort.reference_spp, "reference image"
    )
    total, groups = Accumulator(), [Mean() for _ in range(effort.replicates)]
    each = 2 * -(-ready.plan.passes // (2 * len(groups)))
    count, stream = each * len(groups), Stream.OTHER_SIDE
    for one in passes([renderer], seed, count, stream=stream, progress=progress, stage="reference"):
        total.add(one.images[0])
        groups[one.number % len(groups)].add(one.images[0])
    return total.estimate(), np.stack([group.mean() for group in groups])
