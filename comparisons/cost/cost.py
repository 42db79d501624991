"""Study what accuracy costs on one scene."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from msgspec import structs

from comparisons import record
from comparisons.cost.climbing import Climbed, climb
from comparisons.cost.cost_record import (
    Converged,
    Cost,
    LeftOut,
    Measured,
    Pictures,
    Prediction,
    Prices,
    Rung,
    Split,
)
from comparisons.cost.effort import QUICK, QUICK_WIDTH, Effort, reduced
from comparisons.cost.front import equal_error, equal_time, pareto
from comparisons.cost.judging import judged
from comparisons.cost.object_prices import object_prices
from comparisons.cost.prediction.asked_prices import at_size
from comparisons.cost.prediction.forecasting import predict
from comparisons.cost.prediction.target import Size, require
from comparisons.cost.timing import Key
from comparisons.effects.lattice import Lattice
from comparisons.effects.noiseless import Noiseless
from comparisons.effects.prices import prices
from comparisons.effects.split import split
from comparisons.options import Options
from comparisons.records import Pixels
from reference.rendering.gbuffer import image_size
from reference.rendering.guard import Guard, Verdict
from reference.rendering.passes import Progress
from reference.scene.source import Source


@dataclass(frozen=True)
class Study:
    """Results of a study: its record, ``cost.json``, and its images.

    Attributes
    ----------
    record
        The contents of files, tables and charts.
    points
        ``{(rung name, samples per pixel): (H, W, 3)}``: one rendering of each measured point.
    parts
        ``{part: (H, W, 3)}``, signed and linear.
    difference
        (H, W, 3): reference minus kernel, which the parts add up to.
    effects
        ``{effect: (H, W)}``: the ΔE2000 that it removes.
    error
        (H, W): the kernel's ΔE2000, the sum of ``effects`` and ``left``.
    left
        (H, W): the ΔE2000 that remains when all effects are simulated.
    reference
        (H, W, 3).
    counted
        (H, W): the pixels that count.
    previews
        ``{simulated effects: (f H, f W, 3)}`` for every corner of the lattice, linear.
    """

    record: Cost
    points: Mapping[Key, np.ndarray]
    parts: dict[str, np.ndarray]
    difference: np.ndarray
    effects: dict[str, np.ndarray]
    error: np.ndarray
    left: np.ndarray
    reference: np.ndarray
    counted: np.ndarray
    previews: dict

    @property
    def rungs(self) -> dict[str, np.ndarray]:
        """``{rung name: (H, W, 3)}``, with the most samples."""
        return {name: image for (name, _), image in self.points.items()}


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

    Parameters
    ----------
    source, options, progress, command
        See :func:`comparisons.compare.compare`, and :func:`comparisons.cost.climbing.climb` for an
        omitted resolution and ``options.spp``.
    effort
        How much is rendered.
    at
        Width and height to predict time and error for (:mod:`comparisons.cost.prediction`).
    is_measured
        Whether to measure at that size, too.

    Raises
    ------
    InputError
        When the scene cannot be read or paired, or none of its pixels sees a surface; for a size
        ``at`` that is too small, too large, or of another shape than ``options.resolution``.
    NonFiniteError
        When a rendering holds a NaN or an infinity.
    """
    progress = progress or (lambda *_: None)
    options = options or Options()
    if at:
        require(source.name, at, options.resolution, is_measured)
    found = climb(source, options, effort or Effort(), progress, at=at)
    options, effort, ready, judge = found.options, found.effort, found.ready, found.judge
    methods, reference, counted = found.methods, found.reference, ready.counted
    width, height = image_size(ready.scene)
    lattice = Lattice(options, methods, effort.replicates, effort.replicate_spp, options.seed)
    progress("pricing effects", 0, 1)
    noiseless = Noiseless(judge, found.groups)
    priced = prices(lattice, noiseless, options.seed, effort.exact_effects, effort.orders)
    *parts, (whole, difference) = split(lattice, counted, options.viewing)
    progress("pricing effects", 1, 1)
    # Last, since it changes the sizes of the scenes' films.
    prediction = (
        _predicted(found, priced.prices, (width, height), at, is_measured, progress) if at else None
    )

    made = Cost(
        scene=source.name,
        variant=ready.reference.variant,
        heuristic_variant=methods.heuristic_variant,
        heuristic=options.heuristic,
        interpolation=options.interpolation,
        seed=options.seed,
        resolution=(width, height),
        rounds=effort.rounds,
        reference=Converged(
            integrator=ready.plan.integrator,
            max_depth=ready.plan.max_depth,
            spp=effort.reference_spp * reference.passes,
            passes=reference.passes,
            noise_floor=judge.floor,
            mean_variance=judge.variance,
        ),
        rungs=tuple(Rung(r.name, r.names, r.monte_carlo, r.family) for r in methods.rungs),
        **_compared(found.measured),
        prices=priced.prices,
        closure=priced.closure,
        split=Split(tuple(part for part, _ in parts), whole),
        viewing=options.viewing,
        pixels=Pixels(counted=int(counted.sum()), total=width * height),
        machine=record.machine(),
        versions=record.versions(),
        command=command,
        guard=record.guard_record(ready.guard or Guard(Verdict.NOT_NEEDED)),
        prediction=prediction,
        objects=object_prices(priced, counted, ready.surface.shape),
        left_out=tuple(LeftOut(*pair) for pair in methods.left_out.items()),
        pictures=_limits([image for _, image in parts], priced.maps.values()),
    )
    return Study(
        record=made,
        points=found.images,
        parts={part.name: image for part, image in parts},
        difference=difference,
        effects=priced.maps,
        error=priced.departure,
        left=priced.left,
        reference=reference.mean,
        counted=counted,
        previews=priced.previews,
    )


