"""Albedo of Mitsuba's roughplastic at normal incidence, by quadrature of the plugin itself.

The directional-hemispherical albedo is ``a = 2 pi int_0^(pi/2) f(theta) cos(theta) sin(theta)
d(theta)``, where Mitsuba's ``eval`` returns ``f cos(theta)``. At normal incidence the half vector
stands at ``theta / 2`` and the lobe has the width ``alpha``; with ``tan(theta / 2) = alpha tan(s)``
it is smooth in ``s``, and Gauss-Legendre nodes in ``s`` serve rough and smooth surfaces alike.
"""

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

NODES = 96


@dataclass(frozen=True)
class RoughPlastic:
    """Parameters of Mitsuba's ``roughplastic``.

    ``diffuse_reflectance`` and ``specular_reflectance`` have three components, ``int_ior`` is
    relative to vacuum as Mitsuba has it, and ``alpha`` is the root-mean-square slope.
    """

    diffuse_reflectance: tuple[float, float, float]
    alpha: float
    int_ior: float
    ext_ior: float = 1.0
    specular_reflectance: tuple[float, float, float] = (1.0, 1.0, 1.0)
    distribution: str = "beckmann"
    nonlinear: bool = False


@dataclass(frozen=True)
class Albedo:
    """The two parts of the albedo at normal incidence, one value a channel."""

    diffuse: np.ndarray
    specular: np.ndarray


def of_roughplastic(plastic):
    """Return the :class:`Albedo` of a :class:`RoughPlastic` at normal incidence.

    The diffuse part is computed for each channel, since ``nonlinear`` makes it no multiple of the
    reflectance; the specular part is a multiple of ``specular_reflectance``.
    """
    levels = dict.fromkeys(plastic.diffuse_reflectance)
    parts = {level: _parts(plastic, level) for level in levels}
    diffuse = np.array([parts[level][0] for level in plastic.diffuse_reflectance])
    specular = parts[plastic.diffuse_reflectance[0]][1] * np.array(plastic.specular_reflectance)
    return Albedo(diffuse, specular)


def of_smooth_plastic(level, int_ior, ext_ior, nonlinear):
    """Return the diffuse albedo of Mitsuba's ``plastic`` for one reflectance, and the mirror's.

    The latter is Fresnel's at normal incidence, ``((n_i - n_e) / (n_i + n_e))^2``.
    """
    bsdf = mi.load_dict(
        {
            "type": "plastic",
            "diffuse_reflectance": float(level),
            "int_ior": float(int_ior),
            "ext_ior": float(ext_ior),
            "nonlinear": nonlinear,
        }
    )
    theta, weight = nodes(1.0)
    si, wo = _head_on(theta)
    value = bsdf.eval(mi.BSDFContext(), si, wo)
    # Next to nothing comes out rounded, to either side of 0.
    return max(float(weight @ np.array(value[0])), 0.0), (
        (int_ior - ext_ior) / (int_ior + ext_ior)
    ) ** 2


def _head_on(theta):
    """Return interactions at normal incidence, and directions at polar angles."""
    si = dr.zeros(mi.SurfaceInteraction3f, len(theta))
    si.wi = mi.Vector3f(0, 0, 1)
    if mi.is_spectral:
        si.wavelengths = 550.0  # any will do: all spectra here are uniform
    return si, mi.Vector3f(mi.Float(np.sin(theta)), 0, mi.Float(np.cos(theta)))


def _parts(plastic, level):
    """Return the diffuse albedo for one reflectance, and the specular one for unit reflectance."""
    bsdf = mi.load_dict(
        {
            "type": "roughplastic",
            "diffuse_reflectance": float(level),
            "alpha": float(plastic.alpha),
            "int_ior": float(plastic.int_ior),
            "ext_ior": float(plastic.ext_ior),
            "distribution": plastic.distribution,
            "nonlinear": plastic.nonlinear,
        }
    )
    theta, weight = nodes(plastic.alpha)
    si, wo = _head_on(theta)
    # Each part by itself: near an IOR of 1 their difference from the whole would be rounding. Which
    # component is which is told by its flags, not by its place.
    parts = []
    for flag in (mi.BSDFFlags.DiffuseReflection, mi.BSDFFlags.GlossyReflection):
        context = mi.BSDFContext()
        context.type_mask = +flag
        parts.append(bsdf.eval(context, si, wo))
    dr.eval(parts)
    return tuple(float(weight @ np.array(part[0], float).ravel()) for part in parts)


def nodes(alpha):
    """Return polar angles and weights of the quadrature, ``sin(theta)`` included in the weights."""
    points, weights = np.polynomial.legendre.leggauss(NODES)
    end = np.arctan(1 / alpha)
    s = end * (points + 1) / 2
    theta = 2 * np.arctan(alpha * np.tan(s))
    jacobian = 2 * alpha / (np.cos(s) ** 2 + (alpha * np.sin(s)) ** 2)
    return theta, 2 * np.pi * np.sin(theta) * jacobian * weights * end / 2
