"""What accuracy costs on one scene: the whole study."""

import gc
from dataclasses import dataclass, replace

import numpy as np
from msgspec import structs

from comparisons import record
from comparisons.compare import guarded
from comparisons.cost.cost_record import Converged, Cost, Pictures, Point, Rung, Split
from comparisons.cost.effort import DETERMINISTIC_SPP, QUICK, QUICK_WIDTH, WIDTH, Effort, reduced
from comparisons.cost.front import equal_error, equal_time, pareto
from comparisons.cost.methods import Methods
from comparisons.cost.prediction import predict, require_shape
from comparisons.cost.timing import Judge, measure
from comparisons.effects.lattice import Lattice
from comparisons.effects.noiseless import Noiseless
from comparisons.effects.prices import prices
from comparisons.effects.split import split
from comparisons.options import Options
from comparisons.records import Machine, Pixels
from reference.rendering.gbuffer import image_size
from reference.rendering.passes import Stream, passes
from reference.rendering.renderer import Renderer
from reference.rendering.sums import Accumulator, Mean


@dataclass(frozen=True)
class Study:
    """What a study returns: its record, ``cost.json``, and images by name.

    Attributes
    ----------
    record
        What the files, tables and charts tell.
    rungs
        ``{rung name: (H, W, 3)}``, of the most samples.
    parts
        ``{part: (H, W, 3)}``, signed and linear.
    difference
        (H, W, 3): reference minus kernel, which the parts add up to.
    effects
        ``{effect: (H, W)}``: the ΔE2000 that it removes.
    error
        (H, W): the kernel's ΔE2000, which those of the effects and what is left add up to.
    left
        (H, W): the ΔE2000 that is left where all effects are simulated.
    reference
        (H, W, 3).
    counted
        (H, W): the pixels that count.
    """

    record: Cost
    rungs: dict
    parts: dict
    difference: np.ndarray
    effects: dict
    error: np.ndarray
    left: np.ndarray
    reference: np.ndarray
    counted: np.ndarray


def cost(
    source,
    options=None,
    effort=None,
    progress=None,
    command="",
    at=None,
    is_measured=False,
):
    """Study what accuracy costs on one scene, in the current variant.

    Parameters
    ----------
    source, options, progress, command
        As of :func:`comparisons.compare.compare`. ``options.spp`` are the most samples of a Monte
        Carlo rung. Without a resolution, the film's own is reduced to :data:`WIDTH`.
    effort : Effort, optional
        How much is rendered.
    at : tuple of int, optional
        Width and height to predict time and error for (:mod:`comparisons.cost.prediction`).
    is_measured
        Whether to measure there, too.

    Returns
    -------
    Study

    Raises
    ------
    InputError
        When the scene cannot be read or paired, or no pixel of it sees a surface.
    NonFiniteError
        When a rendering holds a NaN or an infinity.
    """
    options, effort = options or Options(), effort or Effort()
    progress = progress or (lambda *_: None)
    if options.resolution is None:
        shaped = replace(options, resolution=at)
        options = replace(options, resolution=reduced(source, shaped, WIDTH))
    elif at is not None:
        require_shape(options.resolution, at)
    if options.spp is not None:
        effort = replace(effort, largest=options.spp)
    options.require_model("a study of cost")
    ready = guarded(source, replace(options, spp=None, allow_empty=False))
    width, height = image_size(ready.scene)
    counted = ready.counted
    reference, groups = _converged(ready, effort, options.seed, progress)
    judge = Judge(reference, counted, options.viewing)

    methods = Methods(source, options, ready, effort.depths)
    measured, images = _measured(methods, effort, judge, options.seed, progress)
    lattice = Lattice(options, methods, effort.replicates, effort.replicate_spp, options.seed)
    progress("pricing effects", 0, 1)
    noiseless = Noiseless(judge, groups)
    priced = prices(lattice, noiseless, options.seed, effort.exact_effects, effort.orders)
    *parts, (whole, difference) = split(lattice, counted, options.viewing)
    progress("pricing effects", 1, 1)
    # It changes the sizes of the scenes' films, and comes last.
    prediction = predict(methods, at, effort, options.seed, is_measured, progress) if at else None

    found = Cost(
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
        **_compared(measured),
        prices=priced.prices,
        closure=priced.closure,
        split=Split(tuple(part for part, _ in parts), whole),
        viewing=options.viewing,
        pixels=Pixels(counted=int(counted.sum()), total=width * height),
        machine=Machine(**record.machine()),
        versions=record.versions(),
        command=command,
        guard=record.guard_record(ready.guard),
        prediction=prediction,
        pictures=_limits([image for _, image in parts], priced.maps.values()),
    )
    return Study(
        record=found,
        rungs={name: image for (name, _), image in images.items()},
        parts={part.name: image for part, image in parts},
        difference=difference,
        effects=priced.maps,
        error=priced.departure,
        left=priced.left,
        reference=reference.mean,
        counted=counted,
    )


def quick(source, options=None, progress=None, command=""):
    """Study a scene as :func:`cost` does, in little time: for many scenes in one report."""
    options = options or Options()
    small = replace(options, resolution=reduced(source, options, QUICK_WIDTH), spp=None)
    return cost(source, small, QUICK, progress, command)


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


def _compared(measured):
    """Return the points, with the front marked, and what they reach within times and errors."""
    points = [Point(m.rung, m.spp, m.seconds.median, m.error) for m in measured]
    front = pareto(points)
    return {
        "points": tuple(
            structs.replace(one, pareto=point in front)
            for one, point in zip(measured, points, strict=True)
        ),
        "equal_time": equal_time(points),
        "equal_error": equal_error(points),
    }


def _limits(parts, effects):
    """Return half ranges that hold all pictures; rounding alone does not fill one."""
    limits = [abs(signed.mean(axis=2)).max() for signed in parts]
    removed = [abs(values).max() for values in effects]
    return Pictures(float(max(1e-3, *limits)), float(max(1.0, *removed, 0.0)))
