"""Indices of refraction at which rough plastics have given albedos at normal incidence."""

from collections.abc import Sequence
from dataclasses import replace
from math import exp, log, sqrt

import numpy as np

from reference.pairing import albedo
from reference.pairing.albedo import Albedo, RoughPlastic

LITERAL_IOR = 1.5
SMALLEST_IOR = exp(1e-4)
"""Reflects 2.5e-9 at normal incidence; used for anything less, since Mitsuba rejects an IOR of
1."""
LARGEST_IOR = 10.0
"""No dielectric comes near it; a larger specular albedo is recorded as missed."""

STEP = 1.02
"""Ratio of logarithms of the IOR between neighbours that are compared."""


def of_lobe(plastic: RoughPlastic, wanted: float) -> float:
    """Return the IOR at which the specular albedo is ``wanted``, or the nearest one allowed.

    The albedo rises with the IOR, and a smooth surface's is Fresnel's ``((ior - 1) / (ior +
    1))^2``: the search begins at its inverse.
    """

    def reached(log_ior):
        int_ior = exp(min(max(log_ior, log(SMALLEST_IOR)), log(LARGEST_IOR)))
        return max(albedo.specular_of(replace(plastic, int_ior=int_ior)))

    if wanted <= 0:
        return LITERAL_IOR
    if wanted >= reached(log(LARGEST_IOR)):
        return LARGEST_IOR
    if wanted <= reached(log(SMALLEST_IOR)):
        return SMALLEST_IOR
    from scipy.optimize import root_scalar  # above, it would be a tenth of a command's start

    root = min(sqrt(wanted), 0.8)
    guess = log((1 + root) / (1 - root))
    found = root_scalar(
        lambda log_ior: log(reached(log_ior) / wanted),
        x0=guess,
        x1=1.1 * guess,
        method="secant",
        xtol=1e-7,
    )
    return exp(found.root)


def nearest(plastics: Sequence[RoughPlastic], wanted: Sequence[Albedo]) -> list[float]:
    """Return the IOR, up to each plastic's own, whose albedos are nearest to the requested ones.

    A high index reflects more, and transmits less to the diffuse base and back: no index gives both
    parts. The sum of squares over the parts and channels is minimised, for all plastics at once,
    since albedos of many surfaces take little longer than one.
    """

    def distances(log_iors, which):
        tried = [
            replace(plastics[place], int_ior=exp(value))
            for place, value in zip(which, log_iors, strict=True)
        ]
        albedo.prepare(tried)
        return np.array(
            [_distance(wanted[place], one) for place, one in zip(which, tried, strict=True)]
        )

    # At the minimum the values one step to either side are equal: the minimum itself is too flat
    # to locate in single precision.
    def slope(log_log_iors, which):
        log_iors = np.exp(log_log_iors)
        both = np.concatenate([log_iors * STEP, log_iors / STEP])
        above, below = np.split(distances(both, np.tile(which, 2)), 2)
        return above - below

    every = np.arange(len(plastics))
    smallest = log(log(SMALLEST_IOR) * STEP)
    high = np.log(np.log([plastic.int_ior for plastic in plastics]) / STEP)
    low = high.copy()
    searched, between = every[slope(high, every) > 0], []
    while len(searched):
        high[searched], low[searched] = low[searched], np.maximum(low[searched] - 1, smallest)
        is_rising = slope(low[searched], searched) >= 0
        between.extend(searched[~is_rising])
        searched = searched[is_rising & (low[searched] > smallest)]
    # If the slope rises even at the smallest IOR, that one is nearest; if it never rises, the
    # highest is: there is no minimum in between.
    if between:
        from scipy.optimize.elementwise import find_root  # see of_lobe

        bracket, places = (low[between], high[between]), np.array(between)
        low[between] = find_root(slope, bracket, args=(places,), tolerances={"xatol": 1e-4}).x
    return np.exp(np.exp(low)).tolist()


def _distance(wanted: Albedo, plastic: RoughPlastic) -> float:
    reached = albedo.of_roughplastic(plastic)
    diffuse = np.minimum(wanted.diffuse, reached.diffuse)
    return np.sum((diffuse - wanted.diffuse) ** 2 + (reached.specular - wanted.specular) ** 2)
