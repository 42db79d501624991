"""Transmission through the coat of Mitsuba's ``roughplastic``, by that plugin's quadratures.

When created, the plugin tabulates by Gauss-Legendre rules over visible microfacet normals ``m``

    T(mu) = sum w G(o) (1 - F),  o the refracted direction,   at 64 cosines mu,
    R = 2 mean(mu sum w G(o) F),  o the reflected one,  seen from within, over the same cosines,

for light that arrives at the cosine ``mu``, with Fresnel's ``F`` and Smith's masking ``G``. The
rules are visibly coarse: ``1 - R`` is uneven by 1e-4 in the index of refraction, so no table of it
reproduces the plugin's values. Here the same sums run as kernels over many surfaces at once, and
results are kept. Source: the plugin's documentation, and Walter, Marschner, Li and Torrance (EGSR
2007) for ``F``, ``G`` and the refracted direction.

Two symmetries halve the work: light arrives in the plane of x and z, so slopes along y count once
for both signs, and Beckmann's slopes along x and y are independent.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache, lru_cache

import drjit as dr
import mitsuba as mi
import numpy as np

ROWS = 64
"""Cosines at which the plugin tabulates."""

COSINES = np.maximum(np.linspace(0, 1, ROWS, dtype=np.float32), np.float32(1e-6))
SINES = np.sqrt(1 - COSINES * COSINES)

COARSE, FINE = 32, 128
"""Nodes along each axis of a rule: few into the denser side, many out of it."""

AT_ONCE = 64
"""Surfaces per kernel: enough to keep all cores busy, in some ten megabytes of memory."""

KEPT = 4096
"""Surfaces whose sums are kept."""


@dataclass(frozen=True)
class Interface:
    """A rough interface: roughness, index inside over outside, and ``beckmann`` or ``ggx``."""

    alpha: float
    eta: float
    distribution: str = "beckmann"


@dataclass(frozen=True)
class Coat:
    """Transmittance (64,) at :data:`COSINES`, and reflectance from within for diffuse light."""

    transmittance: np.ndarray
    returned: float


_found: dict[Interface, Coat] = {}


def of(interface: Interface) -> Coat:
    """Return the :class:`Coat` of an :class:`Interface`."""
    if interface not in _found:
        prepare([interface])
    return _found[interface]


def prepare(interfaces: Iterable[Interface]) -> None:
    """Compute the coats of many interfaces together; :func:`of` then only looks them up."""
    missing = dict.fromkeys(one for one in interfaces if one not in _found)
    groups: dict[tuple, list[Interface]] = {}
    for one in missing:
        groups.setdefault((one.distribution, one.eta > 1), []).append(one)
    for (distribution, is_denser), group in groups.items():
        for start in range(0, len(group), AT_ONCE):
            _keep(group[start : start + AT_ONCE], distribution, is_denser)


def _keep(chunk: list[Interface], distribution: str, is_denser: bool) -> None:
    alphas, etas = (
        np.array([getattr(one, name) for one in chunk], np.float32) for name in ("alpha", "eta")
    )
    inward, outward = (COARSE, FINE) if is_denser else (FINE, COARSE)
    passed = _sums(distribution, alphas, etas, inward, is_refracted=True)
    thrown = _sums(distribution, alphas, 1 / etas, outward, is_refracted=False)
    returned = 2 * np.mean(thrown * COSINES, axis=1)
    keep(_found, dict(zip(chunk, map(Coat, passed, returned.tolist()), strict=True)))


def keep(found: dict, more: dict) -> None:
    """Keep results, and drop the oldest beyond :data:`KEPT`."""
    found.update(more)
    for one in list(found)[: max(len(found) - max(KEPT, len(more)), 0)]:
        del found[one]


def _sums(
    distribution: str, alphas: np.ndarray, etas: np.ndarray, size: int, is_refracted: bool
) -> np.ndarray:
    """Return the sums over rules of ``size`` by ``size`` nodes, (interfaces, 64).

    Each thread handles one node along the first axis, and loops over those along the second.
    """
    half = size // 2
    rule = _rule(size)
    thread = dr.arange(mi.UInt32, len(alphas) * ROWS * size)
    node, row, surface = thread % size, (thread // size) % ROWS, thread // (size * ROWS)
    alpha, eta = (dr.gather(mi.Float, mi.Float(given), surface) for given in (alphas, etas))
    inverse = 1 / eta
    mu, sine = (dr.gather(mi.Float, given, row) for given in (rule.cosine, rule.sine))
    slopes = _slopes(distribution, rule, alpha, mu, sine, node)

    def step(index, total):
        x, y = slopes(index)
        value = _value(distribution, alpha, eta, inverse, mu, sine, x, y, is_refracted)
        return index + 1, dr.fma(value, dr.gather(mi.Float, rule.second, index), total)

    _, total = dr.while_loop(
        (mi.UInt32(0), dr.zeros(mi.Float, dr.width(thread))),
        lambda index, total: index < half,
        step,
        labels=("index", "total"),
    )
    total *= dr.gather(mi.Float, rule.first, node)
    sums = np.array(dr.block_sum(total, size), float).reshape(len(alphas), ROWS)
    return sums * rule.rounded if distribution == "beckmann" else sums


@dataclass(frozen=True)
class Rule:
    """Nodes and weights of a rule as arrays, with the rows' cosines and sines.

    ``place`` are the nodes in (0, 1), ``normal`` Beckmann's slopes at the second half of them,
    ``disc`` (x, y) GGX's points of the unit disc, first axis by half of the second. ``rounded`` is
    the sum of all weights in the plugin, which adds them one by one in single precision: Beckmann's
    terms are mostly bare weights, and an error of 1e-6 in ``R`` is 1e-5 of a bright base.
    """

    cosine: mi.Float
    sine: mi.Float
    place: mi.Float
    first: mi.Float
    second: mi.Float
    normal: mi.Float
    disc: tuple[mi.Float, mi.Float]
    rounded: float


def _rule(size: int) -> Rule:
    return _rule_in(mi.variant(), size)


@cache
def _rule_in(variant: str, size: int) -> Rule:
    """Return the :class:`Rule` with the arrays of a variant."""
    from scipy.special import erfinv  # see refraction.of_lobe

    nodes, weights = legendre(size)
    half = size // 2
    place: np.ndarray = np.asarray(nodes, np.float32) * np.float32(0.5) + np.float32(0.5)
    first, second = np.repeat(place, half), np.tile(place[half:], size)
    disc = mi.warp.square_to_uniform_disk_concentric(mi.Point2f(mi.Float(second), mi.Float(first)))
    found = Rule(
        mi.Float(COSINES),
        mi.Float(SINES),
        mi.Float(place),
        mi.Float(weights / 2),
        mi.Float(weights[half:]),  # half of a weight for each sign
        mi.Float(erfinv(nodes[half:])),
        (disc.x, disc.y),
        float(np.cumsum(np.float32(np.outer(weights, weights) / 4), dtype=np.float32)[-1]),
    )
    dr.eval(found.cosine, found.sine, found.place, found.first, found.second, found.normal, disc)
    return found


@lru_cache
def legendre(size: int) -> tuple[np.ndarray, np.ndarray]:
    """Return nodes in (-1, 1) and weights of the Gauss-Legendre rule, computed once."""
    return np.polynomial.legendre.leggauss(size)


def _slopes(distribution, rule, alpha, mu, sine, node):
    """Return a function of a node of the second axis: the facet's slopes against x and y."""
    half = dr.width(rule.normal)
    if distribution == "beckmann":
        facets = mi.MicrofacetDistribution(mi.MicrofacetType.Beckmann, alpha)
        # The middle of the other axis has a slope of 0 along y.
        middle = mi.Point2f(dr.gather(mi.Float, rule.place, node), 0.5)
        facet, _ = facets.sample(mi.Vector3f(sine, 0, mu), middle)
        x = facet.x / facet.z
        dr.eval(x)
        return lambda index: (x, alpha * dr.gather(mi.Float, rule.normal, index))

    # Heitz (JCGT 2018): project the disc along the stretched direction, and turn it back.
    length = dr.rsqrt(dr.square(alpha * sine) + dr.square(mu))
    along, across = mu * length, alpha * sine * length
    share = (1 + along) / 2

    def visible(index):
        place = node * half + index
        side, given = (dr.gather(mi.Float, axis, place) for axis in rule.disc)
        height = dr.lerp(dr.safe_sqrt(1 - dr.square(side)), given, share)
        depth = dr.safe_sqrt(1 - dr.square(side) - dr.square(height))
        scale = alpha / dr.fma(across, height, along * depth)
        return (across * depth - along * height) * scale, side * scale

    return visible


