"""Albedos of Mitsuba's plastics at normal incidence, by the plugins' own formulas.

The directional-hemispherical albedo is ``a = 2 pi int_0^(pi/2) f(theta) cos(theta) sin(theta)
d(theta)``. At normal incidence the half vector stands at ``theta / 2`` and the lobe has the width
``alpha``; with ``t = tan(theta / 2) = alpha tan(s)`` it is smooth in ``s``, and Gauss-Legendre
nodes in ``s`` suit both rough and smooth surfaces. There ``roughplastic`` has (Walter, Marschner,
Li and Torrance 2007, and the plugin's documentation)

    specular  F D G(theta) / 4,      D = exp(-t^2 / alpha^2) (1 + t^2)^2 / (pi alpha^2), or GGX's
    diffuse   rho' T(1) T(cos(theta)) cos(theta) / (pi eta^2),

with the tabulated ``T`` and ``R`` of :mod:`reference.pairing.coat`, and ``rho' = rho / (1 - R)``,
or ``rho / (1 - rho R)`` if ``nonlinear`` is on. Outside their range the plugin itself is evaluated
(:func:`by_plugin`).
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

import drjit as dr
import mitsuba as mi
import numpy as np

from heuristic.plugins.mapped import SMALLEST_ALPHA
from reference.pairing import coat
from reference.pairing.coat import Interface

NODES = 96

KEPT = coat.KEPT
"""Materials whose results are kept."""

SHARPEST, ROUGHEST = 1e-3, 100.0
"""Roughness for which the plugin's albedos are reproduced to 1e-5. Outside, the plugin itself is
evaluated; below, only for the diffuse part."""
LEAST_RATIO, LARGEST_RATIO = 0.71, 20.0
"""The same for indices of refraction. Below ``sqrt(1/2)`` facets reflect totally head on, and
single precision decides which nodes see it."""

DISTRIBUTIONS = ("beckmann", "ggx")


@dataclass(frozen=True)
class RoughPlastic:
    """Parameters of Mitsuba's ``roughplastic``.

    ``diffuse_reflectance`` and ``specular_reflectance`` have three components, ``int_ior`` is
    relative to vacuum, as in Mitsuba, and ``alpha`` is the root-mean-square slope.
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
    """The two parts of the albedo at normal incidence, one value per channel."""

    diffuse: np.ndarray
    specular: np.ndarray


def of_roughplastic(plastic: RoughPlastic) -> Albedo:
    """Return the :class:`Albedo` of a :class:`RoughPlastic` at normal incidence."""
    interface = _coated(plastic)
    if interface is None:
        return by_plugin(plastic)
    found = coat.of(interface)
    theta, weight = nodes(interface.alpha)
    cosine = np.cos(theta)
    leaving = np.interp(cosine, np.linspace(0, 1, coat.ROWS), found.transmittance)
    through = found.transmittance[-1] * (weight @ (leaving * cosine)) / np.pi / interface.eta**2
    rho = np.array(plastic.diffuse_reflectance, float)
    diffuse = rho * through / (1 - (rho if plastic.nonlinear else 1) * found.returned)
    return Albedo(diffuse, specular_of(plastic))


def specular_of(plastic: RoughPlastic) -> np.ndarray:
    """Return the specular part of :func:`of_roughplastic`; it does not need a kernel."""
    interface = _interface(plastic)
    if interface is None:
        return by_plugin(plastic).specular
    return _lobe(interface) * np.array(plastic.specular_reflectance, float)


def prepare(plastics: Iterable[RoughPlastic]) -> None:
    """Run the kernels for many surfaces at once (:func:`coat.prepare`)."""
    coat.prepare(one for one in map(_coated, plastics) if one is not None)


def of_smooth_plastic(
    level: float, int_ior: float, ext_ior: float, nonlinear: bool
) -> tuple[float, float]:
    """Return the diffuse albedo of Mitsuba's ``plastic`` for one reflectance, and the mirror's.

    The latter is Fresnel's at normal incidence, ``((n_i - n_e) / (n_i + n_e))^2``.
    """
    eta = int_ior / ext_ior
    theta, weight = nodes(1.0)
    cosine = np.cos(theta)
    mirror = ((int_ior - ext_ior) / (int_ior + ext_ior)) ** 2
    leaving = weight @ ((1 - _fresnel(cosine, eta)) * cosine) / np.pi / eta**2
    returned = _smooth_return(eta)
    base = level / (1 - (level if nonlinear else 1) * returned)
    # Beyond an index of 4 the fit reflects more than all, and the plugin's base is below 0.
    return max(float(base * (1 - mirror) * leaving), 0.0), mirror


