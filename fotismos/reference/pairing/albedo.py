"""Albedos of Mitsuba's plastics at normal incidence, and the phong of the same albedo.

The directional-hemispherical albedo is ``a = 2 pi int_0^(pi/2) f(theta) cos(theta) sin(theta)
d(theta)``. At normal incidence the half vector stands at ``theta / 2`` and the lobe has the width
``alpha``; with ``t = tan(theta / 2) = alpha tan(s)`` it is smooth in ``s``, and Gauss-Legendre
nodes in ``s`` suit both rough and smooth surfaces. There ``roughplastic`` has (Walter, Marschner,
Li and Torrance, EGSR 2007, and the plugin's documentation)

    specular  F D G(theta) / 4,      D = exp(-t^2 / alpha^2) (1 + t^2)^2 / (pi alpha^2), or GGX's
    diffuse   rho' T(1) T(cos(theta)) cos(theta) / (pi eta^2),

with ``rho' = rho / (1 - R)``, or ``rho / (1 - rho R)`` if ``nonlinear`` is on. When created, the
plugin tabulates by Gauss-Legendre rules over visible microfacet normals ``m``

    T(mu) = sum w G(o) (1 - F),  o the refracted direction,   at 64 cosines mu,
    R = 2 mean(mu sum w G(o) F),  o the reflected one,  seen from within, over the same cosines,

for light that arrives at the cosine ``mu``, with Fresnel's ``F`` and Smith's masking ``G``. The
rules are coarse: ``1 - R`` is uneven by 1e-4 in the index of refraction. Here the same sums run as
a kernel, in 8 ms; the plugin takes 70 ms, and a search for an index needs them about forty times.

Two symmetries save work: light arrives in the plane of x and z, so slopes along y count once for
both signs, and Beckmann's slopes along x and y are independent.
"""

from dataclasses import dataclass, replace
from functools import cache, lru_cache
from math import exp, log
from typing import NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

import fotismos.reference.scene  # noqa: F401  it gives Mitsuba a variant
from fotismos.heuristic.terms import normalisation
from fotismos.reference.pairing.factors import (
    Convention,
    Phong,
    alpha_of,
    exponent_of,
    specular_albedo,
)
from fotismos.reference.pairing.pairing_record import Miss

NODES = 96

KEPT = 4096
"""Materials whose results are kept."""

ROWS = 64
COSINES = np.maximum(np.linspace(0, 1, ROWS, dtype=np.float32), np.float32(1e-6))
SINES = np.sqrt(1 - COSINES * COSINES)

COARSE = 32
FINE = 128
"""Nodes along each axis of a rule: few into the denser side, many out of it."""

LEAST_SPREAD = 0.01
"""Least roughness for the nodes of the diffuse part. Those of a smoother lobe crowd in the lobe,
and too few are left beside it."""

LITERAL_IOR = 1.5
SMALLEST_IOR = exp(1e-4)
"""Reflects 2.5e-9 at normal incidence; Mitsuba rejects an IOR of 1."""
LARGEST_IOR = 10.0
LARGEST_SMOOTH_IOR = 3.8
"""Largest indices of rough and of smooth plastics; a specular albedo that needs more is recorded as
missed. Above the second, Mitsuba's fit lets a smooth coat return more from within than arrives."""

MATCHING_TOLERANCE = 1e-5
"""Relative tolerance; a larger mismatch is recorded as a miss."""

STEP = 1.02
"""Ratio of logarithms of the IOR between neighbours that are compared."""


@dataclass(frozen=True)
class RoughPlastic:
    """Parameters of Mitsuba's ``roughplastic``; ``alpha`` is the root-mean-square slope.

    With ``alpha = 0`` they are those of ``plastic``.
    """

    diffuse_reflectance: tuple[float, float, float]
    alpha: float
    int_ior: float
    ext_ior: float = 1.0
    specular_reflectance: tuple[float, float, float] = (1.0, 1.0, 1.0)
    distribution: str = "beckmann"
    nonlinear: bool = False

    @property
    def interface(self) -> tuple[str, float, float]:
        """Distribution, roughness and ratio of indices in single precision, as the plugin's."""
        eta = float(np.float32(self.int_ior) / np.float32(self.ext_ior))
        return self.distribution, float(np.float32(self.alpha)), eta


class Albedo(NamedTuple):
    """The two parts of the albedo at normal incidence, one value per channel."""

    diffuse: np.ndarray
    specular: np.ndarray


