"""What is added to a comparison once it is measured, step by step.

A step takes the comparison and what it was rendered with, and returns the comparison with one part
more (:data:`fotismos.comparisons.compare.Step`). The modules behind the steps are loaded late: each
serves some comparisons, and none is part of all.
"""

from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np
from msgspec import structs

from fotismos.comparisons.compare import Step
from fotismos.comparisons.departure.blocks import bands
from fotismos.comparisons.departure.metrics import LEADING, leading_distance
from fotismos.comparisons.departure.regions import worst_pixel
from fotismos.comparisons.estimates import metrics_for
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import Prepared
from fotismos.comparisons.price import with_price
from fotismos.comparisons.records.images import Comparison
from fotismos.heuristic import heuristics
from fotismos.reference.rendering.passes import Progress, passes
from fotismos.reference.rendering.sums import MEAN, Accumulator


def steps(options: Options, why: bool) -> list[Step]:
    """Return the steps for options; ``why`` traces the terms of 8.10, and finds causes."""
    added: list[Step] = []
    if not options.image and not heuristics.named(options.heuristic).is_builtin:
        added += [with_mistakes, with_textbook]
    if options.has_pictures:  # no effect can be added to a picture
        added += [with_pictures, with_terms] if why else [with_pictures]
        return [*added, with_price]
    if why:
        from fotismos.comparisons.attribution import with_causes  # see above

        added += [with_terms, with_causes]
    return [*added, with_price]


def with_pictures(comparison: Comparison, ready: Prepared, progress: Progress | None) -> Comparison:
    """Return a comparison with the record of its pictures, which it warns of first."""
    from fotismos.comparisons import alignment, pictures  # see above

    given = ready.given
    assert given is not None
    textbook = None
    if given.image is not None:
        half: Any = ready.heuristic
        textbook = np.array(half.replaced.sampled(pictures.TEMPLATE_SPP).render(0), float)
    expected = alignment.scene_edges(ready.traced(alignment.FINER), textbook)
    return pictures.with_records(comparison, given, expected, textbook)


def with_mistakes(comparison: Comparison, ready: Prepared, progress: Progress | None) -> Comparison:
    """Return a comparison with the mistakes that its heuristic seems to make."""
    from fotismos.comparisons.audit import diagnosis  # see above

    mistakes = diagnosis.describe(ready.options.heuristic)
    return replace(comparison, record=structs.replace(comparison.record, mistakes=mistakes))


def with_textbook(comparison: Comparison, ready: Prepared, progress: Progress | None) -> Comparison:
    """Return a comparison with the error of Phong's picture, rendered as the heuristic's was."""
    begin = perf_counter()
    record = comparison.record
    images = comparison.images
    sums = Accumulator(MEAN)
    renderer = ready.shaded_by(heuristics.PHONG.name)
    for rendered in passes(
        (renderer,), record.seed, ready.passes, progress=progress, stage="textbook image"
    ):
        sums.add(rendered.images[0])
    shown = sums.mean(np.float32)
    distance = leading_distance(record.viewing, metrics_for(ready.options))
    counted = images.counted
    total = sum(
        distance(shown[rows][counted[rows]], images.reference[rows][counted[rows]]).sum()
        for rows in bands(len(counted))
    )
    record = structs.replace(record, textbook=float(total / max(counted.sum(), 1)))
    return replace(comparison, record=record).timed("textbook", perf_counter() - begin)


def with_terms(comparison: Comparison, ready: Prepared, progress: Progress | None) -> Comparison:
    """Return a comparison with its terms at pixels and as images, and the points to shade again."""
    from fotismos.comparisons import pixel_terms  # see above

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
