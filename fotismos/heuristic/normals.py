"""Normals of planes, triangles, surfaces, and vertices of meshes (chapter 6, 6.5 and 6.6.2).

Arrays have three components, of any float type. A surface has no normal where its gradient vanishes
or its tangents are parallel; it is the zero vector there, which receives no light, and never NaN.
Two vectors count as parallel where the sine of the angle between them is at most
:data:`PARALLEL_STEPS` rounding steps, because their own rounding can turn them by as much.

A vertex gets the mean normal of the faces around it, in one of three weightings: ``positions`` has
three floats per vertex, ``faces`` three vertex numbers per face. A face without area contributes
nothing. A vertex with no face, or only such faces, has the zero vector. So has one whose faces
oppose each other, like the two sides of a sheet: the rest of the sum is rounding, up to
:data:`CANCELLATION_STEPS` rounding steps of the weights' sum. The last bit of a sum over tens of
thousands of faces may depend on their order.
"""

from collections.abc import Callable, Sequence
from typing import Any

import drjit as dr
from drjit import scalar

from fotismos.heuristic import vectors
from fotismos.heuristic.convention import Array, Direction, Number, Position, Vector
from fotismos.heuristic.errors import unknown

PARALLEL_STEPS = 4
"""Edges and tangents are off by half a rounding step per component, products by as much again."""


def plane_normal(a: Number, b: Number, c: Number) -> Direction:
    """Equations 6.16-6.18: ``n = (a, b, c) / |(a, b, c)|`` of the plane ``ax + by + cz + d = 0``.

    It points to the side where ``ax + by + cz + d > 0``; with a point ``p0`` of the plane,
    ``d = -n.p0``.
    """
    return unit(_vector_type(a)(a, b, c))


def triangle_normal(p0: Position, p1: Position, p2: Position) -> Direction:
    """Equation 6.19: ``n = (p1 - p0) x (p2 - p0) / |(p1 - p0) x (p2 - p0)|``.

    It points to the side from which the vertices are seen in anticlockwise order.
    """
    edges, _ = scaled_edges(p0, p1, p2)
    first, second = shorter_edges(edges)
    return unit_cross(first, second)


def implicit_normal(gradient: Vector) -> Direction:
    """Equation 6.20: ``n = grad f / |grad f|`` of the surface ``f(x, y, z) = 0``.

    It points to where ``f`` grows: outwards, where ``f`` is negative inside.
    """
    return unit(gradient)


def ellipsoid(position: Position, a: Number, b: Number, c: Number) -> Number:
    """Equation 6.21: ``f = x^2/a^2 + y^2/b^2 + z^2/c^2 - 1``, negative inside the ellipsoid."""
    return dr.squared_norm(position / type(position)(a, b, c)) - 1


def ellipsoid_gradient(position: Position, a: Number, b: Number, c: Number) -> Vector:
    """Equation 6.22: ``grad f = (2x/a^2, 2y/b^2, 2z/c^2)`` of the ellipsoid of 6.21.

    ``a``, ``b`` and ``c`` are its half axes: numbers or Dr.Jit floats, greater than 0.
    """
    axes = type(position)(a, b, c)
    # Divided twice: the squares of small or large axes would leave the range of single precision.
    return 2 * position / axes / axes


def parametric_normal(tangent_u: Vector, tangent_v: Vector) -> Direction:
    """Equations 6.23, 6.25: ``n = p_u x p_v / |p_u x p_v|`` of the surface ``p = p(u, v)``.

    ``p_u`` and ``p_v`` are the derivatives of ``p`` by ``u`` and ``v``; at the poles of 6.24 one of
    them vanishes.
    """
    return unit_cross(tangent_u, tangent_v)


