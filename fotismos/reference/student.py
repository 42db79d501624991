"""Quantiles of Student's t, without SciPy: importing it takes as long as comparing two pictures."""

from functools import lru_cache
from math import cos, nan, pi, sin, sqrt, tan

HALVINGS = 64
"""Halvings of the interval of angles: beyond, doubles no longer change."""


@lru_cache(maxsize=256)
def quantile(degrees: int, probability: float) -> float:
    """Return the value that Student's t is below with a probability between 0 and 1.

    ``degrees`` of freedom are whole; with none it is not a number. Beyond a probability of 1e-9 at
    either end it has fewer than seven digits.
    """
    if degrees < 1:
        return nan
    if probability < 0.5:
        return -quantile(degrees, 1.0 - probability)
    between = 2.0 * probability - 1.0
    low = 0.0
    high = pi / 2.0
    for _ in range(HALVINGS):
        middle = (low + high) / 2.0
        low, high = (middle, high) if _share_within(middle, degrees) < between else (low, middle)
    return sqrt(degrees) * tan(low)


def _share_within(angle: float, degrees: int) -> float:
    """Return the probability of ``|t| < √degrees tan(angle)``.

    Abramowitz and Stegun, *Handbook of Mathematical Functions* (1964), 26.7.3 and 26.7.4: a sum of
    powers of the cosine, odd ones with ``2/π`` before it and the angle added, or even ones.
    """
    is_odd = degrees % 2 == 1
    term = cos(angle) if is_odd else 1.0
    total = 0.0
    for power in range(int(is_odd), degrees - 1, 2):
        total += term
        term *= cos(angle) ** 2 * (power + 1) / (power + 2)
    if is_odd:
        return 2.0 / pi * (angle + sin(angle) * total)
    return sin(angle) * total
