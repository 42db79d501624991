"""The cosine whose power is the specular lobe, as accurate as the exponent requires."""

from collections.abc import Callable

import drjit as dr

from heuristic import numerics, vectors
from heuristic.convention import Cosines, Direction, Number, Position, Vector
from heuristic.lights import Light
from heuristic.materials import Material


def lobe(
    material: Material, normal: Vector, view: Vector
) -> Callable[[Light, Position, Direction, Number], Cosines]:
    """Return ``lobe(light, position, toward, cos_incidence)``, the lobe's cosine for a light.

    It is ``R.V`` (8.9), or ``N.H`` for the form ``blinn``, and 0 for lights below the horizon.
    Whatever depends only on the normal and the view is computed once for all lights.

    For moderate exponents (:data:`heuristic.numerics.MODERATE_EXPONENTS`) it is a float from unit
    vectors of the kernel's precision. For others it is a :class:`heuristic.numerics.Cosine` from
    double precision throughout: rounding ``N``, ``L`` and ``V`` to single precision alone turns
    them by 1e-7, which at ``n = 1e6`` changes the highlight by a thousandth.
    """
    unit = vectors.normalise if material.n_is_moderate else numerics.wide_unit
    sides = _sides(material.form, unit(normal), unit(view), unit)
    if material.n_is_moderate:
        return lambda light, position, toward, cos_incidence: dr.select(
            cos_incidence > 0, dr.dot(*sides(toward, 1)), 0
        )
    normal = unit(normal)

    def sharp(light, position, toward, cos_incidence):
        vector, inverse = light.wide_toward(position)
        cosine = _narrow_cosine(*sides(vector, inverse), type(cos_incidence))
        return cosine._replace(value=dr.select(dr.dot(normal, vector) > 0, cosine.value, 0))

    return sharp


def local_lobe(form: str, is_moderate: bool, wi: Direction, wo: Direction) -> Cosines:
    """Return the lobe's cosine between two directions, in a frame whose third axis is the normal.

    Same as :func:`lobe`, for directions above the horizon.
    """
    unit = vectors.normalise if is_moderate else numerics.wide_unit
    view, toward = unit(wi), unit(wo)
    vector = type(view)
    if form == "blinn":
        sides = vector(0, 0, 1), unit(view + toward)
    else:
        sides = toward, vector(-view.x, -view.y, view.z)
    return dr.dot(*sides) if is_moderate else _narrow_cosine(*sides, type(wo.z))


def _sides(form, normal, view, unit):
    """Return a function of ``L`` that gives the two unit vectors with the lobe's angle between.

    For ``R.V`` these are ``L`` and the mirror image of ``V``, which is one for all lights.
    """
    if form == "blinn":
        return lambda toward, inverse: (normal, unit(dr.fma(toward, inverse, view)))
    mirrored = vectors.mirror_vector(normal, view, dr.dot(normal, view))
    return lambda toward, inverse: (toward * inverse, mirrored)


def _narrow_cosine(a, b, float_type):
    """Return the cosine of two unit vectors in double precision, as floats of a smaller type.

    The chord gives ``1 - a.b`` an error of 1e-13 of itself, where the scalar product would leave
    1e-13 of 1: for ``n = 1e12`` a tenth of the highlight.
    """
    return numerics.Cosine(float_type(dr.dot(a, b)), float_type(0.5 * dr.squared_norm(a - b)))