def ellipsoid_point(u: Number, v: Number, a: Number, b: Number, c: Number) -> Position:
    """Equation 6.24: ``p = (a cos v cos u, b cos v sin u, c sin v)``.

    ``u`` is the longitude in ``[-pi, pi]`` and ``v`` the latitude in ``[-pi/2, pi/2]``, Dr.Jit
    floats in radians. The chapter's formula is lost; this choice makes ``p_u x p_v`` point
    outwards.
    """
    sin_u, cos_u = dr.sincos(u)
    sin_v, cos_v = _latitude(v)
    return _vector_type(u)(a * cos_v * cos_u, b * cos_v * sin_u, c * sin_v)


def ellipsoid_tangents(
    u: Number, v: Number, a: Number, b: Number, c: Number
) -> tuple[Vector, Vector]:
    """Return the derivatives of 6.24 by ``u`` and ``v``, for :func:`parametric_normal`.

    ``p_u = (-a cos v sin u, b cos v cos u, 0)`` and ``p_v = (-a sin v cos u, -b sin v sin u, c cos
    v)``. At the poles, ``v = +-pi/2`` to within rounding, ``p_u`` is exactly zero.
    """
    sin_u, cos_u = dr.sincos(u)
    sin_v, cos_v = _latitude(v)
    vector = _vector_type(u)
    tangent_u = vector(-a * cos_v * sin_u, b * cos_v * cos_u, 0)
    return tangent_u, vector(-a * sin_v * cos_u, -b * sin_v * sin_u, c * cos_v)


def unit(vector: Vector) -> Direction:
    """Return ``vector / |vector|``, and zero for zero, for lengths in the type's whole range."""
    return vectors.normalise(_scaled(vector))


def unit_cross(a: Vector, b: Vector) -> Direction:
    """Return ``a x b / |a x b|``, and zero where the two are parallel or one is zero."""
    a = _scaled(a)
    b = _scaled(b)
    product = cross(a, b)
    # Both sides of `|a x b| > limit |a| |b|` are squared, which spares the roots.
    limit = dr.square(PARALLEL_STEPS * dr.epsilon(a))
    is_turned = dr.squared_norm(product) > limit * dr.squared_norm(a) * dr.squared_norm(b)
    return vectors.normalise(dr.select(is_turned, product, type(a)(0)))


def cross(a: Vector, b: Vector) -> Vector:
    """Return ``a x b`` such that ``b x a`` is its exact opposite.

    ``dr.cross`` fuses one product of each pair and rounds the other, so two opposing faces would
    not cancel.
    """
    return type(a)(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)


def scaled_edges(p0: Position, p1: Position, p2: Position) -> tuple[tuple[Vector, ...], Number]:
    """Return the edges ``p1 - p0, p2 - p1, p0 - p2`` over their largest component; and it."""
    edges = (p1 - p0, p2 - p1, p0 - p2)
    largest = dr.maximum(_largest(edges[0]), dr.maximum(_largest(edges[1]), _largest(edges[2])))
    return tuple(_over(edge, largest) for edge in edges), largest


def shorter_edges(edges: Sequence[Vector]) -> tuple[Vector, Vector]:
    """Return two of the three edges of a closed triangle, in order, leaving out the longest.

    Any two give the same cross product. In a needle the two long edges are nearly parallel, and
    their product is lost to rounding, while the short one is at a large angle to both.
    """
    a, b, c = edges
    square_a = dr.squared_norm(a)
    square_b = dr.squared_norm(b)
    square_c = dr.squared_norm(c)
    omit_a = (square_a > square_b) & (square_a > square_c)
    omit_b = square_b > square_c  # matters only if a stays
    first = dr.select(omit_a, b, dr.select(omit_b, c, a))
    second = dr.select(omit_a, c, dr.select(omit_b, a, b))
    return first, second


def _latitude(v: Number) -> tuple[Number, Number]:
    """Return sine and cosine of a latitude, with a cosine of exactly 0 at the poles.

    No float equals pi/2; the cosine of the nearest is a rounding step, which may be negative and
    turn the normal inside out.
    """
    sine, cosine = dr.sincos(v)
    return sine, dr.select(abs(cosine) > dr.epsilon(_vector_type(v)), cosine, 0)


