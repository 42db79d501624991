"""The indirect part of the integrator ``direct_all``, sampled."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import drjit as dr
import mitsuba as mi

from fotismos.heuristic.convention import Colour, Interaction, Mask, Scene
from fotismos.reference.rendering.transport import (
    LightGroups,
    Transport,
    found_by_bsdf,
    power_share,
    sampled,
    spread,
    sums,
    visibility,
)

SURVIVAL = 0.95
"""Largest chance that Russian roulette lets a path continue, as in Mitsuba's ``path``."""


@dr.syntax
def indirect_light(
    scene: Scene,
    sampler: Any,
    si: Interaction,
    bsdf: Any,
    max_depth: int,
    rr_depth: int,
    active: Mask,
    groups: LightGroups,
    transports: Sequence[Transport],
) -> list[Colour]:
    """Estimate the light that has been reflected at least once before it reaches ``si``.

    Paths begin with a sample of the BSDF there. Direct light takes every light in turn; this picks
    one at random at each later vertex, as Mitsuba's ``path`` does everywhere, and one of each group
    of further lights. ``max_depth`` counts like Mitsuba's: 2 is direct light, for which the result
    is 0; -1 means no limit. Beyond ``rr_depth`` Russian roulette may end a path. Each of
    ``transports`` has a result.
    """
    context = mi.BSDFContext()
    limit = mi.UInt32(max_depth if max_depth >= 0 else 0xFFFFFFFF)
    light = [mi.Spectrum(0) for _ in transports]
    # The first direction, from the surface that the camera sees, and how it was drawn.
    bs, throughput = bsdf.sample(
        context, si, sampler.next_1d(active), sampler.next_2d(active), active
    )
    ray = si.spawn_ray(si.to_world(bs.wo))
    depth = mi.UInt32(2)  # of the ray's hit, seen from the camera
    previous = mi.Interaction3f(si)
    previous_pdf = mi.Float(bs.pdf)
    previous_delta = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
    active = mi.Bool(active) & (bs.pdf > 0) & (depth < limit)

    while dr.hint(active, exclude=[groups]):  # an input, not a state of the loop
        si = scene.ray_intersect(ray, active)
        # The first ray's hit shines directly on the surface that it left, which is not indirect.
        emitter = si.emitter(scene, active)
        ds = mi.DirectionSample3f(scene, si, previous)
        is_indirect = active & (depth > 2)
        # Emitter samples never take the direction that a mirror, glass or a mask needs.
        emitter_pdf = scene.pdf_emitter_direction(previous, ds, is_indirect & ~previous_delta)
        share = dr.select(previous_delta, 1, power_share(previous_pdf, emitter_pdf))
        value = throughput * emitter.eval(si, is_indirect) * share
        light = sums(
            light,
            found_by_bsdf(
                is_indirect,
                previous_delta,
                value=value,
                emitter=emitter,
                groups=groups,
                transports=transports,
            ),
        )

        # Paths end where nothing is hit, and at the largest depth.
        active &= si.is_valid() & (depth < limit)
        vertex = si.bsdf(ray)
        smooth = active & mi.has_flag(vertex.flags(), mi.BSDFFlags.Smooth)
        # A sample of one light, picked at random, against one of the BSDF (power heuristic).
        ds, weight = scene.sample_emitter_direction(si, sampler.next_2d(smooth), False, smooth)
        direct = smooth & (ds.pdf > 0)
        value, bsdf_pdf = vertex.eval_pdf(context, si, wo=si.to_local(ds.d), active=direct)
        reached = visibility(scene, si, ds.p, direct, transports)
        # No ray hits a point or a direction, so such a sample counts in full.
        share = dr.select(ds.delta, 1, power_share(ds.pdf, bsdf_pdf))
        value = throughput * value * weight
        light = sums(light, _weighted(reached, value, share, ds.emitter, groups, transports))
        arriving = _of_others(
            scene,
            sampler,
            si=si,
            bsdf=vertex,
            active=smooth,
            groups=groups,
            transports=transports,
        )
        light = sums(light, _times(throughput, arriving))

        # The next direction; its weight is the BSDF times the cosine over the density.
        bs, weight = vertex.sample(
            context, si, sampler.next_1d(active), sampler.next_2d(active), active
        )
        throughput *= weight
        previous = mi.Interaction3f(si)
        previous_pdf = mi.Float(bs.pdf)
        previous_delta = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
        ray = si.spawn_ray(si.to_world(bs.wo))
        depth += 1
        largest = dr.max(throughput)
        # Russian roulette: paths that go on also carry the light of those that end.
        survival = dr.select(depth > rr_depth, dr.minimum(largest, SURVIVAL), 1)
        active &= (largest > 0) & (sampler.next_1d(active) < survival)
        throughput *= dr.rcp(dr.maximum(survival, 1e-6))
    return light


def _weighted(
    reached: Any,
    value: Any,
    share: Any,
    emitter: Any,
    groups: LightGroups,
    transports: Sequence[Transport],
) -> list[Any]:
    """Return the light of a sampled emitter, for each image; samples of the BSDF find the rest."""
    return [
        dr.select(
            seen & groups.holds(transport.group, emitter),
            value * (share if transport.bsdf_samples else 1),
            0,
        )
        for transport, seen in zip(transports, reached, strict=True)
    ]


def _of_others(
    scene: Scene,
    sampler: Any,
    si: Interaction,
    bsdf: Any,
    active: Mask,
    groups: LightGroups,
    transports: Sequence[Transport],
) -> list[Any]:
    """Return the light of lights that are not the scene's, for each image: one of each group."""
    light = [mi.Spectrum(0)] * len(transports)
    for group, others in groups.others.items():
        own = [transport for transport in transports if transport.group == group]
        if not own:
            continue
        targets = [partial(sampled, other) for other in others]
        middle = mi.Point2f(0.5)
        if len(targets) == 1:
            point, towards, density, weight = targets[0](si, middle, active)
        else:
            number = mi.UInt32(sampler.next_1d(active) * len(targets))
            point, towards, density, weight = dr.switch(number, targets, si, middle, active)
        facing = active & (density > 0)
        value = bsdf.eval(mi.BSDFContext(), si, si.to_local(towards), facing)
        value = value * weight * len(targets)
        reached = visibility(scene, si, point, facing, own)
        arriving = [dr.select(seen, value, 0) for seen in reached]
        light = sums(light, spread(transports, own, arriving))
    return light


def _times(factor: Any, colours: Sequence[Any]) -> list[Any]:
    return [factor * colour for colour in colours]
