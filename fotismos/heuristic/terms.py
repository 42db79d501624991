"""The illumination model, term by term: one function per equation.

Equation numbers 8.x are of the chapter *Illumination* (sections 8.2.1-8.2.5), 6.x of the chapter
*Lighting models*. Intensities and coefficients are display-linear
(:mod:`fotismos.heuristic.convention`): numbers, Dr.Jit floats, or colours with one component per
wavelength (8.11, 8.12). The same functions serve the kernel (:mod:`fotismos.heuristic.kernel`) and
the plugins (:mod:`fotismos.heuristic.plugins`).
"""

from math import inf
from numbers import Real

import drjit as dr

from fotismos.heuristic import numerics
from fotismos.heuristic.convention import Colour, Cosines, Number
from fotismos.heuristic.numerics import power


def emission(k_i: Colour) -> Colour:
    """Equation 8.1: ``I = k_i``, independent of geometry and never attenuated."""
    return k_i


def ambient(ambient_intensity: Colour, k_a: Colour) -> Colour:
    """Equations 8.2, 6.5: ``I = I_a k_a``, independent of normal and viewer."""
    return ambient_intensity * k_a


def diffuse(intensity: Colour, k_d: Colour, cos_incidence: Number) -> Colour:
    """Equations 8.5, 8.6, 6.6, 6.7: ``I = I_p k_d (N.L)`` for ``N.L > 0``, otherwise 0.

    8.6 and 6.7 are the same for an ``intensity`` that is already attenuated, ``I_p0 f_att``.
    Chapter 6 writes ``L_d`` for ``I_p``. Lambert's law (8.3, 8.4) is why no view angle appears.

    >>> diffuse(intensity=1.0, k_d=0.5, cos_incidence=0.5)
    0.25
    >>> diffuse(intensity=1.0, k_d=0.5, cos_incidence=-0.5)
    0.0
    """
    return intensity * k_d * numerics.at_least(cos_incidence, 0)


def specular(intensity: Colour, k_s: Colour, cos_reflection: Cosines, n: Number) -> Colour:
    """Equations 8.8, 8.9, 6.8-6.10: ``I = I_p k_s (R.V)^n``.

    6.10 is the same for an ``intensity`` that is already attenuated. Chapter 6 writes ``L_s`` for
    ``I_p``. The limit of large ``n`` is :func:`mirror`. ``cos_reflection`` is a float
    or, for large ``n``, a :class:`fotismos.heuristic.numerics.Cosine`. The caller handles the
    horizon (``N.L > 0``); the lobe itself ends where ``R.V <= 0``, for every ``n``, so ``n = 0`` is
    the limit of small ``n``.

    >>> specular(intensity=1.0, k_s=0.5, cos_reflection=0.5, n=2)
    0.125
    """
    return intensity * k_s * power(cos_reflection, n)


def mirror(arriving: Colour, k_s: Colour) -> Colour:
    """Equation 8.7: ``I = I_p k_s delta(b - a)``, here without the delta function: ``I_p k_s``.

    It is what a viewer sees of light that arrives from the mirror image of the view, and the limit
    of a normalised lobe for ``n`` to infinity; the albedo is ``k_s`` for every angle and form. Only
    what has an extent is seen in a mirror: a light at a point, or in one direction, would be seen
    from one direction alone. So the kernel, which traces no rays, gives a mirror no specular light.
    """
    return arriving * k_s


def normalisation(form: str, n: Number) -> Number:
    """Return the factor on ``k_s`` that makes the lobe's albedo at normal incidence ``k_s``.

    With light along the normal, the lobes of 8.9 and of Blinn's ``(N.H)^n`` send back

    - ``phong``: ``2 k_s int cos^(n+1) sin = 2 k_s / (n + 2)``, hence the factor ``(n + 2) / 2``;
    - ``blinn``: ``2 k_s int cos(t/2)^n cos(t) sin(t) dt``, which is
      ``8 k_s (n + 2^(-n/2)) / ((n + 2) (n + 4))``, hence its inverse over ``k_s``.

    >>> normalisation("phong", 10)
    6.0
    """
    if numerics.is_number(n, inf):
        return 1.0
    if form == "blinn":
        halves = 2 ** (-float(n) / 2) if isinstance(n, Real) else dr.exp2(-n / 2)
        return (n + 2) * ((n + 4) / (8 * (n + halves)))
    return (n + 2) / 2


