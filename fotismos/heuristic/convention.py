"""The conventions of the project, each stated here and nowhere else.

*Directions.* ``N``, ``L``, ``V`` and ``R`` are unit vectors that point away from the surface: along
the normal, towards the light, towards the viewer, and along the mirror image of ``L`` about ``N``.
A light's own ``direction`` is the direction in which its light travels.

*Intensity.* Heuristic intensities are display-linear. A white diffuse surface (``k_d = 1``) that
faces a light of intensity ``I_p = 1`` has the value 1. A physical surface of reflectance 1 under
irradiance ``E`` has the radiance ``E / pi``. The two agree when ``E = pi * I_p``, and this factor
is the only bridge between the two sets of units.

*Facing.* A surface is shaded on the side that its normal points to; a material marked ``twosided``
turns the normal towards the viewer. Mitsuba's ``diffuse`` and ``twosided`` do the same.

*Types.* Signatures name arrays by shape and unit. An array belongs to Dr.Jit's current variant or
to NumPy, so its type is known only at run time: a checker sees ``Any``, the names are for readers.
"""

from collections.abc import Callable
from math import pi
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

IRRADIANCE_PER_INTENSITY = pi
"""Irradiance at normal incidence that a heuristic intensity of 1 represents."""

RADIANCE_PER_IRRADIANCE = 1.0 / pi
"""Radiance of a white diffuse surface under unit irradiance; the inverse of the factor above."""

Array: TypeAlias = Any  # numbers of any shape; the docstring gives it
Doubles: TypeAlias = NDArray[np.float64]  # the same in NumPy, where no kernel needs them
Floats: TypeAlias = NDArray[np.floating]  # the same, of either precision
Number: TypeAlias = Any  # one number per point, or one for all, which may be a plain number
Cosines: TypeAlias = Any  # a fotismos.heuristic.numerics.Cosine, or the cosine alone, -1..1
Mask: TypeAlias = Any  # one truth value per point
Position: TypeAlias = Any  # three components per point, in world units
Direction: TypeAlias = Any  # three components per point, of length 1, away from the surface
Vector: TypeAlias = Any  # three components per point, of any length
Colour: TypeAlias = Any  # a number, RGB, or one value per wavelength; see above for the units
Scene: TypeAlias = Any  # a mitsuba.Scene; Mitsuba's classes depend on the current variant
Mesh: TypeAlias = Any  # a mitsuba.Mesh
Shape: TypeAlias = Any  # a mitsuba.Shape
Interaction: TypeAlias = Any  # a mitsuba.SurfaceInteraction3f
Properties: TypeAlias = Any  # a mitsuba.Properties: what a scene gives a plugin
Sample: TypeAlias = tuple[Any, Colour]  # what Mitsuba calls a sample, and its weight
Visibility: TypeAlias = Callable[[Direction, Number], Mask]  # what light from there reaches
