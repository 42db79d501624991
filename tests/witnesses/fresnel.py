"""Surfaces in a white furnace, by quadrature in NumPy: what a sphere shows in a sky of radiance 1.

Fresnel's equations, and rough interfaces of microfacets with the distributions of Beckmann and of
Trowbridge and Reitz (GGX), masked after Smith as in Walter et al. 2007. A surface seen at an angle
shows its albedo for light of that angle, by reciprocity.
"""

from functools import cache

import numpy as np
from scipy.interpolate import CubicSpline

NODES = 96
"""Of the rules, in the height of a direction and about the normal."""

ANGLES = 96
"""Of a table, between which a spline interpolates."""

HEIGHTS = np.linspace(0, 1, 64)
"""Cosines at which Mitsuba tabulates a rough interface."""


def dielectric(cosine, eta):
    """Return the reflectance of a smooth dielectric; ``eta`` is inside over outside."""
    cosine = np.clip(cosine, 0, 1)
    square = 1 - (1 - cosine**2) / eta**2
    inside = np.sqrt(np.maximum(square, 0))
    tiny = np.finfo(float).tiny  # at a grazing angle all four products are 0
    parallel = (eta * cosine - inside) / (eta * cosine + inside + tiny)
    upright = (cosine - eta * inside) / (cosine + eta * inside + tiny)
    return np.where((square > 0) & (cosine > 0), (parallel**2 + upright**2) / 2, 1.0)


def conductor(cosine, eta, k):
    """Return the reflectance of a smooth conductor of index ``eta + i k``."""
    inside = np.sqrt((eta + 1j * k) ** 2 - (1 - cosine**2))
    upright = (cosine - inside) / (cosine + inside)
    parallel = ((eta + 1j * k) ** 2 * cosine - inside) / ((eta + 1j * k) ** 2 * cosine + inside)
    return (np.abs(upright) ** 2 + np.abs(parallel) ** 2) / 2


def diffuse_mean(function):
    """Return ``2 int function(cos) cos d(cos)``: the mean over diffuse light."""
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    cosine = (nodes + 1) / 2
    return float(np.sum(weights * function(cosine) * cosine))


def smooth_plastic(cosine, rho, eta, nonlinear):
    """Return the albedo of a smooth coat over a diffuse base, ``F + (1 - F) rho'``.

    With ``nonlinear`` light meets the base again and again, until it leaves: ``rho'`` is
    ``rho (1 - R) / (1 - rho R)``, ``R`` the mean reflectance from inside. Otherwise it is ``rho (1
    - R) / (1 - R)``. Where it divides, ``R`` is Mitsuba's fit; above, ``1 - R`` is the mean that
    enters over ``eta^2``.
    """
    through = diffuse_mean(lambda c: 1 - dielectric(c, eta))
    base = rho * through / eta**2 / (1 - (rho if nonlinear else 1) * egan_and_hilgeman(eta))
    return dielectric(cosine, eta) + (1 - dielectric(cosine, eta)) * base


def egan_and_hilgeman(eta):
    """Return the fit of 1973 to ``R``, the mean reflectance from inside, which Mitsuba takes."""
    return 0.0636 * eta + 0.6681 + 0.7099 / eta - 1.4399 / eta**2


def rough_mirror(cosine, alpha, distribution):
    """Return the albedo of microfacets that are perfect mirrors; what meets two of them is lost."""
    return _curve(cosine, alpha, distribution, None, False)


def rough_plastic(cosine, rho, alpha, eta):
    """Return the albedo of a rough coat (Beckmann) over a diffuse base, as Mitsuba defines it.

    What the base returns has passed the interface twice, ``T(cos)`` and its mean over diffuse
    light, and is divided by ``1 - R``, ``R`` the mean reflectance from inside. Mitsuba takes that
    mean over :data:`HEIGHTS`, the ends in full, and ``T`` from straight lines between them.
    """
    inner = float(np.mean(2 * HEIGHTS * _curve(HEIGHTS, alpha, "beckmann", 1 / eta, False)))
    table = _curve(HEIGHTS, alpha, "beckmann", eta, True)
    through = diffuse_mean(lambda c: np.interp(c, HEIGHTS, table))
    base = rho / (1 - inner) / eta**2
    mirrored = _curve(cosine, alpha, "beckmann", eta, False)
    return mirrored + np.interp(cosine, HEIGHTS, table) * base * through


def _curve(cosine, alpha, distribution, eta, transmitted):
    """Return a directional albedo at any angles, between those of a fine table."""
    return _table(alpha, distribution, eta, transmitted)(np.arccos(np.clip(cosine, 0, 1)))


@cache
def _table(alpha, distribution, eta, transmitted):
    # Denser towards grazing angles, where the curves bend.
    angles = np.sin(np.linspace(0, np.pi / 2 * 0.995, ANGLES)) * np.pi / 2
    values = [_albedo(angle, alpha, distribution, eta, transmitted) for angle in angles]
    return CubicSpline(angles, values)


def _albedo(angle, alpha, distribution, eta, transmitted):
    """Return ``int D(m) G(i) G(o) (i.m) / cos(i) F dm`` over the microfacets' normals ``m``."""
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    # In u with tan^2 = -alpha^2 ln(1 - u), or alpha^2 u / (1 - u): D cos dm becomes du dphi / 2 pi.
    u = (nodes + 1) / 2
    square = -np.log1p(-u) if distribution == "beckmann" else u / (1 - u)
    height = 1 / np.sqrt(1 + alpha**2 * square)
    phi = (np.arange(NODES) + 0.5) * np.pi / NODES
    m_z = height[:, None]
    m_x = np.sqrt(1 - m_z**2) * np.cos(phi)
    i_x, i_z = np.sin(angle), np.cos(angle)
    along = i_x * m_x + i_z * m_z
    facing = np.maximum(along, 0)
    if eta is None:
        share = 1.0
    else:
        share = dielectric(facing, eta)
        share = 1 - share if transmitted else share
    if transmitted:
        inside = np.sqrt(np.maximum(1 - (1 - facing**2) / eta**2, 0))
        # The refracted ray leaves on the other side of both the surface and the microfacet.
        leaving = np.maximum(i_z / eta - (facing / eta - inside) * m_z, 0)
    else:
        leaving = np.maximum(2 * along * m_z - i_z, 0)
    weight = share * facing / i_z / m_z * _smith(i_z, alpha, distribution)
    weight = weight * _smith(leaving, alpha, distribution) * (leaving > 0)
    return float(np.sum(weights[:, None] / 2 * weight) / NODES)


def _smith(cosine, alpha, distribution):
    cosine = np.maximum(cosine, 1e-9)
    tangent = np.sqrt(np.maximum(1 - cosine**2, 0)) / cosine
    if distribution == "ggx":
        return 2 / (1 + np.hypot(1, alpha * tangent))
    a = 1 / np.maximum(alpha * tangent, 1e-9)
    rational = (3.535 * a + 2.181 * a**2) / (1 + 2.276 * a + 2.577 * a**2)
    return np.where(a < 1.6, rational, 1.0)