def of_roughplastic(plastic: RoughPlastic) -> Albedo:
    """Return the :class:`Albedo` of a :class:`RoughPlastic` at normal incidence."""
    distribution, alpha, eta = plastic.interface
    if not alpha:
        smooth = [
            of_smooth_plastic(rho, plastic.int_ior, plastic.ext_ior, nonlinear=plastic.nonlinear)[0]
            for rho in plastic.diffuse_reflectance
        ]
        return Albedo(np.array(smooth), specular_of(plastic))
    transmittance, returned = coat(distribution, alpha, eta)
    theta, weight = nodes(max(alpha, LEAST_SPREAD))
    # The plugin interpolates its 64 values linearly, too.
    cosine = np.cos(theta)
    leaving = np.interp(cosine, np.linspace(0, 1, ROWS), transmittance)
    through = transmittance[-1] * (weight @ (leaving * cosine)) / np.pi / eta**2
    rho = np.array(plastic.diffuse_reflectance, float)
    diffuse = rho * through / (1 - (rho if plastic.nonlinear else 1) * returned)
    return Albedo(diffuse, specular_of(plastic))


def specular_of(plastic: RoughPlastic) -> np.ndarray:
    """Return the specular part of :func:`of_roughplastic`; it does not need a kernel."""
    distribution, alpha, eta = plastic.interface
    if not alpha:
        return _fresnel(np.ones(1), eta) * plastic.specular_reflectance
    theta, weight = nodes(alpha)
    slope = np.tan(theta / 2)
    if distribution == "beckmann":
        density = np.exp(-((slope / alpha) ** 2))
        # Smith's masking for Beckmann by the plugin's rational fit in 1 / (alpha tan).
        height = np.minimum(1 / (alpha * np.tan(theta)), 1.6)
        height = np.where(theta < np.pi / 2, height, 0)
        masking = (3.535 * height + 2.181 * height**2) / (1 + 2.276 * height + 2.577 * height**2)
        masking = np.where(height < 1.6, masking, 1)
    else:
        density = (1 + (slope / alpha) ** 2) ** -2.0
        masking = 2 / (1 + np.sqrt(1 + (alpha * np.tan(theta)) ** 2))
    density *= (1 + slope**2) ** 2 / (np.pi * alpha**2)
    whole = weight @ (_fresnel(np.cos(theta / 2), eta) * density * masking) / 4
    return float(whole) * np.array(plastic.specular_reflectance, float)


def of_smooth_plastic(
    level: float, int_ior: float, ext_ior: float, nonlinear: bool
) -> tuple[float, float]:
    """Return the diffuse albedo of Mitsuba's ``plastic`` for one reflectance, and its mirror's."""
    eta = int_ior / ext_ior
    theta, weight = nodes(1.0)
    cosine = np.cos(theta)
    mirror = ((int_ior - ext_ior) / (int_ior + ext_ior)) ** 2
    leaving = weight @ ((1 - _fresnel(cosine, eta)) * cosine) / np.pi / eta**2
    # Light that a smooth coat reflects from within, by Mitsuba's fit.
    returned = float(mi.fresnel_diffuse_reflectance(mi.Float(1 / eta))[0])
    base = level / (1 - (level if nonlinear else 1) * returned)
    # Beyond an index of 3.84 the fit reflects more than all, and the plugin's base is below 0.
    return max(float(base * (1 - mirror) * leaving), 0.0), mirror


def ior_of_lobe(plastic: RoughPlastic, albedo: float) -> float:
    """Return the IOR at which the specular part has an albedo, or the nearest one allowed.

    The search is over the logarithm of ``ior - 1``: the albedo falls with its square.
    """
    largest = LARGEST_IOR if plastic.alpha else LARGEST_SMOOTH_IOR

    def distance(x: float) -> float:
        return log(max(specular_of(replace(plastic, int_ior=1 + exp(x)))) / albedo)

    if albedo <= 0:
        return LITERAL_IOR
    low = log(SMALLEST_IOR - 1)
    high = log(largest - 1)
    # The albedo grows with the index; for one out of reach an end is nearest.
    if distance(high) <= 0:
        return largest
    if distance(low) >= 0:
        return SMALLEST_IOR
    from scipy.optimize import brentq  # loaded late: a tenth of a command's start

    return 1 + exp(brentq(distance, low, high, xtol=1e-7))