@lru_cache(maxsize=KEPT)
def _smooth_return(eta: float) -> float:
    """Return a smooth coat's reflectance for diffuse light from within, by Mitsuba's fit."""
    return float(mi.fresnel_diffuse_reflectance(mi.Float(1 / eta))[0])


def by_plugin(plastic: RoughPlastic) -> Albedo:
    """Return the same as :func:`of_roughplastic` by quadrature of the plugin itself, which is slow.

    The diffuse part is computed per channel, since with ``nonlinear`` it is not a multiple of the
    reflectance; the specular part is a multiple of ``specular_reflectance``.
    """
    levels = dict.fromkeys(plastic.diffuse_reflectance)
    parts = {level: _parts(plastic, level) for level in levels}
    diffuse = np.array([parts[level][0] for level in plastic.diffuse_reflectance])
    specular = parts[plastic.diffuse_reflectance[0]][1] * np.array(plastic.specular_reflectance)
    return Albedo(diffuse, specular)


def _interface(plastic: RoughPlastic) -> Interface | None:
    """Return the surface of a plastic, None if the plugin itself must be evaluated."""
    # The plugin keeps both in single precision, which matters near an IOR of 1.
    alpha = float(np.float32(plastic.alpha))
    with np.errstate(all="ignore"):
        eta = float(np.float32(plastic.int_ior) / np.float32(plastic.ext_ior))
    is_known = (
        plastic.distribution in DISTRIBUTIONS
        and np.float32(SMALLEST_ALPHA) <= alpha <= ROUGHEST
        and LEAST_RATIO <= eta <= LARGEST_RATIO
        and eta != 1
    )
    return Interface(alpha, eta, plastic.distribution) if is_known else None


def _coated(plastic: RoughPlastic) -> Interface | None:
    """Return the surface of a plastic if its diffuse part is computed too."""
    found = _interface(plastic)
    return found if found is not None and found.alpha >= np.float32(SHARPEST) else None


def _lobe(interface: Interface) -> float:
    """Return the albedo of the specular part, for unit ``specular_reflectance``."""
    alpha, eta = interface.alpha, interface.eta
    theta, weight = nodes(alpha)
    slope = np.tan(theta / 2)
    if interface.distribution == "beckmann":
        density = np.exp(-((slope / alpha) ** 2))
        height = np.minimum(1 / (alpha * np.tan(theta)), 1.6)
        height = np.where(theta < np.pi / 2, height, 0)
        masking = (3.535 * height + 2.181 * height**2) / (1 + 2.276 * height + 2.577 * height**2)
        masking = np.where(height < 1.6, masking, 1)
    else:
        density = (1 + (slope / alpha) ** 2) ** -2.0
        masking = 2 / (1 + np.sqrt(1 + (alpha * np.tan(theta)) ** 2))
    density *= (1 + slope**2) ** 2 / (np.pi * alpha**2)
    return float(weight @ (_fresnel(np.cos(theta / 2), eta) * density * masking)) / 4


def _fresnel(cosine: np.ndarray, eta: float) -> np.ndarray:
    """Return the reflectance of a smooth dielectric for unpolarised light."""
    inside = np.sqrt(np.maximum(1 - (1 - cosine**2) / eta**2, 0))
    across = (cosine - eta * inside) / (cosine + eta * inside)
    along = (eta * cosine - inside) / (eta * cosine + inside)
    return (across**2 + along**2) / 2


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
    # Each part separately: near an IOR of 1 a difference would be rounding. Flags, not places,
    # identify components.
    parts = []
    for flag in (mi.BSDFFlags.DiffuseReflection, mi.BSDFFlags.GlossyReflection):
        context = mi.BSDFContext()
        context.type_mask = +flag
        parts.append(bsdf.eval(context, si, wo))
    dr.eval(parts)
    return tuple(float(weight @ np.array(part[0], float).ravel()) for part in parts)


@lru_cache(maxsize=KEPT)
def nodes(alpha: float) -> tuple[np.ndarray, np.ndarray]:
    """Return polar angles and weights of the quadrature; the weights include ``sin(theta)``."""
    points, weights = coat.legendre(NODES)
    end = np.arctan(1 / alpha)
    s = end * (points + 1) / 2
    theta = 2 * np.arctan(alpha * np.tan(s))
    jacobian = 2 * alpha / (np.cos(s) ** 2 + (alpha * np.sin(s)) ** 2)
    return theta, 2 * np.pi * np.sin(theta) * jacobian * weights * end / 2
