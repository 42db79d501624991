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


def beam_width_for(cutoff, exponent):
    """Return the beam width whose linear fall-off is nearest to ``cos^m``, in degrees."""
    theta, weight = _cone(cutoff)
    wanted = power_falloff(theta, exponent)

    def distance(beam_width):
        return np.sum(weight * (linear_falloff(theta, cutoff, beam_width) - wanted) ** 2)

    # Mitsuba refuses a beam as wide as the cone; just below it the cone is even.
    widest = cutoff * (1 - 1e-4)
    found = minimize_scalar(distance, bounds=(0, widest), method="bounded")
    return float(min((0.0, widest, found.x), key=distance))


def linear_falloff(theta, cutoff, beam_width):
    """Return the factor of Mitsuba's ``spot`` at the angles ``theta``, all in degrees."""
    return np.clip((cutoff - theta) / max(cutoff - beam_width, 1e-12), 0, 1)


def power_falloff(theta, exponent):
    """Return ``cos^m(theta)``, 0 beyond a right angle; ``theta`` in degrees."""
    return np.maximum(np.cos(np.radians(theta)), 0) ** exponent * (theta < 90)


def _cone(cutoff):
    theta = (np.arange(STEPS) + 0.5) * cutoff / STEPS
    return theta, np.sin(np.radians(theta))
