"""Study what accuracy costs on one scene."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from msgspec import structs

from comparisons import record
from comparisons.cost.cost_record import Converged, Cost, LeftOut, Pictures
from comparisons.cost.front import equal_error, pareto
from comparisons.cost.measure import QUICK, QUICK_WIDTH, Effort, Size, measure_ladder, reduced
from comparisons.cost.predict import predict, require
from comparisons.hybrids.attribution import Causes, attribute, by_object, split
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

    ``methods`` are ``{method: (H, W, 3)}``, one rendering with the most samples of each. ``parts``
    are ``{part: (H, W, 3)}``, signed and linear; they add up to ``difference``, reference minus
    kernel. ``counted`` (H, W) are the pixels that count.
    """

    record: Cost
    methods: Mapping[str, np.ndarray]
    parts: Mapping[str, np.ndarray]
    difference: np.ndarray
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
        ladder.pairs, ladder.scenes, effort.replicates, effort.replicate_spp, options.seed
    )
    causes = attribute(hybrids, found.meter, options.seed, effort.exact_effects, effort.orders)
    parts, pictures, difference = split(hybrids, counted, options.viewing)
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
        attribution=causes.attribution,
        closure=causes.closure,
        split=parts,
        viewing=options.viewing,
        pixels=Pixels(counted=int(counted.sum()), total=width * height),
        machine=record.machine(),
        versions=record.versions(),
        command=command,
        guard=ready.guard or Guard(),
        prediction=prediction,
        objects=by_object(causes, counted, shapes),
        left_out=tuple(
            LeftOut(name=name, reason=reason) for name, reason in ladder.left_out.items()
        ),
        pictures=_limits(pictures.values(), causes.maps.values()),
    )
    return Study(
        record=made,
        methods=found.images,
        parts=pictures,
        difference=difference,
        causes=causes,
        reference=found.reference.mean,
        counted=counted,
    )


def quick(
    source: Source,
    options: Options | None = None,
    progress: Progress | None = None,
    command: str = "",
    effort: Effort = QUICK,
) -> Study:
    """Study a scene as :func:`cost` does, but quickly: for many scenes in one report."""
    options = options or Options()
    small = options.changed(resolution=reduced(source, options, QUICK_WIDTH), spp=None)
    return cost(source, small, effort, progress, command)


def _limits(parts: Iterable[np.ndarray], effects: Iterable[np.ndarray]) -> Pictures:
    """Return half ranges that hold all pictures, with minima far above rounding."""
    limits = [abs(signed.mean(axis=2)).max() for signed in parts]
    removed = [abs(values).max() for values in effects]
    return Pictures(
        part_limit=float(max(1e-3, *limits)), effect_limit=float(max(1.0, *removed, 0.0))
    )