def attenuation(
    distance: Number,
    k0: Number,
    k1: Number,
    k2: Number,
    intensity: Colour = 1,
    inverse: Number | None = None,
) -> Colour:
    """Equation 6.1: ``I = I_0 / (k0 + k1 d + k2 d^2)``: constant, linear and quadratic parts.

    Without an ``intensity`` it is ``f_att``; ``inverse`` is ``1 / d`` if the caller has it already.
    ``(0, 0, 1)`` is chapter 8's inverse square (text at 8.6), ``(1, 0, 0)`` no attenuation. On a
    light of inverse-square type the result is 0: no direction exists there, so nothing is lit. A
    result beyond the type's range is the largest float: an infinite one would become NaN at the
    horizon.

    >>> attenuation(distance=2.0, k0=0, k1=0, k2=1)
    0.25
    """
    root = _representable(attenuation_root(distance, k0, k1, k2, inverse))
    return _representable(intensity * root * root)


def clamped_attenuation(
    distance: Number,
    c1: Number,
    c2: Number,
    c3: Number,
    intensity: Colour = 1,
    inverse: Number | None = None,
) -> Colour:
    """Text at 8.6: ``f_att = min(1 / (c1 + c2 d + c3 d^2), 1)``, so that ``0 <= f_att <= 1``.

    >>> [clamped_attenuation(distance, 0, 0, 1) for distance in (0.5, 2.0)]
    [1, 0.25]
    """
    root = numerics.at_most(attenuation_root(distance, c1, c2, c3, inverse, at_zero=1), 1)
    return intensity * root * root


def attenuation_root(
    distance: Number,
    k0: Number,
    k1: Number,
    k2: Number,
    inverse: Number | None = None,
    at_zero: Number = 0,
) -> Number:
    """Return ``1 / sqrt(k0 + k1 d + k2 d^2)``, and ``at_zero`` where the denominator is 0.

    Multiplying an intensity by it twice never leaves the type's range on the way. With ``u = 1 /
    d`` the denominator is ``d^2 (k2 + k1 u + k0 u^2)``, which is used where ``k2 d^2`` is the
    largest of the three. Of the products with ``k0``, ``k1`` and ``k2`` only that with ``k1`` must
    lie in the type's range.
    """
    float_type = type(distance)
    if numerics.is_number(k2, 0):
        return _inverse_root(float_type(k0 + distance * k1), at_zero)
    is_away = distance >= numerics.smallest(distance)
    if inverse is None:
        inverse = 1 / dr.select(is_away, distance, 1)
    if numerics.is_number(k0, 0) and numerics.is_number(k1, 0):
        return dr.select(is_away, inverse * _inverse_root(float_type(k2), at_zero), at_zero)
    first = float_type(k0)
    last = float_type(k2)
    is_far = last * distance >= numerics.at_least(first * inverse, float_type(k1))
    is_far &= is_away & (last > 0)
    # The outer coefficients swap places in the reciprocal form, so one evaluation serves both.
    variable = dr.select(is_far, inverse, distance)
    first, last = dr.select(is_far, last, first), dr.select(is_far, first, last)
    root = _inverse_root(first + variable * (k1 + variable * last), at_zero)
    return root * dr.select(is_far, inverse, 1)


def _representable(value: Number) -> Number:
    return numerics.at_most(value, numerics.largest(value))


def _inverse_root(value: Number, at_zero: Number) -> Number:
    is_positive = value > 0
    return dr.select(is_positive, dr.rsqrt(dr.select(is_positive, value, 1)), at_zero)


def spot_cone(cos_axis: Cosines, cos_cutoff: Cosines) -> Number:
    """Equation 6.2: 1 inside the cone, ``v_L.v_P >= cos(omega_L)``, and 0 outside it.

    Both are cosines, or both :class:`fotismos.heuristic.numerics.Cosine` with supplement; these
    compare by the difference from 1 or -1, whichever is nearer to the cutoff, and include the edge
    to within :data:`EDGE_STEPS` rounding steps.
    """
    if not isinstance(cos_axis, numerics.Cosine):
        return dr.select(cos_axis >= cos_cutoff, 1.0, 0.0)
    margin = EDGE_STEPS * numerics.epsilon(cos_axis.value)
    is_narrow = cos_axis.complement <= cos_cutoff.complement * (1 + margin)
    is_wide = cos_axis.supplement >= cos_cutoff.supplement * (1 - margin)
    return dr.select(dr.select(cos_cutoff.value >= 0, is_narrow, is_wide), 1.0, 0.0)


EDGE_STEPS = 8
"""A point exactly on a cone is lit, as in 6.2, however directions and cutoff are rounded."""


def spot_falloff(cos_axis: Cosines, m: Number) -> Number:
    """Equation 6.4: ``(v_L.v_P)^m``, the factor by which the cone of 6.3 fades from its axis.

    It is 0 from 90 degrees on, except for ``m = 0``, which does not fade at all: the even cone of
    6.3.

    >>> spot_falloff(cos_axis=0.5, m=2)
    0.25
    """
    if isinstance(m, Real):
        return power(cos_axis, m) if m else 1.0
    return dr.select(m == 0, 1, power(cos_axis, m))
