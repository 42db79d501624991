"""The two fall-offs of a spot light fitted to each other.

Mitsuba's ``spot`` is even up to its beam width and falls linearly in the angle to 0 at its cutoff;
the chapters' (6.4) falls as ``cos^m`` and is cut off. Neither can be the other. The fit minimises
``int (cos^m(t) - g(t))^2 sin(t) dt`` over the cone, the mean square over its solid angle.
"""

import numpy as np
from scipy.optimize import minimize_scalar

LARGEST_EXPONENT = 1e5
STEPS = 2048


def exponent_for(cutoff, beam_width):
    """Return the ``m`` of 6.4 nearest to Mitsuba's fall-off; angles in degrees."""
    theta, weight = _cone(cutoff)
    wanted = linear_falloff(theta, cutoff, beam_width)

    def distance(log_m):
        return np.sum(weight * (power_falloff(theta, np.expm1(log_m)) - wanted) ** 2)

    # In log(1 + m), because sharp spots differ little from one exponent to the next.
    found = minimize_scalar(distance, bounds=(0, np.log(LARGEST_EXPONENT)), method="bounded")
    return float(np.expm1(found.x))


def cone_for(cutoff, exponent):
    """Return the cutoff and beam width whose linear fall-off is nearest to ``cos^m``, in degrees.

    A sharp beam ends long before its cone does, so that the cutoff is fitted too, up to the cone's.
    """
    theta, weight = _cone(cutoff)
    wanted = power_falloff(theta, exponent)

    def distance(edge, beam_width):
        return np.sum(weight * (linear_falloff(theta, edge, beam_width) - wanted) ** 2)

    def best_beam(edge):
        # Mitsuba refuses a beam as wide as the cone; just below it the cone is even.
        return _least(lambda beam_width: distance(edge, beam_width), 0.0, edge * (1 - 1e-4))

    edge = _least(lambda edge: distance(edge, best_beam(edge)), 1e-3 * cutoff, cutoff)
    return edge, best_beam(edge)


def _least(function, low, high):
    """Return where a function of one minimum is least, the ends of the interval included."""
    found = minimize_scalar(function, bounds=(low, high), method="bounded").x
    return float(min((low, high, found), key=function))


def linear_falloff(theta, cutoff, beam_width):
    """Return the factor of Mitsuba's ``spot`` at the angles ``theta``, all in degrees."""
    return np.clip((cutoff - theta) / max(cutoff - beam_width, 1e-12), 0, 1)


def power_falloff(theta, exponent):
    """Return ``cos^m(theta)``, 0 beyond a right angle; ``theta`` in degrees."""
    return np.maximum(np.cos(np.radians(theta)), 0) ** exponent * (theta < 90)


def _cone(cutoff):
    theta = (np.arange(STEPS) + 0.5) * cutoff / STEPS
    return theta, np.sin(np.radians(theta))
