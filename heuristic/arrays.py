"""Types of arrays in signatures: one name per shape and unit.

An array belongs to Dr.Jit's current variant or to NumPy, so its type is known only at run time. A
checker sees ``Any``; these names are for readers.
"""

from typing import Any, TypeAlias

Array: TypeAlias = Any
"""Numbers of any shape; the docstring gives it."""

Number: TypeAlias = Any
"""One number per point, or one for all, which may be a plain number."""

Cosines: TypeAlias = Any
"""A :class:`heuristic.numerics.Cosine`, or the cosine alone, -1..1."""

Mask: TypeAlias = Any
"""One truth value per point."""

Position: TypeAlias = Any
"""Three components per point, in world units."""

Direction: TypeAlias = Any
"""Three components per point, of length 1, away from the surface."""

Vector: TypeAlias = Any
"""Three components per point, of any length."""

Colour: TypeAlias = Any
"""A number, RGB, or one value per wavelength; coefficients 0..1, intensities display-linear."""

Scene: TypeAlias = Any
"""A ``mitsuba.Scene``; Mitsuba's classes depend on the current variant."""

Mesh: TypeAlias = Any
"""A ``mitsuba.Mesh``."""

Shape: TypeAlias = Any
"""A ``mitsuba.Shape``."""

Interaction: TypeAlias = Any
"""A ``mitsuba.SurfaceInteraction3f``."""
