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
"""

from math import pi

IRRADIANCE_PER_INTENSITY = pi
"""Irradiance at normal incidence that a heuristic intensity of 1 represents."""

RADIANCE_PER_IRRADIANCE = 1.0 / pi
"""Radiance of a white diffuse surface under unit irradiance; the inverse of the factor above."""