def nearest_ior(plastic: RoughPlastic, albedo: Albedo) -> float:
    """Return the IOR, up to the plastic's own, whose albedos are nearest in the least squares.

    A high index reflects more and transmits less to the base and back: no index gives both.
    """

    def distance(log_ior: float) -> float:
        reached = of_roughplastic(replace(plastic, int_ior=exp(log_ior)))
        # The base may be darker than white, so a diffuse excess is no distance.
        diffuse = np.minimum(albedo.diffuse, reached.diffuse)
        squares = (diffuse - albedo.diffuse) ** 2 + (reached.specular - albedo.specular) ** 2
        return float(np.sum(squares))

    # At the minimum the values one step to either side are equal: the minimum itself is too flat
    # to locate in single precision.
    def slope(log_log_ior: float) -> float:
        return distance(exp(log_log_ior) * STEP) - distance(exp(log_log_ior) / STEP)

    smallest = log(log(SMALLEST_IOR) * STEP)
    low = high = log(log(plastic.int_ior) / STEP)
    is_rising = slope(high) > 0
    # Towards smaller indices until the slope changes its sign.
    while is_rising and low > smallest:
        low, high = max(low - 1, smallest), low
        is_rising = slope(low) >= 0
    # Without a change of sign the smallest or the highest IOR is nearest.
    if low < high and not is_rising:
        from scipy.optimize import brentq  # loaded late: see ior_of_lobe

        low = brentq(slope, low, high, xtol=1e-4)
    return exp(exp(low))


@lru_cache(maxsize=KEPT)
def nodes(alpha: float) -> tuple[np.ndarray, np.ndarray]:
    """Return polar angles and weights of the quadrature; the weights include ``sin(theta)``."""
    points, weights = _legendre(NODES)
    # At the end `alpha tan(s)` is 1, and theta a right angle.
    end = np.arctan(1 / alpha)
    s = end * (points + 1) / 2
    theta = 2 * np.arctan(alpha * np.tan(s))
    jacobian = 2 * alpha / (np.cos(s) ** 2 + (alpha * np.sin(s)) ** 2)
    return theta, 2 * np.pi * np.sin(theta) * jacobian * weights * end / 2


_legendre = lru_cache(np.polynomial.legendre.leggauss)


def _fresnel(cosine: np.ndarray, eta: float) -> np.ndarray:
    inside = np.sqrt(np.maximum(1 - (1 - cosine**2) / eta**2, 0))
    across = (cosine - eta * inside) / (cosine + eta * inside)
    along = (eta * cosine - inside) / (eta * cosine + inside)
    return (across**2 + along**2) / 2


@lru_cache(maxsize=KEPT)
def coat(distribution: str, alpha: float, eta: float) -> tuple[np.ndarray, float]:
    """Return a coat's transmittance ``T`` at :data:`COSINES`, (64,), and its ``R``."""
    inward, outward = (COARSE, FINE) if eta > 1 else (FINE, COARSE)
    passed = _sums(distribution, alpha, eta, inward, is_refracted=True)
    thrown = _sums(distribution, alpha, 1 / eta, outward, is_refracted=False)
    return passed, float(2 * np.mean(thrown * COSINES))


