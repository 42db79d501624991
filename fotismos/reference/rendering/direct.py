"""The integrator plugin ``direct_all``: direct light from every emitter at every sample.

Indirect light is added if requested.

Mitsuba's ``direct`` picks one emitter at random for each sample, so even two point lights make
noise. This one evaluates each in turn: lights at a point or in a direction are exact at each camera
ray, and only lights with an extent are sampled, by emitter and by BSDF, with the power heuristic.

More than :data:`UNROLLED` lights become the targets of one call in a loop. Dr.Jit merges targets
with the same code: the kernel grows with the kinds of lights, not with their number.

==================  ==================  ===========================================================
Parameter           Type (default)      Meaning
==================  ==================  ===========================================================
``hide_emitters``   boolean (false)     as in Mitsuba's ``direct``
``shadows``         boolean (true)      trace shadow rays; off if nothing can be hidden, or
                                        to leave shadows out
``bsdf_samples``    integer (1)         samples of the BSDF that look for lights, 0 or 1. Such a
                                        ray hits what hides a light: without shadows, 0 if something
                                        does. Mirrors and glass still take theirs, since nothing
                                        else finds a light in them
``max_depth``       integer (2)         as in Mitsuba's ``path``: 1 is only what shines by itself;
                                        more than 2, or -1 for no limit, adds indirect light
                                        (:mod:`fotismos.reference.rendering.indirect`)
``looks_through``   boolean (false)     at a ``max_depth`` of 1 and 2, add the light of what lies
                                        straight behind surfaces with a null component, such as
                                        masks: as in the textbook half, no bounce is counted there
==================  ==================  ===========================================================

One rendering can make several images, which share camera rays, paths and kernel: those of
``transports``, set after construction, with the ``groups`` of lights that they hold. All but the
first are AOVs, without the camera's weight.
"""

from collections.abc import Callable, Sequence
from functools import cache, partial, reduce
from typing import Any

import drjit as dr
import mitsuba as mi

from fotismos.heuristic import numerics
from fotismos.heuristic.convention import Colour, Mask, Scene
from fotismos.heuristic.plugins.integrator import LAYERS
from fotismos.reference.records import RR_DEPTH
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

UNROLLED = 16
"""Lights of a kind that have their own code."""


def register() -> None:
    """Register the plugin with Mitsuba for the current variant. Calling it again does nothing."""
    _define(mi.variant())


