"""The unit vectors that the terms need (chapter 6, section 6.5).

Each function takes Dr.Jit arrays of three components, of any float type, and returns the same.
Lengths may have any size within the type's range; below its smallest normal float they are zero.
"""

import drjit as dr

from heuristic import numerics
from heuristic.convention import Cosines, Direction, Number, Position, Vector


def normalise(vector: Vector) -> Direction:
    """Return ``vector / |vector|``, and zero for the zero vector.

    An undefined direction then contributes nothing to a scalar product, instead of NaN.
    """
    vector, _, square = numerics.scaled(vector)
    return vector * numerics.inverse_length(square)


def light_vector(light_position: Position, position: Position) -> tuple[Direction, Number]:
    """Equation 6.26: ``L = (P_L - P) / |P_L - P|``, with the distance ``d = |P_L - P|``.

    Returns ``(L, d)``. On the light itself (``d = 0``) the direction is undefined and ``L`` is
    zero, so such a point receives no light. A distance beyond the type's range becomes its largest
    float.
    """
    half, inverse, square = numerics.scaled(_half_offset(light_position, position))
    inverse_length = numerics.inverse_length(square)
    distance = square * inverse_length * 2 * numerics.inverse_of_power(inverse)
    return half * inverse_length, numerics.at_most(distance, numerics.largest(distance))


def inverse_distance(light_position: Position, position: Position) -> Number:
    """Return ``1 / d``; where ``d`` is 0 or too small to invert, a large number."""
    _, inverse, square = numerics.scaled(_half_offset(light_position, position))
    return numerics.inverse_root(square) * 0.5 * inverse


def wide_light_vector(light_position: Position, position: Position) -> tuple[Vector, Number]:
    """Return ``L`` of 6.26 in double precision as a vector and its inverse length, to 1e-13."""
    half = _half_offset(light_position, position)
    scaled, inverse, square = numerics.scaled(half)
    root = numerics.inverse_length(square)
    if type(half) is dr.float64_array_t(type(half)):
        return scaled, root
    half = _half_offset(numerics.wide(light_position), numerics.wide(position))
    return half, numerics.refined_inverse(
        dr.squared_norm(half), numerics.wide(root) * numerics.wide(inverse)
    )


def _half_offset(light_position, position):
    """Return half of ``P_L - P``, which, unlike the whole, never exceeds the type's range."""
    return dr.fma(position, -0.5, light_position * 0.5)


def view_vector(viewer_position: Position, position: Position) -> Direction:
    """Equation 6.27: ``V = (P_V - P) / |P_V - P|``, and zero on the viewer itself."""
    return light_vector(viewer_position, position)[0]


def mirror_vector(normal: Vector, direction: Direction, cosine: Cosines) -> Direction:
    """Equations 6.28-6.31: ``R = 2 (L.N) N - L``, the mirror image of ``L`` about ``N``.

    It follows from three conditions on ``R``: equal angles (6.28, 6.29), one plane with ``L`` and
    ``N`` (6.30) and unit length. ``cosine`` is ``N.L``, which callers have already. Mirroring
    either of two directions gives the same angle between them: ``R.V`` is the scalar product of
    ``L`` with the mirror image of ``V``.
    """
    return dr.fma(2 * cosine, normal, -direction)


def chord_cosine(a: Direction, b: Direction) -> numerics.Cosine:
    """Return the :class:`heuristic.numerics.Cosine` of the angle between two unit vectors.

    ``1 - a.b = |a - b|^2 / 2`` and ``1 + a.b = |a + b|^2 / 2``: near 0 and 180 degrees the chords
    keep the digits that the scalar product loses.
    """
    return numerics.Cosine(dr.dot(a, b), dr.squared_norm(a - b) * 0.5, dr.squared_norm(a + b) * 0.5)
