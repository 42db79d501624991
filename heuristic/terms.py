"""The illumination model, term by term: one function an equation.

Equation numbers 8.x are of the chapter *Illumination* (sections 8.2.1-8.2.5), 6.x of the chapter
*Lighting models*. Intensities and coefficients are display-linear (see
:mod:`heuristic.convention`); they are numbers, Dr.Jit floats, or colours with one component for
each wavelength (8.11, 8.12). Cosines are scalar products of unit vectors. The same functions serve
the kernel (:mod:`heuristic.shading`) and the Mitsuba plugins (:mod:`heuristic.plugins`).
"""

from numbers import Real

import drjit as dr


def emission(k_i):
    """Equation 8.1: ``I = k_i``, independent of geometry and never attenuated."""
    return k_i


def ambient(ambient_intensity, k_a):
    """Equations 8.2, 6.5: ``I = I_a k_a``, independent of normal and viewer."""
    return ambient_intensity * k_a


def diffuse(intensity, k_d, cos_incidence):
    """Equations 8.5, 8.6, 6.6, 6.7: ``I = I_p k_d (N.L)`` for ``N.L > 0``, otherwise 0.

    8.6 and 6.7 are the same for an ``intensity`` that is already attenuated, ``I_p0 f_att``.
    Lambert's law (8.3, 8.4) is why no view angle appears.
    """
    return intensity * k_d * dr.maximum(cos_incidence, 0)


def specular(intensity, k_s, cos_reflection, n):
    """Equations 8.8, 8.9, 6.8-6.10: ``I = I_p k_s (R.V)^n``.

    6.10 is the same for an ``intensity`` that is already attenuated. The limit of large ``n`` is
    the perfect mirror of 8.7. The caller sees to the horizon (``N.L > 0``); the lobe itself ends
    where ``R.V <= 0``, for every ``n``, so that ``n = 0`` is the limit of small ``n``.
    """
    return intensity * k_s * power(cos_reflection, n)


def normalisation(form, n):
    """Return the factor on ``k_s`` that makes the lobe's albedo at normal incidence ``k_s``.

    With light along the normal, the lobes of 8.9 and of Blinn's ``(N.H)^n`` send back

    - ``phong``: ``2 k_s int cos^(n+1) sin = 2 k_s / (n + 2)``, hence the factor ``(n + 2) / 2``;
    - ``blinn``: ``2 k_s int cos(t/2)^n cos(t) sin(t) dt``, which is
      ``8 k_s (n + 2^(-n/2)) / ((n + 2) (n + 4))``, hence its inverse over ``k_s``.
    """
    if form == "blinn":
        halves = 2 ** (-n / 2) if isinstance(n, Real) else dr.exp2(-n / 2)
        return (n + 2) * (n + 4) / (8 * (n + halves))
    return (n + 2) / 2


LARGEST_LITERAL_EXPONENT = 64
"""Up to here an integer exponent is multiplied out: at most 11 products, and an error of
``n`` rounding steps, against the logarithm, exponential and branch of a general power."""


def power(cosine, n):
    """Return ``cosine ** n`` where the cosine is positive, and 0 elsewhere.

    A Python integer up to :data:`LARGEST_LITERAL_EXPONENT` becomes products in the compiled kernel,
    three times faster than the general power. Give a Dr.Jit array where values change often: any
    plain number is compiled in, and each value anew.
    """
    lobe = cosine > 0
    if isinstance(n, int) and n <= LARGEST_LITERAL_EXPONENT:
        return dr.select(lobe, dr.power(cosine, n), 0)
    return dr.select(lobe, dr.exp2(n * dr.log2(dr.select(lobe, cosine, 1))), 0)


def attenuation(distance, k0, k1, k2):
    """Equation 6.1: ``f_att = 1 / (k0 + k1 d + k2 d^2)``: constant, linear and quadratic parts.

    ``(0, 0, 1)`` is chapter 8's inverse square (text at 8.6), ``(1, 0, 0)`` no attenuation. Where
    the denominator is 0 (on a light of inverse-square type) the factor is 0: no direction exists
    there, so nothing is lit.
    """
    denominator = k0 + distance * (k1 + distance * k2)
    return dr.select(denominator > 0, dr.rcp(denominator), 0)


def clamped_attenuation(distance, c1, c2, c3):
    """Text at 8.6: ``f_att = min(1 / (c1 + c2 d + c3 d^2), 1)``, so that ``0 <= f_att <= 1``."""
    denominator = c1 + distance * (c2 + distance * c3)
    return dr.select(denominator > 1, dr.rcp(denominator), 1)


def spot_cone(cos_axis, cos_cutoff):
    """Equation 6.2: 1 inside the cone, ``v_L.v_P >= cos(omega_L)``, and 0 outside it."""
    return dr.select(cos_axis >= cos_cutoff, 1.0, 0.0)


def spot_falloff(cos_axis, m):
    """Equation 6.4: ``(v_L.v_P)^m``, the factor by which the cone of 6.3 fades from its axis."""
    return power(cos_axis, m)
