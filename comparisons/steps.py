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
from fotismos.comparisons.comparison import Comparison
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import Prepared
from fotismos.comparisons.price import with_price
from fotismos.heuristic import heuristics
from fotismos.reference.rendering.renderer import Progress

TEMPLATE_SPP = 16
"""Samples per pixel of the textbook half whose edges and colours a picture may have."""


def steps(options: Options, why: bool) -> list[Step]:
    """Return the steps for options; ``why`` traces the terms of 8.10, and finds causes."""
    if options.has_pictures:  # no effect can be added to a picture
        added: list[Step] = [with_pictures, with_terms] if why else [with_pictures]
        return [*added, with_price]
    added = []
    if not heuristics.named(options.heuristic).is_builtin:
        added.append(with_mistakes)
    if why:
        from fotismos.comparisons.hybrids.attribution import with_causes  # see above

        added += [with_terms, with_causes]
    return [*added, with_price]


def with_pictures(comparison: Comparison, ready: Prepared, progress: Progress | None) -> Comparison:
    """Return a comparison with the record of its pictures, which it warns of first."""
    from fotismos.comparisons import alignment, pictures  # see above

    given = ready.given
    assert given is not None
    # Edges that they may contain: of the geometry, and of the textbook half.
    expected = [ready.geometry_edges()]
    textbook = None
    if given.image is not None:
        half: Any = ready.heuristic
        textbook = np.array(half.replaced.sampled(TEMPLATE_SPP).render(0), float)
        expected.append(alignment.picture_edges(textbook))
    return pictures.with_records(comparison, given, expected, textbook)


def with_mistakes(comparison: Comparison, ready: Prepared, progress: Progress | None) -> Comparison:
    """Return a comparison with the mistakes that its heuristic seems to make."""
    from fotismos.comparisons.audit import diagnosis  # see above

    mistakes = diagnosis.describe(ready.options.heuristic)
    return replace(comparison, record=structs.replace(comparison.record, mistakes=mistakes))


def with_terms(comparison: Comparison, ready: Prepared, progress: Progress | None) -> Comparison:
    """Return a comparison with its terms at pixels and as images, and the points to shade again."""
    from fotismos.comparisons import pixel_terms  # see above

    begin = perf_counter()
    half = ready.heuristic
    options = ready.options
    images = comparison.images
    layers = pixel_terms.layers(half, options, images.heuristic)
    comparison = replace(
        comparison,
        terms=pixel_terms.trace(half, options),
        live=pixel_terms.live(half, options),
        images=replace(images, terms=layers),
    )
    return comparison.timed("terms", perf_counter() - begin)
