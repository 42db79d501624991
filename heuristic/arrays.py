"""What arrays in signatures hold: one name per shape and unit.

An array is Dr.Jit's of the variant in use, or NumPy's: its type is known only when it is made.
So a checker sees ``Any``, and these names are for readers.
"""

from typing import Any, TypeAlias

Array: TypeAlias = Any
"""Numbers of any shape, which the docstring gives."""

Number: TypeAlias = Any
"""One number per point, or one for all, a plain number too."""

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
"""A ``mitsuba.Scene``; Mitsuba's classes are those of the variant in use."""

Mesh: TypeAlias = Any
"""A ``mitsuba.Mesh``."""

Shape: TypeAlias = Any
"""A ``mitsuba.Shape``."""

Interaction: TypeAlias = Any
"""A ``mitsuba.SurfaceInteraction3f``."""
