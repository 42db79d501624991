"""Flat, Gouraud and Phong shading of triangle meshes (chapter 6, section 6.6).

The chapter interpolates twice along straight lines: along two edges to the points D and E where a
scan line meets them (6.35, 6.37), then along the scan line (6.36, 6.38). On a triangle this is the
same as weighting the three vertices by barycentric coordinates, for every direction of the scan
line. Renderers use the latter, on the surface itself; the chapter's scan lines lie in the image,
where perspective would need a correction.

This module holds the equations. :mod:`heuristic.mesh_shading` applies them to Mitsuba's meshes.
"""

from enum import Enum

import drjit as dr

from heuristic import vectors
from heuristic.arrays import Colour, Direction, Number, Position, Vector

FINEST = 512
"""Finest tessellation: a sphere then has four million triangles, half a gigabyte."""


class Interpolation(Enum):
    """The quantity interpolated over a face: none, the intensity, or the normal."""

    FLAT = "flat"
    GOURAUD = "gouraud"
    PHONG = "phong"


def edge_intensity(
    intensity_a: Colour, intensity_b: Colour, y_a: Number, y_b: Number, y: Number
) -> Colour:
    """Equation 6.35: ``I_D = [I_A (y_D - y_B) + I_B (y_A - y_D)] / (y_A - y_B)``.

    The intensity where the scan line at the height ``y`` meets the edge from A to B; ``I_E``
    likewise on the other edge. A scan line never crosses an edge parallel to it; there the result
    is ``I_A``.
    """
    return _between(intensity_a, intensity_b, y_a, y_b, y)


def scan_line_intensity(
    intensity_d: Colour, intensity_e: Colour, x_d: Number, x_e: Number, x: Number
) -> Colour:
    """Equation 6.36: ``I_P = [I_D (x_E - x_P) + I_E (x_P - x_D)] / (x_E - x_D)``.

    The chapter's text says I_D and I_C, which can only mean I_D and I_E.
    """
    return _between(intensity_d, intensity_e, x_d, x_e, x)


def edge_normal(
    normal_a: Direction, normal_b: Direction, y_a: Number, y_b: Number, y: Number
) -> Vector:
    """Equation 6.37: ``n_D = [n_A (y_D - y_B) + n_B (y_A - y_D)] / (y_A - y_B)``.

    It is not normalised: otherwise the result at P would depend on the scan line's direction.
    """
    return _between(normal_a, normal_b, y_a, y_b, y)


def scan_line_normal(
    normal_d: Direction, normal_e: Direction, x_d: Number, x_e: Number, x: Number
) -> Direction:
    """Equation 6.38: ``n_P = [n_D (x_E - x_P) + n_E (x_P - x_D)] / |...|``, a unit vector.

    It is zero where opposite normals cancel, and such a point receives no light.
    """
    return vectors.normalise(_between(normal_d, normal_e, x_d, x_e, x))


def barycentric_coordinates(
    point: Position, p0: Position, p1: Position, p2: Position
) -> tuple[Number, Number, Number]:
    """Return the weights ``b0, b1, b2`` with ``point = b0 p0 + b1 p1 + b2 p2`` and sum 1.

    A point outside the triangle's plane is projected onto it. For a triangle without area the
    weights are ``1, 0, 0``.
    """
    from heuristic import normals  # only flat and Gouraud shading need it

    # Over the largest component: the fourth power of a length would leave the type's range.
    (edge_1, _, back), largest = normals.scaled_edges(p0, p1, p2)
    edge_2 = -back
    offset = (point - p0) / dr.select(largest > 0, largest, 1)
    product = dr.cross(edge_1, edge_2)
    squared = dr.squared_norm(product)
    inverse = dr.select(squared > 0, dr.rcp(squared), 0)
    b1 = dr.dot(dr.cross(offset, edge_2), product) * inverse
    b2 = dr.dot(dr.cross(edge_1, offset), product) * inverse
    return 1 - b1 - b2, b1, b2


def _between(value_a, value_b, place_a, place_b, place):
    length = place_b - place_a
    fraction = dr.select(length != 0, (place - place_a) / dr.select(length != 0, length, 1), 0)
    return value_a * (1 - fraction) + value_b * fraction
