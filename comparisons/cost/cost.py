"""Study what accuracy costs on one scene."""

from collections.abc import Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from msgspec import structs

from comparisons import record
from comparisons.cost import times
from comparisons.cost.cost_record import Cost, CostAttribution, EffectCost
from comparisons.cost.front import at_size, fronted
from comparisons.cost.measure import (
    QUICK,
    QUICK_WIDTH,
    WIDTH,
    Effort,
    Measurements,
    Size,
    measure_ladder,
    reduced,
    threads,
)
from comparisons.cost.predict import predict, require
from comparisons.hybrids.attribution import Causes, find
from comparisons.options import Options
from reference.pairing.prepare import film_size
from reference.planning.plan import Guard
from reference.records import Pixels
from reference.rendering.gbuffer import resize
from reference.rendering.renderer import Progress
from reference.scene.source import Source

SPP = 64
"""Samples per pixel of the image to which effects add time."""


@dataclass(frozen=True)
class Study:
    """Results of a study: its record, ``cost.json``, and its images.

    ``methods`` are ``{method: (H, W, 3)}``, one rendering with the most samples of each.
    """

    record: Cost
    methods: Mapping[str, np.ndarray]
    reference: np.ndarray


def cost(
    source: Source,
    options: Options | None = None,
    effort: Effort | None = None,
    progress: Progress | None = None,
    command: str = "",
    at: Size | None = None,
    is_measured: bool = False,
    causes: Causes | None = None,
    alone: AbstractContextManager[Any] | None = None,
) -> Study:
    """Study what accuracy costs on one scene, in the current variant.

    For ``source``, ``options``, ``progress`` and ``command`` see
    :func:`comparisons.compare.compare`, and :func:`comparisons.cost.measure.measure_ladder` for an
    omitted resolution, ``options.spp`` and ``alone``. ``at`` is a size to predict for, where
    methods are also measured if ``is_measured``. ``causes`` are those of the scene, if known.
    """
    progress = progress or (lambda *_: None)
    options, effort = options or Options(), effort or Effort()
    if at:
        size = options.resolution or reduced(source, options.changed(resolution=at), WIDTH)
        require(source.name, at, size, is_measured)
    found = measure_ladder(source, options, effort, progress, at=at, alone=alone)
    options, ready, ladder = found.options, found.ready, found.ladder
    counted = ready.counted
    predicted, measured = predict(found, at, is_measured, progress) if at else ((), ())
    ladder.forget()  # its scenes would slow later work
    resize(ready.scene, found.size)  # a prediction has other sizes
    known = causes or find(ready, source, options, progress)
    made = Cost(
        scene=source.name,
        variant=ready.reference.variant,
        heuristic_variant=ladder.heuristic_variant,
        heuristic=options.heuristic,
        interpolation=options.polygon_shading,
        seed=options.seed,
        resolution=found.size,
        rounds=effort.rounds,
        threads=threads(),
        processor_share=min(next(iter(found.lines.values())).processors / threads(), 1.0),
        reference=found.converged,
        methods=found.methods,
        points=fronted(found.points),
        attribution=attribution(found, known),
        closure=known.record.closure,
        viewing=options.viewing,
        pixels=Pixels(counted=int(counted.sum()), total=counted.size),
        machine=record.machine(),
        versions=record.versions(),
        command=command,
        guard=ready.guard or Guard(),
        at=at,
        predicted=fronted(predicted),
        measured=measured,
        left_out=ladder.left_out,
    )
    return Study(record=made, methods=found.images, reference=found.reference.mean)


def quick(
    source: Source,
    options: Options,
    causes: Causes,
    progress: Progress,
    command: str,
    alone: AbstractContextManager[Any],
) -> Study:
    """Study a compared scene with less effort; points of its own size have the small one's errors.

    For the arguments see :func:`cost`.
    """
    own = options.resolution or film_size(source.parse(), options.sensor)
    small = options.changed(resolution=reduced(source, options, QUICK_WIDTH), spp=None)
    study = cost(source, small, QUICK, progress, command, causes=causes, alone=alone)
    points = at_size(study.record.points, study.record.methods, own)
    made = structs.replace(study.record, at=own, predicted=fronted(points))
    return replace(study, record=made)


def attribution(found: Measurements, causes: Causes) -> CostAttribution:
    """Return what each effect removes, and what it adds to an image of the study's size."""
    samples = SPP * found.size[0] * found.size[1]
    first, last = found.steps[0].before, found.steps[-1].after

    def adds(effect: str) -> Any:
        return times.difference(
            [
                (step.weight, found.lines[step.before.name], found.lines[step.after.name])
                for step in found.steps
                if step.effect == effect
            ],
            samples,
        )

    def takes(name: str) -> Any:
        values = samples * found.lines[name].per_sample
        return times.interval(values, times.UNSEEN * float(values[0]))

    return CostAttribution(
        effects=tuple(
            EffectCost(**structs.asdict(one), adds_s=adds(one.effect))
            for one in causes.record.effects
        ),
        departure=causes.record.departure,
        kernel_s=takes(first.name),
        plan_s=takes(last.name),
        renderer_s=adds(""),
        resolution=found.size,
        spp=SPP,
    )
