"""The unit vectors that the terms need (chapter 6, section 6.5), and the cosine of the lobe.

Each function takes Dr.Jit arrays of three components, of any float type, and returns the same.
Lengths may have any size within the type's range; below its smallest normal float they are zero.
"""

from collections.abc import Callable
from typing import Any

import drjit as dr

from fotismos.heuristic import numerics
from fotismos.heuristic.convention import Cosines, Direction, Number, Position, Vector
from fotismos.heuristic.materials import Material


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
    # `sqrt(s) = s / sqrt(s)`, then doubled, and freed of the scale.
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
    # Subtracted again in double precision: the first difference was rounded.
    half = _half_offset(numerics.wide(light_position), numerics.wide(position))
    return half, numerics.refined_inverse(
        dr.squared_norm(half), numerics.wide(root) * numerics.wide(inverse)
    )


def _half_offset(light_position: Position, position: Position) -> Vector:
    """Return half of ``P_L - P``, which, unlike the whole, never exceeds the type's range."""
    return dr.fma(position, -0.5, light_position * 0.5)


def view_vector(viewer_position: Position, position: Position) -> Direction:
    """Equation 6.27: ``V = (P_V - P) / |P_V - P|``, and zero on the viewer itself."""
    return light_vector(viewer_position, position)[0]


def mirror_vector(normal: Vector, direction: Direction, cosine: Cosines) -> Direction:
    """Equations 6.28-6.31: ``R = 2 (L.N) N - L``, the mirror image of ``L`` about ``N``.

    It follows from three conditions on ``R``: equal angles (6.28, 6.29), one plane with ``L`` and
    ``N`` (6.30) and unit length. ``cosine`` is ``N.L``. Mirroring ``V`` instead gives the same
    ``R.V``.
    """
    return dr.fma(2 * cosine, normal, -direction)


def chord_cosine(a: Direction, b: Direction) -> numerics.Cosine:
    """Return the :class:`fotismos.heuristic.numerics.Cosine` of the angle between two unit vectors.

    ``1 - a.b = |a - b|^2 / 2`` and ``1 + a.b = |a + b|^2 / 2``: near 0 and 180 degrees the chords
    keep the digits that the scalar product loses.
    """
    return numerics.Cosine(dr.dot(a, b), dr.squared_norm(a - b) * 0.5, dr.squared_norm(a + b) * 0.5)


def lobe(
    material: Material, normal: Vector, view: Vector
) -> Callable[[Any, Position, Direction, Number], Cosines]:
    """Return ``lobe(light, position, toward, cos_incidence)``, the lobe's cosine for a light.

    It is ``R.V`` (8.9), or ``N.H`` for the form ``blinn``, and 0 for lights below the horizon.
    Whatever depends only on the normal and the view is computed once for all lights.

    It is a :class:`fotismos.heuristic.numerics.Cosine`. For moderate exponents
    (:data:`fotismos.heuristic.numerics.MODERATE_EXPONENTS`) it comes from unit vectors of the
    kernel's precision, for others from double precision throughout: rounding ``N``, ``L`` and ``V``
    to single precision alone turns them by 1e-7, which at ``n = 1e6`` changes the highlight by a
    thousandth. The sum ``L + V`` has double precision for all: near the horizon it may be so short
    that nothing is left of its digits. A kernel in double precision carries what rounding lost.
    """
    is_blinn = material.form == "blinn"
    if numerics.is_double(normal) and (is_blinn or not material.n_is_moderate):
        return _exact_lobe(material.form, normal, view)
    unit = normalise if material.n_is_moderate else numerics.wide_unit
    unit_normal = unit(normal)
    sides = _sides(material.form, unit_normal, (numerics.wide_unit if is_blinn else unit)(view))

    def cosine(light: Any, position: Position, toward: Direction, cos_incidence: Number) -> Cosines:
        inverse: Number = 1
        vector = toward
        if is_blinn or not material.n_is_moderate:
            vector, inverse = light.wide_toward(position)
        found = _chord(sides(vector, inverse), type(cos_incidence))
        is_lit = cos_incidence if material.n_is_moderate else dr.dot(unit_normal, vector)
        return found._replace(value=dr.select(is_lit > 0, found.value, 0))

    return cosine