@cache
def _define(_variant: str) -> None:
    class DirectAllIntegrator(mi.SamplingIntegrator):
        """See the module's docstring."""

        def __init__(self, props: Any) -> None:
            super().__init__(props)
            defaults = Transport()
            self.transports = (
                Transport(
                    shadows=props.get("shadows", defaults.shadows),
                    bsdf_samples=props.get("bsdf_samples", defaults.bsdf_samples),
                    max_depth=props.get("max_depth", defaults.max_depth),
                ),
            )
            self.groups: Any = None
            """A `LightGroups`; if omitted, all lights are in group 0."""
            self.looks_through = props.get("looks_through", False)
            self.environment_albedo = None
            """An `AlbedoTable` (:mod:`fotismos.reference.pairing.probe`) in place of samples of the
            environment, for one BSDF and nothing that hides it; set after construction."""

        def sample(
            self, scene: Scene, sampler: Any, ray: Any, medium: Any = None, active: Mask = True
        ) -> tuple[Colour, Mask, list[Any]]:
            groups = self.groups or LightGroups(scene, [0] * len(scene.emitters()))
            # Lights at points and in directions are exact, the others are sampled.
            delta: list[tuple[Any, int]] = []
            others: list[tuple[Any, int]] = []
            lamps = []
            for emitter, group in groups.members(scene):
                is_delta = mi.has_flag(emitter.flags(), mi.EmitterFlags.Delta)
                (delta if is_delta else others).append((emitter, group))
                if mi.has_flag(emitter.flags(), mi.EmitterFlags.Surface):
                    lamps.append(emitter)
            # The surface that the camera sees, and the light that comes from it directly.
            if self.hide_emitters and lamps:
                si = _beyond_lamps(scene, mi.Ray3f(ray), mi.Bool(active))
            else:
                si = scene.ray_intersect(ray, mi.RayFlags.All, True, active)
            looks_through = self.looks_through and _has(mi.BSDFFlags.Null, scene)
            emitter = si.emitter(scene)
            colour = mi.Spectrum(0)
            if others or len(delta) <= UNROLLED:  # rays never hit points or directions
                is_shown = active & (si.is_valid() | (not self.hide_emitters))
                colour = dr.select(is_shown, emitter.eval(si, is_shown), 0)
            hit = active & si.is_valid()
            # The mask of valid samples becomes alpha: a visible environment fills the picture.
            environment = scene.environment() is not None and not self.hide_emitters
            valid = active if environment else hit
            if self.transports[0].max_depth == 1:
                if looks_through:

                    def shining(si: Any, sampler: Any, active: Mask) -> list[Colour]:
                        return [dr.select(active, si.emitter(scene).eval(si, active), 0)]

                    (behind,) = _behind(
                        scene,
                        mi.Ray3f(ray),
                        si,
                        sampler=sampler,
                        active=hit,
                        light=shining,
                        nothing=[mi.Spectrum(0)],
                    )
                    colour += behind
                return colour, valid, []
            bsdf = si.bsdf(ray)
            seen = {
                "scene": scene,
                "si": si,
                "bsdf": bsdf,
                "sampler": sampler,
                "active": hit,
            }
            # Each image begins with what the camera sees, and the exact lights.
            colours = [
                mi.Spectrum(dr.select(groups.holds(transport.group, emitter), colour, 0))
                for transport in self.transports
            ]
            # The environment from a table, if there is one; the other lights are sampled.
            extended = []
            for light, group in others:
                if self.environment_albedo is not None and light.is_environment():
                    albedo = self.environment_albedo.at(si.wi.z)
                    reflected = dr.select(hit, albedo * light.eval(si, hit), 0)
                    own = [each for each in self.transports if each.group == group]
                    colours = sums(colours, spread(self.transports, own, [reflected] * len(own)))
                else:
                    extended.append((light, group))
            transports = self.transports
            colours = sums(colours, _of_all(delta, True, transports=transports, **seen))
            deep = [transport for transport in transports if transport.max_depth != 2]
            if deep:  # first, so that paths have the same random numbers whatever lights there are
                # Loaded late: most plans have direct light alone.
                from fotismos.reference.rendering.indirect import indirect_light

                (max_depth,) = {transport.max_depth for transport in deep}
                indirect = indirect_light(
                    scene,
                    sampler,
                    si=si,
                    bsdf=bsdf,
                    max_depth=max_depth,
                    rr_depth=RR_DEPTH,
                    active=hit,
                    groups=groups,
                    transports=deep,
                )
                colours = sums(colours, spread(transports, deep, indirect))
            looks = any(transport.bsdf_samples for transport in transports)
            takes_samples = extended and (looks or _has(mi.BSDFFlags.Delta, scene))

            def with_lamps(colours: list[Colour], **there: Any) -> list[Colour]:
                """Add lights with an extent: a sample of each, and one of the BSDF for all."""
                colours = sums(colours, _of_all(extended, False, **there))
                return (
                    sums(colours, _from_bsdf(groups=groups, **there)) if takes_samples else colours
                )

            colours = with_lamps(colours, transports=transports, **seen)
            shallow = [transport for transport in transports if transport.max_depth == 2]
            if looks_through and shallow:

                def direct(si: Any, sampler: Any, active: Mask) -> list[Colour]:
                    there = {
                        "scene": scene,
                        "si": si,
                        "bsdf": si.bsdf(),
                        "sampler": sampler,
                        "active": active & si.is_valid(),
                        "transports": shallow,
                    }
                    return with_lamps(_of_all(delta, True, **there), **there)

                behind = _behind(
                    scene,
                    mi.Ray3f(ray),
                    si,
                    sampler=sampler,
                    active=hit,
                    light=direct,
                    nothing=[mi.Spectrum(0)] * len(shallow),
                )
                colours = sums(colours, spread(transports, shallow, behind))
            return colours[0], valid, [channel for image in colours[1:] for channel in image]

        def aov_names(self) -> list[str]:
            channels = range(len(mi.Spectrum(0)))
            return [
                f"{i}.{channel}" for i in range(1, len(self.transports)) for channel in channels
            ]

        def to_string(self) -> str:
            return f"DirectAllIntegrator[hide_emitters = {self.hide_emitters}]"

    mi.register_integrator("direct_all", DirectAllIntegrator)


