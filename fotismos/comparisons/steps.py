"""What is added to a comparison once it is measured, step by step.

A step takes the comparison and the halves that were compared, and returns the comparison with one
part more. It says which parts of the halves it needs (:class:`fotismos.comparisons.halves.Step`).
The modules behind the steps are loaded late: each serves some comparisons, and none is part of all.
"""

from __future__ import annotations

from dataclasses import replace
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np
from msgspec import structs

from fotismos.comparisons.departure.blocks import bands
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.departure.regions import worst_pixel
from fotismos.comparisons.halves import Halves, Step
from fotismos.comparisons.records.images import Comparison
from fotismos.reference.records import Missing
from fotismos.reference.rendering.passes import Progress, passes
from fotismos.reference.rendering.sums import MEAN, Accumulator

if TYPE_CHECKING:  # two pictures need no Mitsuba
    from fotismos.comparisons.prepared import Prepared

PICTURED = Missing("The textbook half is a picture, which has no terms.")


def steps(why: bool) -> list[Step]:
    """Return the steps of a comparison; ``why`` traces the terms of 8.10, and finds causes."""
    explained = (TERMS, CAUSES) if why else ()
    return [MISTAKES, TEXTBOOK, PICTURES, *explained, PRICE]


def with_pictures(comparison: Comparison, halves: Halves, progress: Progress | None) -> Comparison:
    """Return a comparison with the record of its pictures, which it warns of first."""
    assert halves.judge is not None, "the step needs pictures"
    expected, textbook = halves.template()
    return halves.judge(comparison, expected, textbook)


def with_mistakes(comparison: Comparison, ready: Prepared, progress: Progress | None) -> Comparison:
    """Return a comparison with the mistakes of its heuristic, and the laws that it breaks."""
    from fotismos.comparisons.audit import diagnosis, laws  # see above

    name = ready.options.heuristic
    record = structs.replace(
        comparison.record, mistakes=diagnosis.describe(name), broken_laws=laws.broken(name)
    )
    return replace(comparison, record=record)


def with_textbook(comparison: Comparison, ready: Prepared, progress: Progress | None) -> Comparison:
    """Return a comparison with the error of Phong's picture, rendered as the heuristic's was."""
    begin = perf_counter()
    record = comparison.record
    images = comparison.images
    sums = Accumulator(MEAN)
    renderer = ready.shaded_by_textbook()
    for rendered in passes(
        (renderer,), record.seed, ready.passes, progress=progress, stage="textbook image"
    ):
        sums.add(rendered[0])
    shown = sums.mean(np.float32)
    counted = images.counted
    total = sum(
        ready.distance(shown[rows][counted[rows]], images.reference[rows][counted[rows]]).sum()
        for rows in bands(len(counted))
    )
    record = structs.replace(record, textbook=float(total / max(counted.sum(), 1)))
    return replace(comparison, record=record).timed("textbook", perf_counter() - begin)


def with_terms(comparison: Comparison, ready: Prepared, progress: Progress | None) -> Comparison:
    """Return a comparison with its terms at pixels and as images, and the points to shade again."""
    from fotismos.comparisons import pixel_terms  # see above

    if "textbook" not in ready.has:
        return replace(comparison, terms=PICTURED, live=PICTURED)
    begin = perf_counter()
    half = ready.heuristic
    options = ready.options
    images = comparison.images
    layers = pixel_terms.layers(half, options, images.heuristic)
    worst = worst_pixel(images.maps[LEADING.name], images.counted)
    comparison = replace(
        comparison,
        terms=pixel_terms.trace(half, options, worst),
        live=pixel_terms.live(half, options),
        images=replace(images, terms=layers),
    )
    return comparison.timed("terms", perf_counter() - begin)


def with_causes(comparison: Comparison, ready: Prepared, progress: Progress | None) -> Comparison:
    """Return a comparison with its causes."""
    from fotismos.comparisons import attribution  # see above

    return attribution.with_causes(comparison, ready, progress)


def with_price(comparison: Comparison, ready: Prepared, progress: Progress | None) -> Comparison:
    """Return a comparison whose price has times, the samples that pass, and the effects needed."""
    from fotismos.comparisons import price  # see above

    return price.with_price(comparison, ready, progress)


MISTAKES = Step(needs=frozenset({"shader"}), add=with_mistakes)
TEXTBOOK = Step(needs=frozenset({"shader"}), add=with_textbook)
PICTURES = Step(needs=frozenset({"pictures"}), add=with_pictures)
TERMS = Step(needs=frozenset({"scene"}), add=with_terms)
CAUSES = Step(needs=frozenset({"textbook", "physical"}), add=with_causes)
PRICE = Step(needs=frozenset({"physical"}), add=with_price)
