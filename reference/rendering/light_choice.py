"""Which of thousands of lights to evaluate: picked in proportion to their contribution.

``N`` lights are picked per sample, light ``i`` with the chance ::

    p_i = (1 - u) g_i / sum_k g_k + u / n,    g_i = mean over points x of |cos theta| E_i(x)

of ``n`` lights. ``E_i(x)`` is Mitsuba's sample of the light at ``x``, its mean over the channels,
without shadows; the points are :data:`PROBES` that the camera sees. A picked light's contribution
is divided by ``N p_i``: its mean is the sum over all lights, as long as no chance is 0. The uniform
share ``u`` ensures that, and bounds the weight of a light that the points do not see.
"""

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from heuristic.arrays import Array, Mask, Number
from reference.pairing.nearest.probe import lattice
from reference.rendering.light_sums import sampled

MOST_ASKED = 4096
"""Up to this many lights each is evaluated at every sample."""

PICKS = 16
"""Lights picked per sample if there are more."""

PROBES = 1024
UNIFORM_SHARE = 0.1


class LightChoice:
    """The chances of lights.

    Parameters
    ----------
    scene
        The Mitsuba scene, with its first sensor.
    lights
        Emitters to choose from.
    picks
        How many are picked per sample, ``N``.

    Attributes
    ----------
    chances
        ``p_i``, (n,).
    """

    def __init__(self, scene: mi.Scene, lights: list, picks: int = PICKS):
        self.lights, self.picks = lights, picks
        given, count = _given(scene, lights), len(lights)
        total = given.sum()
        even = np.full(count, 1 / count)
        known = np.isfinite(total) and total > 0
        share = UNIFORM_SHARE
        self.chances = share * even + (1 - share) * given / total if known else even
        self.distribution = mi.DiscreteDistribution(mi.Float(self.chances))
        are_delta = [mi.has_flag(light.flags(), mi.EmitterFlags.Delta) for light in lights]
        self._delta = mi.UInt32(np.array(are_delta, np.uint32))
        self._by_pointer = _by_pointer(lights, self.chances)

    def pick(self, number: Array, active: Mask) -> tuple[Array, Number]:
        """Return a light's number, and how often it is expected, for a random number."""
        index, chance = self.distribution.sample_pmf(number, active)
        return index, self.picks * chance

    def is_delta(self, number: Array, active: Mask) -> Mask:
        """Return whether the light of a number is a point or direction."""
        return dr.gather(mi.UInt32, self._delta, number, active) > 0

    def expected(self, emitter: Any, active: Mask) -> Number:
        """Return how often a light that a ray has hit is expected, 0 for any other."""
        place = dr.minimum(_number(emitter), len(self._by_pointer) - 1)
        return self.picks * dr.gather(mi.Float, self._by_pointer, place, active)


def _number(emitter):
    return dr.reinterpret_array(mi.UInt32, emitter)


def _by_pointer(lights, chances):
    """Return the chances of lights by the numbers of their pointers."""
    numbers = [int(_number(mi.EmitterPtr(light))[0]) for light in lights]
    table = np.zeros(max(numbers) + 2)
    table[numbers] = chances
    return mi.Float(table)


def _given(scene, lights):
    """Return each light's total contribution to the visible points, (n,)."""
    numbers = [mi.Float(row) for row in lattice(PROBES)[:5]]
    sensor = scene.sensors()[0]
    film, sample = mi.Point2f(*numbers[:2]), mi.Point2f(*numbers[2:4])
    ray, _ = sensor.sample_ray_differential(
        sensor.shutter_open(), numbers[4], film, mi.Point2f(0.5)
    )
    si = scene.ray_intersect(ray)
    dr.eval(si, sample)
    place = dr.tile(dr.arange(mi.UInt32, PROBES), len(lights))
    light = dr.repeat(dr.arange(mi.UInt32, len(lights)), PROBES)
    si, sample = (dr.gather(type(value), value, place) for value in (si, sample))
    _, direction, density, weight = sampled(lights, light, si, sample, si.is_valid())
    level = dr.mean(mi.unpolarized_spectrum(weight)) * abs(dr.dot(direction, si.sh_frame.n))
    level = dr.select(si.is_valid() & (density > 0) & dr.isfinite(level), level, 0)
    return np.array(dr.block_sum(level, PROBES), float)
