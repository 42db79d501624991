"""Comparing the halves of a scene: render both pass by pass, and measure the difference.

With a noise target, passes continue until the noise reaches it, or a limit on samples stops them.
The seed of pass ``i`` is hashed from the run's seed and ``i``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from importlib import import_module
from importlib.util import find_spec
from threading import Thread
from time import perf_counter
from typing import Any

import numpy as np
from msgspec import structs

from fotismos.comparisons import timing
from fotismos.comparisons.departure.metrics import METRICS, leading_distance
from fotismos.comparisons.estimates import Estimates, PassSums, measure, metrics_for
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import Prepared, guarded
from fotismos.comparisons.records.comparison import (
    ComparisonRecord,
    Deviations,
    NoiseTarget,
    Price,
    TimeSpent,
)
from fotismos.comparisons.records.images import Comparison
from fotismos.comparisons.versions import versions
from fotismos.heuristic.errors import InstallationError
from fotismos.reference.rendering.passes import Progress, passes
from fotismos.reference.scene.source import Source, collect_messages, count_messages

Step = Callable[[Comparison, Prepared, Progress | None], Comparison]
"""What adds to a comparison once it is measured, with what it was rendered with."""

COMPUTED_TWICE = 4096
"""Counted pixels at which colour-science computes differences, too; all if there are fewer."""

DEVIATION_ALLOWED = 1e-3
"""Deviation from colour-science above which a record warns."""


def compare(
    source: Source,
    options: Options | None = None,
    progress: Progress | None = None,
    command: str = "",
    alone: AbstractContextManager[Any] | None = None,
    then: Sequence[Step] = (),
) -> Comparison:
    """Compare the textbook half of a scene with the physical one, in the current variant.

    ``command`` repeats the comparison, for the record. ``progress(stage, done, total)`` is called
    after each pass; with a noise target, ``total`` is the limit. The steps ``then`` add to the
    comparison, one after the other (:mod:`fotismos.comparisons.steps`). Raises `InputError` if the
    scene cannot be read or paired, no pixel sees a surface, or both halves are black;
    `NonFiniteError` for a NaN or an infinity in a rendering. Times are taken within the context
    ``alone``.
    """
    options = options or Options()
    _require_colour_science()
    printed: list[str] = []
    with collect_messages(printed):
        comparison, ready = _render_and_measure(source, options, progress, command, alone)
    comparison = comparison.warned(count_messages([*source.messages, *printed]))
    for step in then:
        comparison = step(comparison, ready, progress)
    # Last, since colour-science is loaded in the meantime.
    return _computed_twice(comparison)


def _require_colour_science() -> None:
    """Raise `InstallationError` if another module named ``colour`` hides colour-science."""
    spec = find_spec("colour")
    if spec is not None and spec.submodule_search_locations is None:
        raise InstallationError(
            f"{spec.origin} hides colour-science, whose package is named colour, too. Rename that"
            " file, or start Python with -P."
        )


def _load() -> None:
    """Load colour-science in a thread, which takes a second; importing it waits for the thread."""
    import scipy.optimize  # noqa: F401  not by two threads at once

    Thread(target=import_module, args=("fotismos.comparisons.departure.definitions",)).start()


def _computed_twice(comparison: Comparison) -> Comparison:
    """Note how far colour differences are from those of colour-science, and warn if it is far."""
    from fotismos.comparisons.departure import definitions  # loaded late: see `_load`

    shown = comparison.images
    record = comparison.record
    some = np.random.default_rng(0).permutation(np.flatnonzero(shown.counted))[:COMPUTED_TWICE]
    first = shown.heuristic.reshape(-1, 3)[some]
    second = shown.reference.reshape(-1, 3)[some]
    distances = {name: values.ravel()[some] for name, values in shown.maps.items()}
    largest = definitions.deviations(first, second, values=distances, viewing=record.viewing)
    record = structs.replace(record, colour_science=Deviations(pixels=len(some), largest=largest))
    warnings = (
        f"{METRICS[name].label} deviates from colour-science's by up to {most:.2g}, and"
        f" {DEVIATION_ALLOWED:g} is allowed: a formula is wrong here. Give `colour_science` to do"
        " without it, and report this scene."
        for name, most in largest.items()
        if most > DEVIATION_ALLOWED
    )
    return replace(comparison, record=record).warned(warnings)


def _render_and_measure(
    source: Source,
    options: Options,
    progress: Progress | None,
    command: str,
    alone: AbstractContextManager[Any] | None,
) -> tuple[Comparison, Prepared]:
    """Return the record and the images of a scene, and what they were rendered with."""
    stages: dict[str, float] = {}
    begin = perf_counter()

    def done(stage: str, elsewhere: float = 0.0) -> None:
        """Note the time of a stage, without what is counted elsewhere."""
        nonlocal begin
        now = perf_counter()
        stages[stage] = now - begin - elsewhere
        begin = now

    # The scene, both halves and the plan.
    ready = guarded(source, options)
    heuristic: Any = ready.heuristic  # a renderer, or pictures in its place
    reference: Any = ready.reference
    guard_seconds = ready.guard.seconds if ready.guard else 0.0
    done("scene and pairing", ready.planning_seconds + guard_seconds)
    stages |= {"planning": ready.planning_seconds, "guard": guard_seconds}

    # The passes, and their times.
    estimates, noise_target = render(ready, progress)
    done("sums of passes", sum(heuristic.times) + sum(reference.times))
    if prepared := getattr(heuristic, "preparation", 0.0):  # pictures have none
        stages["preparation"] = prepared
    price = _price(ready, alone)
    done("timing")

    # The departure.
    _load()  # not beside the passes, whose times are compared
    # A picture has noise of its own, whatever the plan is.
    exact = ready.plan.exact and not options.has_pictures
    numbers, images = measure(estimates, ready.counted, options, ready.traced(), exact)
    caution = ready.caution() or ready.require_light(images.heuristic, images.reference)
    done("metrics")
    record = ComparisonRecord(
        scene=source.name,
        variant=reference.variant,
        heuristic_variant=heuristic.variant,
        heuristic=options.first_half,
        interpolation=options.polygon_shading.value,
        seed=options.seed,
        resolution=images.counted.shape[::-1],
        plan=None if options.reference else ready.plan_record(estimates.passes),
        pairing=ready.pair.pairing,
        time=TimeSpent(
            heuristic=heuristic.pass_times(), reference=reference.pass_times(), stages=stages
        ),
        price=price,
        unrepresentable=ready.pair.unrepresentable,
        integrator_given=ready.pair.integrator,
        overridden=ready.overridden,
        warnings=tuple(ready.warnings()),
        versions=versions(),
        command=command,
        caution=caution,
        noise_target=noise_target,
        **numbers,
    )
    return Comparison(record=record, images=images), ready


def _price(ready: Prepared, alone: AbstractContextManager[Any] | None) -> Price | None:
    """Return the times per sample of both halves; of a picture the time is not known.

    A reference that is a picture has no price.
    """
    if ready.options.reference:
        return None
    reference = ready.reference
    if not ready.options.image:
        return timing.measure(
            ready.heuristic,
            reference,
            everything=ready.unpruned,
            seed=ready.options.seed,
            alone=alone,
        )
    width, height = reference.size
    pixels = width * height
    return Price(
        ratio=None,
        reason=timing.NOT_TIMED.reason,
        heuristic_s=None,
        reference_s=min(reference.times) / (reference.pass_spp * pixels),
        pixels=pixels,
    )


def render(ready: Prepared, progress: Progress | None) -> tuple[Estimates, NoiseTarget | None]:
    """Render the passes of both halves in turn: a drift of the machine then affects both.

    Return also where a run with a noise target ended.
    """
    options = ready.options
    distance = leading_distance(options.viewing, metrics_for(options))
    given = ready.given
    sums = PassSums(ready.counted) if given is None else given.pass_sums(ready.counted)
    reached = None
    loop = passes((ready.heuristic, ready.reference), options.seed, ready.passes, progress=progress)
    for rendered in loop:
        sums.add(*rendered.images)
        # Else the images of this pass stay alongside the next ones.
        del rendered
        if options.noise is not None and is_checked(sums.passes, ready.passes):
            reached = sums.noise_percentile(distance)
            if reached <= options.noise:
                break
    loop.close()
    if options.noise is None:
        return sums.estimates(), None
    assert reached is not None, "the noise is checked after the last pass"
    return sums.estimates(), NoiseTarget(
        target=options.noise,
        reached=reached,
        stopped_by="target" if reached <= options.noise else "samples",
        limit_spp=ready.passes * ready.reference.pass_spp,
    )


def is_checked(done: int, passes: int) -> bool:
    """Return whether the noise is checked after ``done`` passes: 4, 6, 8, 12, 16, 24, …, and last.

    A check takes as long as a pass or two; the steps cost at most half as many passes again as are
    needed.
    """
    power = 1 << (done.bit_length() - 1)
    return done >= passes or (done >= 4 and done in (power, power + power // 2))