def _value(distribution, alpha, eta, inverse, mu, sine, x, y, is_refracted):
    """Return ``G(o) (1 - F)`` or ``G(o) F`` of a facet with slopes against ``x`` and ``y``."""
    normal = dr.rsqrt(1 + dr.square(x) + dr.square(y))
    cosine = dr.fma(sine, x, mu) * normal
    inside = dr.safe_sqrt(1 - (1 - dr.square(cosine)) * dr.square(inverse))
    across, along = dr.fma(eta, inside, cosine), dr.fma(eta, cosine, inside)
    # Both of Fresnel's equations over one denominator.
    reflected = (
        dr.square(dr.fma(-eta, inside, cosine) * along)
        + dr.square(dr.fma(eta, cosine, -inside) * across)
    ) / (2 * dr.square(across * along))
    if is_refracted:
        turn, keep, share = (inside - cosine * inverse) * normal, -inverse, 1 - reflected
    else:
        turn, keep, share = 2 * cosine * normal, 1, reflected
    # Away from the surface, on either side.
    height = dr.fma(-keep, mu, turn)
    side = dr.square(dr.fma(turn, x, -keep * sine)) + dr.square(turn * y)
    leaves = (height > 0) & ((inside if is_refracted else cosine) > 0)
    return dr.select(leaves, share * _masking(distribution, alpha, height, side), 0)


def _masking(distribution, alpha, height, side):
    """Return Smith's masking of a direction, ``side / height^2`` the square of its tangent."""
    if distribution == "ggx":
        return 2 / (1 + dr.sqrt(1 + side * dr.square(alpha / height)))
    a = dr.minimum(height * dr.rsqrt(side * dr.square(alpha)), 1.6)
    rational = a * dr.fma(2.181, a, 3.535) / dr.fma(a, dr.fma(2.577, a, 2.276), 1)
    return dr.select(a < 1.6, rational, 1)
