"""Study what accuracy costs on one scene."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from msgspec import structs

from comparisons import record
from comparisons.cost.cost_record import Converged, Cost, LeftOut, Pictures
from comparisons.cost.front import equal_error, pareto
from comparisons.cost.measure import Effort, Size, measure_ladder
from comparisons.cost.predict import predict, require
from comparisons.hybrids.attribution import Causes, attribute
from comparisons.hybrids.hybrids import HybridImages
from comparisons.intervals import median_ranks
from comparisons.options import Options
from reference.planning.plan import Guard
from reference.records import Pixels
from reference.rendering.gbuffer import image_size
from reference.rendering.renderer import Progress
from reference.scene.source import Source


@dataclass(frozen=True)
class Study:
    """Results of a study: its record, ``cost.json``, and its images.

    ``methods`` are ``{method: (H, W, 3)}``, one rendering with the most samples of each.
    ``counted`` (H, W) are the pixels that count.
    """

    record: Cost
    methods: Mapping[str, np.ndarray]
    causes: Causes
    reference: np.ndarray
    counted: np.ndarray


def cost(
    source: Source,
    options: Options | None = None,
    effort: Effort | None = None,
    progress: Progress | None = None,
    command: str = "",
    at: Size | None = None,
    is_measured: bool = False,
) -> Study:
    """Study what accuracy costs on one scene, in the current variant.

    For ``source``, ``options``, ``progress`` and ``command`` see
    :func:`comparisons.compare.compare`, and :func:`comparisons.cost.measure.measure_ladder` for an
    omitted resolution and ``options.spp``. ``at`` is a size to predict for, where methods are also
    measured if ``is_measured``.
    """
    progress = progress or (lambda *_: None)
    options = options or Options()
    if at:
        require(source.name, at, options.resolution, is_measured)
    found = measure_ladder(source, options, effort or Effort(), progress, at=at)
    options, effort, ready, ladder = found.options, found.effort, found.ready, found.ladder
    counted, shapes = ready.counted, ready.surface.shape  # a prediction resizes the films
    width, height = image_size(ready.scene)
    progress("attributing", 0, 1)
    hybrids = HybridImages(
        ladder.pairs,
        ladder.scenes,
        effort.replicates,
        effort.replicate_spp,
        options.seed,
        (width, height),
    )
    causes = attribute(
        hybrids, found.meter, shapes, options.seed, effort.exact_effects, effort.orders
    )
    progress("attributing", 1, 1)
    prediction = predict(ladder, at, effort, options.seed, is_measured, progress) if at else None

    front = pareto(found.points)
    points = tuple(structs.replace(point, pareto=point in front) for point in found.points)
    made = Cost(
        scene=source.name,
        variant=ready.reference.variant,
        heuristic_variant=ladder.heuristic_variant,
        heuristic=options.heuristic,
        interpolation=options.polygon_shading,
        seed=options.seed,
        resolution=(width, height),
        rounds=effort.rounds,
        level=median_ranks(effort.rounds)[2],
        reference=Converged(
            integrator=ready.plan.integrator,
            max_depth=ready.plan.max_depth,
            spp=effort.reference_spp * found.reference.passes,
            passes=found.reference.passes,
            noise_floor=found.meter.floor,
            mean_variance=found.meter.variance,
        ),
        methods=ladder.methods,
        points=points,
        equal_error=equal_error(points),
        attribution=causes.record,
        closure=causes.record.closure,
        objects=causes.record.objects,
        viewing=options.viewing,
        pixels=Pixels(counted=int(counted.sum()), total=width * height),
        machine=record.machine(),
        versions=record.versions(),
        command=command,
        guard=ready.guard or Guard(),
        prediction=prediction,
        left_out=tuple(
            LeftOut(name=name, reason=reason) for name, reason in ladder.left_out.items()
        ),
        pictures=Pictures(
            effect_limit=float(max([1.0, *(abs(values).max() for values in causes.maps.values())]))
        ),
    )
    return Study(
        record=made,
        methods=found.images,
        causes=causes,
        reference=found.reference.mean,
        counted=counted,
    )