def _scaled(vector: Vector) -> Vector:
    """Return a vector over its largest component, whose square stays in the range."""
    return _over(vector, _largest(vector))


def _over(vector: Vector, largest: Number) -> Vector:
    """Divide by the largest component; anything below the smallest normal float becomes zero.

    The reciprocal of anything smaller is infinite.
    """
    is_normal = largest >= dr.smallest(vector)
    return dr.select(is_normal, vector / dr.select(is_normal, largest, 1), type(vector)(0))


def _largest(vector: Vector) -> Number:
    return dr.maximum(abs(vector.x), dr.maximum(abs(vector.y), abs(vector.z)))


def _vector_type(component: Any) -> Any:
    """Return the type of three such components; double precision for plain numbers."""
    if dr.is_jit_v(component):
        return dr.replace_shape_t(type(component), (3, -1))
    return scalar.Array3f64


CANCELLATION_STEPS = 16
"""A few rounding steps for each face normal, and for the sum of a handful of them."""


def vertex_normals(positions: Position, faces: Array, weighting: str = "angle") -> Direction:
    """Return the unit normal at each vertex, for a weighting or its name (6.32-6.34).

    Weighting by angle is the default because only it does not depend on how a flat part of the
    surface is divided into triangles.
    """
    if weighting not in WEIGHTINGS:
        raise unknown("weighting", weighting, WEIGHTINGS)
    return WEIGHTINGS[weighting](positions, faces)


def mean_normals(positions: Position, faces: Array) -> Direction:
    """Equation 6.32: ``n = sum_i n_i / |sum_i n_i|``, the mean of the faces' normals."""
    return _weighted(positions, faces, lambda p0, p1, p2: (1, 1, 1))


def area_weighted_normals(positions: Position, faces: Array) -> Direction:
    """Equation 6.33: ``n = sum_i A_i n_i / |sum_i A_i n_i|``, with the faces' areas ``A_i``."""
    return _weighted(positions, faces, lambda p0, p1, p2: (relative_areas(p0, p1, p2),) * 3)


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
    first, second = shorter_edges(edges)
    return dr.norm(cross(first, second)) * dr.square(relative_size)


def corner_angles(p0: Position, p1: Position, p2: Position) -> tuple[Number, Number, Number]:
    """Return the three angles of triangles, in radians: ``atan2(|a x b|, a.b)`` at each corner.

    The arc cosine of the scalar product would lose half the digits of small angles.
    """
    edges, _ = scaled_edges(p0, p1, p2)
    first, second = shorter_edges(edges)
    double_area = dr.norm(cross(first, second))
    a, b, c = edges
    # The edge that arrives at a corner is reversed, hence the minus sign.
    return tuple(
        dr.atan2(double_area, -dr.dot(before, after)) for before, after in ((c, a), (a, b), (b, c))
    )


def _weighted(
    positions: Position, faces: Array, weights: Callable[..., Sequence[Number]]
) -> Direction:
    """Sum the faces' normals at each vertex; ``weights`` maps corners to a weight for each."""
    if dr.width(faces) == 0:
        return dr.zeros(type(positions), dr.width(positions))
    corners = [dr.gather(type(positions), positions, faces[corner]) for corner in range(3)]
    p0, p1, p2 = corners
    normals = triangle_normal(p0, p1, p2)
    has_area = dr.squared_norm(normals) > 0
    total = dr.zeros(type(positions), dr.width(positions))
    weight_sum = dr.zeros(type(positions.x), dr.width(positions))
    for corner, weight in enumerate(weights(p0, p1, p2)):
        dr.scatter_add(total, normals * weight, faces[corner], has_area)
        dr.scatter_add(weight_sum, type(positions.x)(weight), faces[corner], has_area)
    limit = CANCELLATION_STEPS * dr.epsilon(positions) * weight_sum
    return dr.select(dr.norm(total) > limit, unit(total), 0)


WEIGHTINGS = {"mean": mean_normals, "area": area_weighted_normals, "angle": angle_weighted_normals}
"""How much each face around a vertex counts (6.32-6.34)."""
