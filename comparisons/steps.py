"""What is added to a comparison once it is measured: step by step, each in a module of its own.

A step takes the comparison and what it was rendered with, and returns the comparison with one part
more (:data:`fotismos.comparisons.compare.Step`).
"""

from fotismos.comparisons.compare import Step
from fotismos.comparisons.options import Options
from fotismos.heuristic import heuristics


def steps(options: Options, why: bool) -> list[Step]:
    """Return the steps for options; ``why`` traces the terms of 8.10, and finds causes."""
    added: list[Step] = []
    is_picture = bool(options.image)
    if is_picture:
        from fotismos.comparisons import pictures  # loaded late: few comparisons have any

        added.append(pictures.with_picture)
    elif not heuristics.named(options.heuristic).is_own:
        from fotismos.comparisons.audit import diagnosis  # loaded late: only for users' shaders

        added.append(diagnosis.with_mistakes)
    if why:
        from fotismos.comparisons import (
            pixel_terms,  # loaded late: not every comparison traces terms
        )

        added.append(pixel_terms.with_terms)
    if why and not is_picture:  # no effect can be added to a picture
        from fotismos.comparisons.hybrids import attribution  # loaded late: not always

        added.append(attribution.with_causes)
    return added
