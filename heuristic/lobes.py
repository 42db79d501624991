"""The cosine whose power is the specular lobe, as accurate as the exponent requires."""

from collections.abc import Callable

import drjit as dr

from heuristic import numerics, vectors
from heuristic.arrays import Cosines, Direction, Mask, Number, Position, Vector
from heuristic.light import Light
from heuristic.materials import Material
from heuristic.numerics import Cosine


def lobe(
    material: Material, normal: Vector, view: Vector
) -> Callable[[Light, Position, Direction, Number], Cosines]:
    """Return a function that gives the lobe's cosine for a light, 0 for lights below the horizon.

    ``R.V`` (8.9), or ``N.H`` for the form ``blinn``. Whatever depends only on the normal and the
    view is computed once for all lights.

    For moderate exponents (:data:`heuristic.numerics.MODERATE_EXPONENTS`) it is a float from unit
    vectors of the kernel's precision. For others it is a :class:`heuristic.numerics.Cosine` from
    double precision throughout: rounding ``N``, ``L`` and ``V`` to single precision alone turns
    them by 1e-7, which at ``n = 1e6`` changes the highlight by a thousandth.

    Parameters
    ----------
    material
        Its form and exponent.
    normal, view
        Of any length.

    Returns
    -------
    callable
        ``lobe(light, position, toward, cos_incidence)``, with ``L`` and ``N.L`` in the kernel's
        precision.
    """
    cosine_of = {"phong": _mirrored, "blinn": _halved}[material.form]
    if material.n_is_moderate:
        cosine = cosine_of(vectors.normalise(normal), vectors.normalise(view), vectors.normalise)

        def moderate(light, position, toward, cos_incidence):
            return dr.select(cos_incidence > 0, cosine(toward, 1), 0)

        return moderate

    normal, view = numerics.wide_unit(normal), numerics.wide_unit(view)
    cosine = cosine_of(normal, view, numerics.wide_unit)

    def sharp(light, position, toward, cos_incidence):
        vector, inverse = light.wide_toward(position)
        is_lit = dr.dot(normal, vector) > 0
        return narrowed(cosine(vector, inverse), is_lit, type(cos_incidence))

    return sharp


def local_lobe(material_form: str, is_moderate: bool, wi: Direction, wo: Direction) -> Cosines:
    """Return the lobe's cosine between two directions, in a frame whose third axis is the normal.

    Same as :func:`lobe`, for directions above the horizon.
    """
    if is_moderate:
        wi, wo = vectors.normalise(wi), vectors.normalise(wo)
        return _local_cosine(material_form, wi, wo, vectors.normalise)
    float_type = type(wo.z)
    wi, wo = numerics.wide_unit(wi), numerics.wide_unit(wo)
    return narrowed(_local_cosine(material_form, wi, wo, numerics.wide_unit), True, float_type)


def narrowed(cosine: Cosines, is_lit: Mask, float_type: type) -> Cosine:
    """Return a cosine in double precision as :class:`heuristic.numerics.Cosine` of a float type.

    Its value is 0 where a light is below the horizon.
    """
    return Cosine(dr.select(is_lit, float_type(cosine), 0), float_type(1 - cosine))


def _mirrored(normal, view, unit):
    """``R.V`` as the scalar product of ``L`` with the mirror image of ``V``, one for all lights."""
    mirrored = vectors.mirror_vector(normal, view, dr.dot(normal, view))
    return lambda toward, inverse: dr.dot(toward, mirrored) * inverse


def _halved(normal, view, unit):
    return lambda toward, inverse: dr.dot(normal, unit(dr.fma(toward, inverse, view)))


def _local_cosine(form, wi, wo, unit):
    if form == "blinn":
        return unit(wi + wo).z
    return wo.z * wi.z - wo.x * wi.x - wo.y * wi.y