def _predicted(
    found: Climbed, larger: Prices, studied: Size, at: Size, is_measured: bool, progress: Progress
) -> Prediction:
    """Predict the cost of methods and effects at a size."""
    effort, options, methods = found.effort, found.options, found.methods
    half = max(studied[0] // 2, 1), max(studied[1] // 2, 1)
    given = found.ready, options.viewing, effort, options.seed, progress
    noiseless = Noiseless(*judged(*given, half, effort.replicates))
    replicates, spp = effort.replicates, effort.replicate_spp
    lattice = Lattice(options, methods, replicates, spp, options.seed, half)
    smaller = prices(lattice, noiseless, options.seed, effort.exact_effects, effort.orders).prices
    made = predict(methods, at, effort, options.seed, is_measured, progress)
    return structs.replace(made, prices=at_size(smaller, larger, (half, studied), at))


def quick(
    source: Source,
    options: Options | None = None,
    progress: Progress | None = None,
    command: str = "",
    effort: Effort = QUICK,
) -> Study:
    """Study a scene as :func:`cost` does, but quickly: for many scenes in one report."""
    options = options or Options()
    small = replace(options, resolution=reduced(source, options, QUICK_WIDTH), spp=None)
    return cost(source, small, effort, progress, command)


def _compared(measured: Sequence[Measured]) -> dict[str, Any]:
    """Return the points with the front marked, and the best for given times and errors."""
    front = pareto(measured)
    points = tuple(structs.replace(point, pareto=point in front) for point in measured)
    return {
        "points": points,
        "equal_time": equal_time(points),
        "equal_error": equal_error(points),
    }


def _limits(parts: Iterable[np.ndarray], effects: Iterable[np.ndarray]) -> Pictures:
    """Return half ranges that hold all pictures, with minima far above rounding."""
    limits = [abs(signed.mean(axis=2)).max() for signed in parts]
    removed = [abs(values).max() for values in effects]
    return Pictures(float(max(1e-3, *limits)), float(max(1.0, *removed, 0.0)))