@dr.syntax
def _beyond_lamps(scene: Any, ray: Any, active: Any) -> Any:
    """Return the first surface that does not shine.

    Mitsuba's own integrators take the point of the last hit from the first ray: its origin differs,
    so on spheres, disks and cylinders they find another point.
    """
    si = scene.ray_intersect(ray, mi.RayFlags.All, True, active)
    skip = active & si.is_valid() & (si.shape.emitter() != None)  # noqa: E711  lane-wise
    while skip:
        ray[skip] = si.spawn_ray(ray.d)
        si[skip] = scene.ray_intersect(ray, mi.RayFlags.All, False, skip)
        skip &= si.is_valid() & (si.shape.emitter() != None)  # noqa: E711  lane-wise
    return si


@dr.syntax
def is_behind_two_lamps(scene: Any, ray: Any) -> Any:
    """Return whether rays reach a shape that is not a mesh through two or more shining surfaces."""
    si = scene.ray_intersect(ray)
    count = dr.zeros(mi.UInt32, dr.width(ray.d))
    skip = si.is_valid() & (si.shape.emitter() != None)  # noqa: E711  lane-wise
    while skip:
        count[skip] = count + 1
        ray[skip] = si.spawn_ray(ray.d)
        si[skip] = scene.ray_intersect(ray, mi.RayFlags.All, False, skip)
        skip &= si.is_valid() & (si.shape.emitter() != None)  # noqa: E711  lane-wise
    return si.is_valid() & (count > 1) & ~si.shape.is_mesh()


@dr.syntax
def _behind(
    scene: Any,
    ray: Any,
    si: Any,
    sampler: Any,
    active: Any,
    light: Callable[[Any, Any, Mask], list[Colour]],
    nothing: list[Colour],
) -> list[Colour]:
    """Return the light of what lies straight behind what a ray hits, for each image.

    ``sum_(j > 1) L_j prod_(i < j) T_i`` over the surfaces 1, 2, … along the ray, ``T`` their null
    transmittances, as the textbook half adds them. ``light(si, sampler, active)`` gives ``L`` of
    all images; light that a surface's own samples find behind it is in its ``L``. The sampler is an
    argument since it changes in the loop.
    """
    total = nothing
    throughput = mi.Spectrum(1)
    layer = mi.UInt32(1)
    while active & (layer < LAYERS):
        throughput *= si.bsdf().eval_null_transmission(si, active)
        active &= dr.max(throughput) > 0
        ray = si.spawn_ray(ray.d)
        si = scene.ray_intersect(ray, active)
        # Beyond the last surface, the background shines.
        seen = light(si, sampler, active)
        total = sums(total, [throughput * one for one in seen])
        active &= si.is_valid()
        layer += 1
    return total


def _has(flag: Any, scene: Any) -> bool:
    bsdfs = (shape.bsdf() for shape in scene.shapes())
    return any(bsdf and mi.has_flag(bsdf.flags(), flag) for bsdf in bsdfs)


def _of_all(
    lights: Sequence[tuple[Any, int]], is_delta: bool, transports: Sequence[Transport], **there: Any
) -> list[Any]:
    """Return the light of lights, each with its group, in each image."""
    colours = [mi.Spectrum(0)] * len(transports)
    for group in dict.fromkeys(group for _, group in lights):
        members = [light for light, number in lights if number == group]
        own = [transport for transport in transports if transport.group == group]
        if own:
            light = _of_group(members, is_delta, transports=own, **there)
            colours = sums(colours, spread(transports, own, light))
    return colours