def _exact_lobe(
    form: str, normal: Vector, view: Vector
) -> Callable[[Any, Position, Direction, Number], Cosines]:
    """Return :func:`lobe` of vectors that carry what rounding lost, in double precision."""
    n = numerics.exact_unit((normal, 0 * normal))
    v = numerics.exact_unit((view, 0 * view))
    cosine, lost = numerics.exact_dot(n, v)
    # The mirror image of V, `2 (N.V) N - V`.
    product, product_lost = numerics.exact_product(n[0], 2 * cosine)
    mirrored = numerics.add((product, product_lost), -v[0])
    rest = 2 * (cosine * n[1] + lost * n[0]) - v[1]

    def chord(light: Any, position: Position, toward: Direction, cos_incidence: Number) -> Cosines:
        a = numerics.exact_unit(light.offset(position))
        b = mirrored[0], mirrored[1] + rest
        if form == "blinn":
            total, total_lost = numerics.add(a, v[0])
            a = numerics.exact_unit((total, total_lost + v[1]))
            b = n
        apart = (a[0] - b[0]) + (a[1] - b[1])
        value = dr.select(cos_incidence > 0, numerics.summed(numerics.exact_dot(a, b)), 0)
        return numerics.Cosine(value, 0.5 * dr.squared_norm(apart))

    return chord


def local_lobe(form: str, is_moderate: bool, wi: Direction, wo: Direction) -> Cosines:
    """Return the lobe's cosine between two directions, in a frame whose third axis is the normal.

    Same as :func:`lobe`, for directions above the horizon.
    """
    unit = normalise if is_moderate and form == "phong" else numerics.wide_unit
    view = unit(wi)
    sides = _sides(form, type(wo if is_moderate else view)(0, 0, 1), view)
    return _chord(sides(unit(wo), 1), type(wo.z))


def _sides(
    form: str, normal: Direction, view: Direction
) -> Callable[[Vector, Number], tuple[Vector, Vector]]:
    """Return a function of ``L`` that gives the two unit vectors with the lobe's angle between.

    For ``R.V`` these are ``L`` and the mirror image of ``V``, which is one for all lights. For
    ``N.H`` only ``L + V`` needs the precision of ``L`` and ``V``; the rest has that of ``N``.
    """
    if form == "blinn":
        if type(normal) is not type(view):
            return lambda toward, inverse: (
                normal,
                normalise(type(normal)(dr.fma(toward, inverse, view))),
            )
        # To the last digit: what the lengths lack is what a short sum consists of.
        view = view * numerics.refined_inverse(dr.squared_norm(view), 1)

        def halfway(toward: Vector, inverse: Number) -> tuple[Vector, Vector]:
            inverse = numerics.refined_inverse(dr.squared_norm(toward), inverse)
            return normal, numerics.wide_unit(dr.fma(toward, inverse, view))

        return halfway
    mirrored = mirror_vector(normal, view, dr.dot(normal, view))
    return lambda toward, inverse: (toward * inverse, mirrored)


def _chord(sides: tuple[Vector, Vector], float_type: type) -> numerics.Cosine:
    """Return the cosine of two unit vectors as floats of a type, no wider than theirs.

    The chord gives ``1 - a.b`` an error of one rounding step over the chord, relative to itself,
    where the scalar product would leave one of 1. That is 1e-5 of the highlight in place of 4e-4
    for ``n = 512`` in single precision, and 1e-9 of it in place of a tenth for ``n = 1e12`` in
    double.
    """
    a, b = sides
    return numerics.Cosine(float_type(dr.dot(a, b)), float_type(0.5 * dr.squared_norm(a - b)))
