"""Direct light of a list of lights, at the points that rays hit.

Up to :data:`UNROLLED` lights are unrolled: each has its own code in the kernel. For more, LLVM's
time would grow faster than their number, so they become the targets of one call in a loop. Dr.Jit
merges targets with the same code: the kernel grows with the kinds of lights, not with their number.

Each function takes ``scene``, ``si``, ``bsdf``, ``sampler`` and ``active`` like Mitsuba's
integrators, and ``shadows`` and ``bsdf_samples`` like :mod:`reference.rendering.direct`.
``is_delta`` is whether the lights are points or directions, which need no random number.
"""

from collections.abc import Sequence
from functools import partial
from typing import Any

import drjit as dr
import mitsuba as mi

from heuristic import numerics
from heuristic.arrays import Array, Colour, Direction, Interaction, Mask, Number, Position, Scene

UNROLLED = 16
"""Lights of a list that have their own code."""


def of_one(
    light: Any,
    is_delta: bool,
    scene: Scene,
    si: Interaction,
    bsdf: Any,
    sampler: Any,
    active: Mask,
    shadows: bool,
    bsdf_samples: int,
) -> Colour:
    """Return the contribution of a light."""
    drawn = _sampled(light, si, _numbers(sampler, is_delta, active), active)
    return _reflected(scene, si, bsdf, drawn, active, is_delta, shadows, bsdf_samples)


def of_many(
    lights: Sequence[Any],
    is_delta: bool,
    scene: Scene,
    si: Interaction,
    bsdf: Any,
    sampler: Any,
    active: Mask,
    shadows: bool,
    bsdf_samples: int,
    choice: Any = None,
) -> Colour:
    """Return the contribution of a list of lights.

    ``choice`` picks some of them (:class:`reference.rendering.light_choice.LightChoice`); without
    it each is evaluated.
    """
    given = is_delta, scene, si, bsdf, sampler, active, shadows, bsdf_samples
    return _each(lights, *given) if choice is None else _picked(choice, *given)


def sampled(
    lights: Sequence[Any], number: Array, si: Interaction, sample: Array, active: Mask
) -> tuple[Position, Direction, Number, Colour]:
    """Sample the direction to lights by their numbers: point, direction, density and weight.

    Through the emitters' pointers Dr.Jit would trace every live emitter, including the heuristic
    half's.
    """
    return dr.switch(number, [partial(_sampled, light) for light in lights], si, sample, active)


def any_one(
    scene: Scene,
    si: Interaction,
    sample: Array,
    shadows: bool,
    active: Mask,
    choice: Any = None,
) -> tuple[Direction, Number, Mask, Colour]:
    """Sample the direction to one light of the scene: direction, density, whether it is a delta.

    The fourth is the weight. Without a ``choice`` Mitsuba picks the light, usually evenly.
    """
    if choice is None:
        ds, weight = scene.sample_emitter_direction(si, sample, shadows, active)
        return ds.d, ds.pdf, ds.delta, weight
    number, rest, chance = choice.distribution.sample_reuse_pmf(sample.x, active)
    sample = mi.Point2f(rest, sample.y)
    point, direction, found, weight = sampled(choice.lights, number, si, sample, active)
    if shadows:
        weight &= ~scene.ray_test(si.spawn_ray_to(point), active & (found > 0))
    return direction, found * chance, choice.is_delta(number, active), weight / chance


def density(
    scene: Scene, reference: Interaction, ds: Any, active: Mask, choice: Any = None
) -> Number:
    """Return the density of :func:`any_one` for a direction in which a ray hit a light."""
    if choice is None:
        return scene.pdf_emitter_direction(reference, ds, active)
    found = ds.emitter.pdf_direction(reference, ds, active)
    return found * choice.expected(ds.emitter, active) / choice.picks


def _sampled(light, si, sample, active):
    ds, weight = light.sample_direction(si, sample, active)
    return ds.p, ds.d, ds.pdf, weight


def _reflected(scene, si, bsdf, drawn, active, is_delta, shadows, bsdf_samples, expected=1):
    """Return the contribution of a sample of a light.

    If a sample of the BSDF can also find the light, the balance heuristic weights the two.
    ``expected`` is the mean number of samples of the light.
    """
    point, direction, density, weight = drawn
    active = active & (density > 0)
    if shadows:
        active &= ~scene.ray_test(si.spawn_ray_to(point), active)
    wo, context = si.to_local(direction), mi.BSDFContext()
    if is_delta or not bsdf_samples:
        return dr.select(active, bsdf.eval(context, si, wo, active) * weight / expected, 0)
    value, bsdf_density = bsdf.eval_pdf(context, si, wo, active)
    return dr.select(active, value * weight * density / (expected * density + bsdf_density), 0)


@dr.syntax
def _each(lights, is_delta, scene, si, bsdf, sampler, active, shadows, bsdf_samples):
    """Evaluate one light after the other."""
    number = mi.UInt32(0)
    # A sum of thousands would lose terms below its last digit (Neumaier).
    total, lost = mi.Spectrum(0), mi.Spectrum(0)
    while number < len(lights):
        drawn = sampled(lights, number, si, _numbers(sampler, is_delta, active), active)
        given = _reflected(scene, si, bsdf, drawn, active, is_delta, shadows, bsdf_samples)
        total, lost = numerics.add(total, lost, given)
        number += 1
    return numerics.summed(total, lost)


@dr.syntax
def _picked(choice, is_delta, scene, si, bsdf, sampler, active, shadows, bsdf_samples):
    """Evaluate lights picked at random."""
    # One random number for all: stratified, and each single pick has the right distribution.
    start = sampler.next_1d(active)
    number, total = mi.UInt32(0), mi.Spectrum(0)
    while number < choice.picks:
        index, expected = choice.pick((mi.Float(number) + start) / choice.picks, active)
        drawn = sampled(choice.lights, index, si, _numbers(sampler, is_delta, active), active)
        total += _reflected(
            scene, si, bsdf, drawn, active, is_delta, shadows, bsdf_samples, expected
        )
        number += 1
    return total


def _numbers(sampler, is_delta, active):
    return mi.Point2f(0.5) if is_delta else sampler.next_2d(active)
