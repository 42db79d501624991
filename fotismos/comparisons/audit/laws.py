"""The cheap part of an audit, for comparisons: which laws of reflection a user's shader breaks.

Two white materials are asked at a few angles: a matte one, and a metal's lobe. Textbook shading
breaks laws, too, and is still useful: this is a property, no mistake.
"""

from collections.abc import Iterator
from functools import partial

import mitsuba as mi
import numpy as np

from fotismos.comparisons.audit import furnace
from fotismos.comparisons.audit.subjects import ShadingSubject
from fotismos.heuristic import heuristics, program
from fotismos.heuristic.user_shaders import DEFAULT_VARIANT

MATERIALS = ("matte", "metal, alpha 0.3")

ANGLES = (0.0, 60.0, 80.0)
"""Of lights, in degrees from the normal."""

GRID = (64, 48)
"""Azimuths and heights: it errs by less than a hundredth for these lobes."""

MOST_ENERGY = 1.02
MOST_ASYMMETRY = 0.01
MOST_FROM_BELOW = 1e-3
"""What the quadrature and single precision leave."""

PAIRS = 512


def broken(name: str) -> tuple[str, ...]:
    """Return which laws a user's heuristic breaks, each with its number; none of a built-in one."""
    heuristic = heuristics.named(name)
    if heuristic.is_builtin:
        return ()
    with mi.scoped_set_variant(DEFAULT_VARIANT):
        try:
            subject = ShadingSubject(heuristics.named(name), {})
            laws = tuple(_laws(subject))
        except Exception:  # a user's code may raise anything where it was not tried
            return ()
    if not laws:
        return ()
    command = program.command("audit", "--heuristic", name)
    return (f"It breaks {'; '.join(laws)}. `{command}` shows where.",)


def _laws(subject: ShadingSubject) -> Iterator[str]:
    """Yield the laws that a subject breaks."""
    responses = {material: partial(subject.response, material) for material in MATERIALS}
    returned = {
        (material, angle): furnace.returned(response, angle, GRID)
        for material, response in responses.items()
        for angle in ANGLES
    }
    material, angle = max(returned, key=lambda case: returned[case])
    if (most := returned[material, angle]) > MOST_ENERGY:
        yield f"energy (returns {most:.3g} times the light from {angle:g}°, {material})"
    first, second = furnace.random_pairs(PAIRS)
    asymmetry = max(
        float(furnace.asymmetries(response, first, second).max()) for response in responses.values()
    )
    if asymmetry > MOST_ASYMMETRY:
        yield f"reciprocity (light and viewer exchanged differ by {asymmetry:.2g} of their mean)"
    below = first * np.array([[1.0], [1.0], [-1.0]])
    shown = max(float(response(below, second).max()) for response in responses.values())
    if shown > MOST_FROM_BELOW:
        yield f"opacity (light from below shows {shown:.2g})"
