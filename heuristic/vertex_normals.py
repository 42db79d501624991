"""Normals at the vertices of a triangle mesh (chapter 6, section 6.6.2).

A vertex gets the mean normal of the faces around it, in one of three weightings. All take the mesh
as Dr.Jit arrays: ``positions`` with three floats of any type per vertex, ``faces`` with three
vertex numbers per face, of a type such as ``Array3u``. They return one vector per vertex, and share
these rules:

- A face without area contributes nothing.
- A vertex with no face, or only such faces, has the zero vector.
- So has one whose faces oppose each other, like the two sides of a sheet: the rest of the sum is
  rounding, up to :data:`CANCELLATION_STEPS` rounding steps of the weights' sum.
- Slivers have exact normals, areas and angles like other faces, until their edges are parallel to
  within rounding (see :mod:`heuristic.normals`).

Sums run in parallel over the faces; in meshes of tens of thousands of faces or more the last bit
may depend on their order.
"""

from enum import Enum

import drjit as dr

from heuristic.arrays import Array, Direction, Number, Position
from heuristic.errors import InputError, unknown
from heuristic.normals import cross, scaled_edges, shorter_edges, triangle_normal, unit

CANCELLATION_STEPS = 16
"""A few rounding steps for each face normal, and for the sum of a handful of them."""


class Weighting(Enum):
    """How much each face around a vertex counts."""

    MEAN = "mean"
    AREA = "area"
    ANGLE = "angle"


def vertex_normals(
    positions: Position, faces: Array, weighting: "str | Weighting" = Weighting.ANGLE
) -> Direction:
    """Return the unit normal at each vertex, for a weighting or its name (6.32-6.34).

    Weighting by angle is the default because only it does not depend on how a flat part of the
    surface is divided into triangles.

    Raises
    ------
    InputError
        If a face names a vertex that does not exist, or the weighting is unknown.
    """
    _check_faces(positions, faces)
    try:
        weighting = Weighting(weighting)
    except ValueError:
        allowed = [known.value for known in Weighting]
        raise unknown("weighting", weighting, allowed) from None
    return _FUNCTIONS[weighting](positions, faces)


def mean_normals(positions: Position, faces: Array) -> Direction:
    """Equation 6.32: ``n = sum_i n_i / |sum_i n_i|``, the mean of the faces' normals."""
    return _weighted(positions, faces, lambda *corners: (1, 1, 1))


def area_weighted_normals(positions: Position, faces: Array) -> Direction:
    """Equation 6.33: ``n = sum_i A_i n_i / |sum_i A_i n_i|``, with the faces' areas ``A_i``."""
    return _weighted(positions, faces, lambda *corners: (relative_areas(*corners),) * 3)


def angle_weighted_normals(positions: Position, faces: Array) -> Direction:
    """Equation 6.34: ``n = sum_i theta_i n_i / |...|``, with the faces' angles at the vertex."""
    return _weighted(positions, faces, corner_angles)


def relative_areas(p0: Position, p1: Position, p2: Position) -> Number:
    """Return the areas of triangles, in units of twice the square of the largest edge component.

    The unit is common to all triangles, and keeps meshes of any size in the type's range.
    """
    edges, size = scaled_edges(p0, p1, p2)
    largest = dr.max(size)
    relative_size = size / dr.select(largest > 0, largest, 1)
    return dr.norm(cross(*shorter_edges(*edges))) * dr.square(relative_size)


def corner_angles(p0: Position, p1: Position, p2: Position) -> tuple[Number, Number, Number]:
    """Return the three angles of triangles, in radians: ``atan2(|a x b|, a.b)`` at each corner.

    The arc cosine of the scalar product would lose half the digits of small angles.
    """
    (a, b, c), _ = scaled_edges(p0, p1, p2)
    double_area = dr.norm(cross(*shorter_edges(a, b, c)))
    return tuple(
        dr.atan2(double_area, -dr.dot(before, after)) for before, after in ((c, a), (a, b), (b, c))
    )


def _weighted(positions, faces, weights):
    """Sum the faces' normals at each vertex; ``weights`` maps corners to a weight for each."""
    if dr.width(faces) == 0:
        return dr.zeros(type(positions), dr.width(positions))
    corners = [dr.gather(type(positions), positions, faces[corner]) for corner in range(3)]
    normals = triangle_normal(*corners)
    has_area = dr.squared_norm(normals) > 0
    total = dr.zeros(type(positions), dr.width(positions))
    weight_sum = dr.zeros(type(positions.x), dr.width(positions))
    for corner, weight in enumerate(weights(*corners)):
        dr.scatter_add(total, normals * weight, faces[corner], has_area)
        dr.scatter_add(weight_sum, type(positions.x)(weight), faces[corner], has_area)
    limit = CANCELLATION_STEPS * dr.epsilon(positions) * weight_sum
    return dr.select(dr.norm(total) > limit, unit(total), 0)


def _check_faces(positions, faces):
    count = dr.width(positions)
    if dr.width(faces) == 0:
        return
    largest = max(int(dr.max(faces[corner])[0]) for corner in range(3))
    if largest >= count:
        raise InputError(
            f"faces: vertex number {largest} does not exist: there are {count} vertices, numbered"
            " from 0. Correct the mesh's list of faces."
        )


_FUNCTIONS = {
    Weighting.MEAN: mean_normals,
    Weighting.AREA: area_weighted_normals,
    Weighting.ANGLE: angle_weighted_normals,
}