def _of_group(
    lights: Sequence[Any],
    is_delta: bool,
    scene: Any,
    si: Any,
    bsdf: Any,
    sampler: Any,
    active: Any,
    transports: Sequence[Transport],
) -> list[Any]:
    """Return the contribution of lights to each image; points and directions are not random."""
    is_weighted = not is_delta and any(transport.bsdf_samples for transport in transports)

    def of_light(sample_direction: Any, sampler: Any) -> Any:
        sample = mi.Point2f(0.5) if is_delta else sampler.next_2d(active)
        # A point of the light; the density is over solid angle, 0 where no light arrives.
        point, direction, density, weight = sample_direction(si, sample, active)
        facing = active & (density > 0)
        reached = visibility(scene, si, point, facing, transports)
        wo = si.to_local(direction)
        context = mi.BSDFContext()
        # Images that differ in shadows need the BSDF at hidden points too.
        is_mixed = len({transport.shadows for transport in transports}) > 1
        evaluated = facing if is_mixed else reached[0]
        if is_weighted:
            value, bsdf_density = bsdf.eval_pdf(context, si, wo=wo, active=evaluated)
        else:
            value = bsdf.eval(context, si, wo, evaluated)
        colours = []
        for transport, visible in zip(transports, reached, strict=True):
            term = value * weight
            if is_weighted and transport.bsdf_samples:
                # A sample of the BSDF can also find the light.
                term = term * power_share(density, bsdf_density)
            colours.append(dr.select(visible, term, 0))
        return colours

    targets = [partial(sampled, light) for light in lights]
    nothing = [mi.Spectrum(0)] * len(transports)
    if len(lights) > UNROLLED:
        looped: list[Colour] = _looped(targets, of_light, sampler=sampler, nothing=nothing)
        return looped
    return reduce(sums, (of_light(target, sampler) for target in targets), nothing)


@dr.syntax
def _looped(
    targets: Sequence[Callable[..., Any]],
    of_light: Callable[..., list[Colour]],
    sampler: Any,
    nothing: list[Colour],
) -> list[Colour]:
    """Sum over lights in a loop, for each image.

    Through the emitters' pointers Dr.Jit would trace every live emitter, including the heuristic
    half's. The sampler is an argument since it changes in the loop.
    """
    number = mi.UInt32(0)
    # A sum of thousands would lose terms below its last digit (Neumaier).
    total = list(zip(nothing, nothing, strict=True))
    while number < len(targets):
        total = _added(total, of_light(partial(dr.switch, number, targets), sampler))
        number += 1
    return [numerics.summed(colour) for colour in total]


def _added(totals: list[Any], terms: list[Any]) -> list[Any]:
    return [numerics.add(total, term) for total, term in zip(totals, terms, strict=True)]


def _from_bsdf(
    scene: Any,
    si: Any,
    bsdf: Any,
    sampler: Any,
    active: Any,
    groups: LightGroups,
    transports: Sequence[Transport],
) -> list[Any]:
    """One sample of the BSDF, for the emitter that it happens to hit, for each image.

    Without ``bsdf_samples`` only directions that emitter sampling never takes count.
    """
    context = mi.BSDFContext()
    bs, weight = bsdf.sample(context, si, sampler.next_1d(active), sampler.next_2d(active), active)
    active = active & (bs.pdf > 0)
    # What lies in that direction, and how likely a sample of that light is to take it.
    # Every light is sampled, so no chance of picking it enters.
    hit = scene.ray_intersect(si.spawn_ray(si.to_world(bs.wo)), active)
    emitter = hit.emitter(scene, active)
    ds = mi.DirectionSample3f(scene, hit, si)
    ds.emitter = emitter
    emitter_pdf = emitter.pdf_direction(si, ds, active)
    is_delta = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
    if not any(transport.bsdf_samples for transport in transports):
        active &= is_delta
    # A delta direction has no rival.
    share = dr.select(is_delta, 1, power_share(bs.pdf, emitter_pdf))
    value = weight * emitter.eval(hit, active) * share
    return found_by_bsdf(
        active, is_delta, value=value, emitter=emitter, groups=groups, transports=transports
    )