def _sums(distribution: str, alpha: float, eta: float, size: int, is_refracted: bool) -> np.ndarray:
    """Return the sums over rules of ``size`` by ``size`` nodes, (64,)."""
    incident, first, second, normal, weight = _rule(mi.variant(), size)
    width = dr.opaque(mi.Float, alpha)
    if distribution == "beckmann":
        facets = mi.MicrofacetDistribution(mi.MicrofacetType.Beckmann, width)
        # The middle of the second axis has a slope of 0 along y.
        every = dr.arange(mi.UInt32, ROWS * size) * (size // 2)
        middle = mi.Point2f(dr.gather(mi.Float, first, every), 0.5)
        facet, _ = facets.sample(dr.gather(mi.Vector3f, incident, every), middle)
        slope = facet.x / facet.z
        dr.eval(slope)
        slope = dr.gather(mi.Float, slope, dr.arange(mi.UInt32, dr.width(weight)) // (size // 2))
        # Beckmann's slope along y is that of roughness 1, scaled.
        facet = dr.normalize(mi.Vector3f(slope, width * normal, 1))
    else:
        facets = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, width)
        # For GGX the first number makes the slope along y.
        facet, _ = facets.sample(incident, mi.Point2f(second, first))
    cosine = dr.dot(incident, facet)
    reflected, inside, _, inverse = mi.fresnel(cosine, dr.opaque(mi.Float, eta))
    if is_refracted:
        leaving = mi.refract(incident, facet, inside, inverse)
        share = 1 - reflected
    else:
        leaving = mi.reflect(incident, facet)
        share = reflected
    # A facet may send light to the wrong side, where it is lost.
    leaves = (leaving.z < 0) if is_refracted else (leaving.z > 0)
    value = dr.select(leaves & (share > 0), share * facets.smith_g1(leaving, facet), 0)
    return np.array(dr.block_sum(value * weight, size * size // 2), float)


@cache
def _rule(variant: str, size: int) -> tuple[np.ndarray, ...]:
    """Return a rule at all cosines, as arrays of a variant.

    Directions of light, two nodes in (0, 1), Beckmann's slopes along the second axis for a
    roughness of 1, and weights. The second axis has only its upper half.
    """
    from scipy.special import erfinv  # loaded late: see ior_of_lobe

    points, weights = _legendre(size)
    # Cosine, first axis and upper half of the second, flattened.
    row, i, j = np.indices((ROWS, size, size // 2)).reshape(3, -1)
    j += size // 2
    node = np.asarray(points, np.float32) * np.float32(0.5) + np.float32(0.5)
    rule = (
        mi.Vector3f(mi.Float(SINES[row]), 0, mi.Float(COSINES[row])),
        mi.Float(node[i]),
        mi.Float(node[j]),
        mi.Float(erfinv(points)[j]),
        # Over 4 for the unit square, times 2 for the half left out.
        mi.Float(weights[i] * weights[j] / 2),
    )
    dr.eval(rule)
    return rule


@lru_cache(maxsize=KEPT)
def to_roughplastic(phong: Phong, convention: Convention) -> tuple[RoughPlastic, tuple[Miss, ...]]:
    """Return the :class:`RoughPlastic` that corresponds to a :class:`Phong`, and its misses.

    >>> grey = (0.5, 0.5, 0.5)
    >>> plastic, misses = to_roughplastic(Phong(grey, (0.2, 0.2, 0.2), 12), Convention.MATCHED)
    >>> misses, round(plastic.alpha, 9)
    ((), 0.2)
    >>> _, misses = to_roughplastic(Phong(grey, (0.7, 0.7, 0.7), 3), Convention.MATCHED)
    >>> [miss.what for miss in misses]
    ['diffuse albedo at normal incidence', 'specular albedo at normal incidence']
    """
    if convention is Convention.LITERAL:
        rho, misses = up_to_1("diffuse reflectance", phong.k_d)
        return RoughPlastic(rho, alpha_of(phong.n, "blinn"), LITERAL_IOR), misses

    # The lobe: width, tint, and the index that gives its strongest channel.
    diffuse = np.array(phong.k_d)
    specular = specular_albedo(phong)
    strength = max(phong.k_s)
    red, green, blue = phong.k_s
    tint = red / strength, green / strength, blue / strength
    white = RoughPlastic(
        (1.0, 1.0, 1.0),
        alpha_of(phong.n, phong.form),
        LITERAL_IOR,
        specular_reflectance=tint,
    )
    white = replace(white, int_ior=ior_of_lobe(white, max(specular)))
    # The base: if the coat lets too little light through, both parts give way.
    if any(diffuse > of_roughplastic(white).diffuse):
        white = replace(white, int_ior=nearest_ior(white, Albedo(diffuse, specular)))
    passed = of_roughplastic(white).diffuse
    red, green, blue = np.minimum(diffuse / passed, 1).tolist()  # it is linear in rho
    plastic = replace(white, diffuse_reflectance=(red, green, blue))
    missed = {}
    for part, targets in (("diffuse", diffuse), ("specular", specular)):
        for target, value in zip(targets, getattr(of_roughplastic(plastic), part), strict=True):
            if abs(value - target) > MATCHING_TOLERANCE * max(target, 1e-3):
                what = f"{part} albedo at normal incidence"
                missed[part, target] = Miss(what=what, wanted=float(target), reached=float(value))
    return plastic, tuple(missed.values())


def up_to_1(
    what: str, colour: tuple[float, float, float]
) -> tuple[tuple[float, float, float], tuple[Miss, ...]]:
    """Return a colour limited to 1, as a reflectance is, and what it misses."""
    red, green, blue = colour
    limited = min(red, 1.0), min(green, 1.0), min(blue, 1.0)
    missed = (component for component in dict.fromkeys(colour) if component > 1)
    return limited, tuple(Miss(what=what, wanted=c, reached=1.0) for c in missed)


@lru_cache(maxsize=KEPT)
def to_phong(plastic: RoughPlastic, convention: Convention) -> Phong:
    """Return the :class:`Phong` that corresponds to a :class:`RoughPlastic`; nothing is missed.

    >>> plastic = RoughPlastic(diffuse_reflectance=(0.5, 0.4, 0.3), alpha=0.5, int_ior=1.5)
    >>> phong = to_phong(plastic, Convention.LITERAL)
    >>> phong.k_d, phong.n
    ((0.5, 0.4, 0.3), 6.0)
    """
    if convention is Convention.LITERAL:
        n = exponent_of(plastic.alpha, "blinn")
        return Phong(plastic.diffuse_reflectance, plastic.specular_reflectance, n)
    n = exponent_of(plastic.alpha)
    reflected = of_roughplastic(plastic)
    k_s = reflected.specular * normalisation("phong", n)
    (red, green, blue) = reflected.diffuse.tolist()
    lobe = k_s.tolist()
    return Phong((red, green, blue), (lobe[0], lobe[1], lobe[2]), n)
