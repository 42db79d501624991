"""Comparing the halves of a scene: render both pass by pass, and measure the difference.

With a noise target, passes continue until the noise reaches it, or a limit on samples stops them.
The seed of pass ``i`` is hashed from the run's seed and ``i``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from importlib import import_module
from importlib.util import find_spec
from threading import Thread
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np
from msgspec import structs

from fotismos.comparisons.departure import marks, regions, statistics
from fotismos.comparisons.departure.criterion import decide
from fotismos.comparisons.departure.metrics import (
    LEADING,
    METRICS,
    RATIO,
    declared,
)
from fotismos.comparisons.halves import Halves, Step
from fotismos.comparisons.options import Options
from fotismos.comparisons.records.comparison import (
    ComparisonRecord,
    Deviations,
    NoiseTarget,
    TimeSpent,
)
from fotismos.comparisons.records.departure import Significant, Summary
from fotismos.comparisons.records.images import Comparison, Images
from fotismos.comparisons.steps import PICTURES, steps
from fotismos.heuristic.errors import InstallationError
from fotismos.heuristic.program import versions
from fotismos.reference.records import Pixels
from fotismos.reference.rendering.passes import Progress, passes

if TYPE_CHECKING:  # two pictures need no Mitsuba
    from fotismos.reference.scene.source import Source

PIXELS_COMPUTED_TWICE = 4096
"""Counted pixels at which colour-science computes differences, too; all if there are fewer."""

DEVIATION_ALLOWED = 1e-3
"""Deviation from colour-science above which a record warns."""


def compare(
    source: Source,
    options: Options | None = None,
    progress: Progress | None = None,
    command: str = "",
    then: Sequence[Step] = (),
    shown: Callable[[Comparison], object] | None = None,
) -> Comparison:
    """Compare the textbook half of a scene with the physical one, in the current variant.

    ``command`` repeats the comparison, for the record. ``progress(stage, done, total)`` is called
    after each pass; with a noise target, ``total`` is the limit. The steps ``then`` add to the
    comparison, one after the other (:mod:`fotismos.comparisons.steps`). Raises `InputError` if the
    scene cannot be read or paired, no pixel sees a surface, or both halves are black;
    `NonFiniteError` for a NaN or an infinity in a rendering. ``shown`` is called once there are
    pictures, with what a page shows first.
    """
    from fotismos.comparisons.prepared import guarded  # loaded late: two pictures need no Mitsuba
    from fotismos.reference.scene.source import collect_messages, count_messages  # the same

    _require_colour_science()
    printed: list[str] = []
    with collect_messages(printed):
        halves = guarded(source, options)
        comparison = look(halves, command, progress)
    comparison = comparison.warned(count_messages([*source.messages, *printed]))
    if shown:
        shown(comparison)
    return finish(comparison, halves, then, progress)


def compare_pictures(options: Options, name: str, command: str = "") -> Comparison:
    """Compare the pictures that options name: ``image`` with ``reference``.

    Both may be repeats, whose spread gives their noise. ``name`` is that of the comparison, and
    ``command`` repeats it. Raises `InputError` if a picture cannot be read, if they differ in size,
    or if both are black.
    """
    from fotismos.comparisons.pictures import two_pictures  # loaded late: scenes have none

    halves = two_pictures(options, name)
    return finish(look(halves, command), halves, steps(why=False))


def look(
    halves: Halves,
    command: str = "",
    progress: Progress | None = None,
) -> Comparison:
    """Take the passes of both halves, and measure what a page shows first; see :func:`compare`.

    These are the leading metric and the declared ones; :func:`finish` adds the others.
    """
    stages = dict(halves.seconds)
    begin = perf_counter()

    def done(stage: str, elsewhere: float = 0.0) -> None:
        """Note the time of a stage, without what is counted elsewhere."""
        nonlocal begin
        now = perf_counter()
        stages[stage] = now - begin - elsewhere
        begin = now

    # The passes.
    first = halves.first
    second = halves.second
    images, noise_target = render(halves, progress)
    difference = images.difference
    assert difference is not None, "nothing is measured yet"
    done("sums of passes", sum(first.times) + sum(second.times))
    if first.preparation:
        stages["preparation"] = first.preparation

    # The departure.
    if COMPUTED_TWICE.needs <= halves.has:
        _load()  # not beside the passes, whose times are compared
    counted = halves.counted
    summaries, maps = _summarised(halves, images, (LEADING.name, *declared()))
    ratio, maps[RATIO.name] = statistics.summarise_log2_luminance(
        images.heuristic, images.reference, counted
    )
    marked = marks.find(
        difference,
        images.heuristic,
        counted,
        halves.distance,
        exact=halves.is_exact,
        noise_shown=halves.noise_shown,
    )
    images = replace(images, maps=maps, significant=marked.image)
    lead = summaries[LEADING.name]
    if not marked.is_certain:
        summaries[LEADING.name] = lead.unproven()
    elif halves.noise_shown == "none":
        summaries[LEADING.name] = lead.as_measured()
    objects, images = halves.with_objects(images)
    caution = halves.caution(images.heuristic, images.reference)
    done("metrics")
    record = ComparisonRecord(
        scene=halves.name,
        heuristic=halves.options.first_half,
        seed=halves.options.seed,
        resolution=counted.shape[::-1],
        viewing=halves.options.viewing,
        metrics=summaries,
        log2_luminance=ratio,
        significant=Significant(
            fraction=statistics.share(marked.image[counted] == marks.MARKED),
            undetermined=statistics.share(marked.image[counted] == marks.UNDETERMINED),
            level=marks.LEVEL,
            certain=marked.is_certain,
        ),
        pixels=Pixels(counted=int(counted.sum()), total=counted.size),
        regions=regions.find(maps[LEADING.name], counted),
        time=TimeSpent(heuristic=first.pass_times(), reference=second.pass_times(), stages=stages),
        versions=versions(halves.libraries),
        command=command,
        caution=caution,
        noise_target=noise_target,
        **objects,
        **halves.fields(difference.passes),
    )
    comparison = Comparison(record=record, images=images)
    shares = summaries[LEADING.name].visible
    undecided = decide(shares) == "undecided"
    if undecided and halves.has == PICTURES.needs:
        # A mistake may decide, and what a page shows first should stay.
        judged = PICTURES.add(comparison, halves, progress).record
        record = structs.replace(record, significant=judged.significant, metrics=judged.metrics)
    return replace(comparison, record=record)


def finish(
    comparison: Comparison,
    halves: Halves,
    then: Sequence[Step],
    progress: Progress | None = None,
) -> Comparison:
    """Return a comparison with what the steps add, as far as the halves have what they need."""
    # Last, since colour-science is loaded in the meantime.
    for step in (OTHER_METRICS, *then, COMPUTED_TWICE):
        if step.needs <= halves.has:
            comparison = step.add(comparison, halves, progress)
    return comparison


def _summarised(
    halves: Halves, images: Images, names: Iterable[str]
) -> tuple[dict[str, Summary], dict[str, np.ndarray]]:
    """Return the summaries of metrics over the pixels that count, and the maps of the drawn."""
    assert images.difference is not None, "not all is measured yet"
    metrics = halves.metrics
    summaries = {}
    maps = {}
    for name in names:
        summaries[name], distances = statistics.summarise(
            metrics[name],
            images.heuristic,
            reference=images.reference,
            mask=images.counted,
            viewing=halves.options.viewing,
            noise=images.difference.noise,
            grouped=images.difference.grouped,
            noise_shown=halves.noise_shown,
        )
        if metrics[name].drawn:
            maps[name] = distances
    return summaries, maps


def _with_other_metrics(
    comparison: Comparison, halves: Halves, progress: Progress | None
) -> Comparison:
    """Return a comparison with all metrics."""
    begin = perf_counter()
    record = comparison.record
    images = comparison.images
    rest = [name for name in METRICS if name not in record.metrics]
    summaries, maps = _summarised(halves, images, rest)
    summaries |= record.metrics
    maps |= images.maps
    record = structs.replace(record, metrics={name: summaries[name] for name in METRICS})
    drawn = {name: maps[name] for name in (*METRICS, RATIO.name) if name in maps}
    assert images.difference is not None, "not all is measured yet"
    images = replace(images, maps=drawn, difference=None, grouped=images.difference.grouped)
    whole = replace(comparison, record=record, images=images)
    return whole.timed("metrics", record.time.stages["metrics"] + perf_counter() - begin)


OTHER_METRICS = Step(needs=frozenset(), add=_with_other_metrics)


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


def _with_deviations(
    comparison: Comparison, halves: Halves, progress: Progress | None
) -> Comparison:
    """Note how far colour differences are from those of colour-science, and warn if it is far."""
    from fotismos.comparisons.departure import definitions  # loaded late: see `_load`

    shown = comparison.images
    record = comparison.record
    counted = np.random.default_rng(0).permutation(np.flatnonzero(shown.counted))
    some = counted[:PIXELS_COMPUTED_TWICE]
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


COMPUTED_TWICE = Step(needs=frozenset({"scene"}), add=_with_deviations)


def render(halves: Halves, progress: Progress | None) -> tuple[Images, NoiseTarget | None]:
    """Take the passes of both halves in turn: a drift of the machine then affects both.

    Return also where a run with a noise target ended.
    """
    options = halves.options
    sums = halves.sums(halves.counted)
    reached = None
    sources = (halves.first, halves.second)
    loop = passes(sources, options.seed, halves.passes, progress=progress)
    for rendered in loop:
        sums.add(*rendered)
        # Else the images of this pass stay alongside the next ones.
        del rendered
        if options.noise is not None and is_checked(sums.passes, halves.passes):
            reached = sums.noise_percentile(halves.distance)
            if reached <= options.noise:
                break
    loop.close()
    if options.noise is None:
        return sums.images(), None
    assert reached is not None, "the noise is checked after the last pass"
    return sums.images(), NoiseTarget(
        target=options.noise,
        reached=reached,
        stopped_by="target" if reached <= options.noise else "samples",
        limit_spp=halves.spp,
    )


def is_checked(done: int, passes: int) -> bool:
    """Return whether the noise is checked after ``done`` passes: 4, 6, 8, 12, 16, 24, …, and last.

    A check takes as long as a pass or two; the steps cost at most half as many passes again as are
    needed.
    """
    power = 1 << (done.bit_length() - 1)
    return done >= passes or (done >= 4 and done in (power, power + power // 2))
