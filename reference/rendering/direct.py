"""The integrator plugin ``direct_all``: direct light from every emitter at every sample.

Indirect light is added if requested.

Mitsuba's ``direct`` picks one emitter at random for each sample, so even two point lights make
noise. This one evaluates each emitter in turn: point, spot and directional lights, which need no
random number, are then exact at each camera ray, and only lights with an extent are sampled, by
emitter and by BSDF, with the balance heuristic. From thousands of lights it can pick some, in
proportion to their contribution. BSDFs, emitters and visibility are Mitsuba's.

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
``light_samples``   integer (0)         lights picked at random for each sample, of points
                                        and directions and of the others, if there are more, and
                                        more than 16 (:mod:`reference.rendering.light_choice`); 0
                                        evaluates each
``max_depth``       integer (2)         as in Mitsuba's ``path``: more than 2, or -1 for no limit,
                                        adds indirect light (:func:`indirect_light`)
==================  ==================  ===========================================================
"""

from operator import is_
from typing import Any

import drjit as dr
import mitsuba as mi

from heuristic.arrays import Colour, Interaction, Mask, Scene
from reference.rendering import light_sums
from reference.rendering.light_choice import LightChoice

_registered: set[str] = set()


def register() -> None:
    """Register the plugin with Mitsuba for the current variant. Calling it again does nothing."""
    if mi.variant() not in _registered:
        _define()
        _registered.add(mi.variant())


def _define():
    class DirectAllIntegrator(mi.SamplingIntegrator):
        """See the module's docstring."""

        def __init__(self, props):
            super().__init__(props)
            self.shadows = props.get("shadows", True)
            self.bsdf_samples = props.get("bsdf_samples", 1)
            self.max_depth = props.get("max_depth", 2)
            self.light_samples = props.get("light_samples", 0)
            self._choices = {}
            self.environment_albedo = None
            """An `AlbedoTable` to replace sampling of the environment, for a scene with one BSDF
            and nothing that hides it; set after construction."""

        def prepare(self, scene):
            """Find the probabilities of lights; otherwise the first sample does."""
            delta, others = _parted(scene.emitters())
            for lights in (delta, [e for e in others if not self._is_tabulated(e)]):
                self._choice(scene, lights)
            if self.max_depth != 2:
                self._choice(scene, scene.emitters(), 1)

        def sample(self, scene, sampler, ray, medium=None, active=True):
            delta, others = _parted(scene.emitters())
            si = self._first_surface(scene, ray, active)
            colour = mi.Spectrum(0)
            if others or len(delta) <= light_sums.UNROLLED:  # rays never hit points or directions
                seen = active & (si.is_valid() | (not self.hide_emitters))
                colour = dr.select(seen, si.emitter(scene).eval(si, seen), 0)
            hit = active & si.is_valid()
            bsdf = si.bsdf(ray)
            given = scene, si, bsdf, sampler, hit, self.shadows, self.bsdf_samples
            extended = [e for e in others if not self._is_tabulated(e)]
            if len(delta) > light_sums.UNROLLED:
                colour += light_sums.of_many(delta, True, *given, self._choice(scene, delta))
            for emitter in scene.emitters() if len(delta) <= light_sums.UNROLLED else others:
                if _is_delta(emitter):
                    colour += light_sums.of_one(emitter, True, *given)
                elif self._is_tabulated(emitter):
                    albedo = self.environment_albedo.at(si.wi.z)
                    colour += dr.select(hit, albedo * emitter.eval(si, hit), 0)
            choice = self._choice(scene, extended)
            if len(extended) > light_sums.UNROLLED:
                colour += light_sums.of_many(extended, False, *given, choice)
            else:
                for emitter in extended:
                    colour += light_sums.of_one(emitter, False, *given)
            if extended and (self.bsdf_samples or _has_delta(scene)):
                colour += _from_bsdf(scene, si, bsdf, sampler, hit, self.bsdf_samples, choice)
            if self.max_depth != 2:
                parameters = self.max_depth, hit, self.shadows, self.bsdf_samples
                choice = self._choice(scene, scene.emitters(), 1)
                colour += indirect_light(scene, sampler, si, bsdf, *parameters, choice)
            environment = scene.environment() is not None and not self.hide_emitters
            return colour, active if environment else hit, []

        def _first_surface(self, scene, ray, active):
            pi = scene.ray_intersect_preliminary(ray, coherent=True, active=active)
            if self.hide_emitters:
                skip = active & pi.is_valid() & (pi.shape.emitter() != None)  # noqa: E711 lane-wise
                si = pi.compute_surface_interaction(ray, mi.RayFlags.Minimal, skip)
                beyond = self.skip_area_emitters(scene, si.spawn_ray(ray.d), True, skip)
                pi[skip] = beyond
            return pi.compute_surface_interaction(ray, mi.RayFlags.All, active)

        def _is_tabulated(self, emitter):
            return self.environment_albedo is not None and emitter.is_environment()

        def _choice(self, scene, lights, picks=None):
            """Return the choice among the lights of a list, None if each is evaluated."""
            most = max(self.light_samples, light_sums.UNROLLED)
            if not self.light_samples or len(lights) <= most:
                return None
            key = picks, len(lights), _is_delta(lights[0])
            known = self._choices.get(key)
            if known is None or not all(map(is_, known.lights, lights)):
                known = LightChoice(scene, lights, picks or self.light_samples)
                self._choices[key] = known
            return known

        def to_string(self):
            return f"DirectAllIntegrator[hide_emitters = {self.hide_emitters}]"

    mi.register_integrator("direct_all", DirectAllIntegrator)


def _is_delta(emitter):
    return mi.has_flag(emitter.flags(), mi.EmitterFlags.Delta)


def _parted(emitters):
    """Return the points and directions, and the other emitters."""
    delta = [emitter for emitter in emitters if _is_delta(emitter)]
    return delta, [emitter for emitter in emitters if not _is_delta(emitter)]


def _has_delta(scene):
    """Return whether a BSDF of the scene reflects or transmits in single directions."""
    bsdfs = (shape.bsdf() for shape in scene.shapes())
    return any(bsdf and mi.has_flag(bsdf.flags(), mi.BSDFFlags.Delta) for bsdf in bsdfs)


def _from_bsdf(scene, si, bsdf, sampler, active, bsdf_samples, choice):
    """One sample of the BSDF, for the emitter that it happens to hit.

    Without ``bsdf_samples`` only directions that emitter sampling never takes count.
    """
    context = mi.BSDFContext()
    bs, weight = bsdf.sample(context, si, sampler.next_1d(active), sampler.next_2d(active), active)
    active = active & (bs.pdf > 0)
    hit = scene.ray_intersect(si.spawn_ray(si.to_world(bs.wo)), active)
    emitter = hit.emitter(scene, active)
    ds = mi.DirectionSample3f(scene, hit, si)
    ds.emitter = emitter
    emitter_pdf = emitter.pdf_direction(si, ds, active)
    if choice is not None:
        emitter_pdf *= choice.expected(emitter, active)
    is_delta = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
    active &= is_delta | (bsdf_samples > 0)
    share = dr.select(is_delta, 1, bs.pdf / (bs.pdf + emitter_pdf))
    return dr.select(active, weight * emitter.eval(hit, active) * share, 0)


RR_DEPTH = 3
"""Ending paths two reflections sooner than Mitsuba's 5 saves a sixth of the time and adds a tenth
of the variance, on the Cornell box and on glossy spheres alike; the mean stays the same."""

SURVIVAL = 0.95
"""Largest chance that Russian roulette lets a path continue, as in Mitsuba's ``path``."""


@dr.syntax
def indirect_light(
    scene: Scene,
    sampler: Any,
    si: Interaction,
    bsdf: Any,
    max_depth: int,
    active: Mask,
    shadows: bool = True,
    bsdf_samples: int = 1,
    choice: LightChoice | None = None,
) -> Colour:
    """Estimate the light that has been reflected at least once before it reaches ``si``.

    Paths begin with a sample of the BSDF there. Direct light takes every light in turn; this picks
    one at random at each later vertex, as Mitsuba's ``path`` does everywhere, or by a choice.

    Parameters
    ----------
    scene, sampler, si, bsdf, active
        Same as in Mitsuba's integrators.
    max_depth
        As Mitsuba counts: 2 is direct light, for which the result is 0; -1 is no limit.
    shadows, bsdf_samples
        Parameters of the integrator, at every later vertex too.
    choice
        :class:`reference.rendering.light_choice.LightChoice` of one pick among all emitters.

    Returns
    -------
    mitsuba.Spectrum
    """
    context = mi.BSDFContext()
    limit = mi.UInt32(max_depth if max_depth >= 0 else 0xFFFFFFFF)
    light = mi.Spectrum(0)
    bs, throughput = bsdf.sample(
        context, si, sampler.next_1d(active), sampler.next_2d(active), active
    )
    ray = si.spawn_ray(si.to_world(bs.wo))
    depth = mi.UInt32(2)  # of the ray's hit, seen from the camera
    previous = mi.Interaction3f(si)
    previous_pdf = mi.Float(bs.pdf)
    previous_delta = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
    active = mi.Bool(active) & (bs.pdf > 0) & (depth < limit)

    while active:
        si = scene.ray_intersect(ray, active)
        # The first ray's hit shines directly on the surface that it left, which is not ours.
        emitter = si.emitter(scene, active)
        ds = mi.DirectionSample3f(scene, si, previous)
        seen = active & (depth > 2) & (previous_delta | (bsdf_samples > 0))
        # Emitter samples never take the direction that a mirror, glass or a mask needs.
        emitter_pdf = light_sums.density(scene, previous, ds, seen & ~previous_delta, choice)
        share = dr.select(previous_delta, 1, previous_pdf / (previous_pdf + emitter_pdf))
        light += dr.select(seen, throughput * emitter.eval(si, seen) * share, 0)

        active &= si.is_valid() & (depth < limit)
        vertex = si.bsdf(ray)
        direct = active & mi.has_flag(vertex.flags(), mi.BSDFFlags.Smooth)
        sample = sampler.next_2d(direct)
        direction, emitter_pdf, is_delta, weight = light_sums.any_one(
            scene, si, sample, shadows, direct, choice
        )
        direct &= emitter_pdf > 0
        wo = si.to_local(direction)
        value, bsdf_pdf = vertex.eval_pdf(context, si, wo, direct)
        share = emitter_pdf / (emitter_pdf + bsdf_pdf)
        share = dr.select(is_delta | (bsdf_samples == 0), 1, share)
        light += dr.select(direct, throughput * value * weight * share, 0)

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
        survival = dr.select(depth > RR_DEPTH, dr.minimum(largest, SURVIVAL), 1)
        active &= (largest > 0) & (sampler.next_1d(active) < survival)
        throughput *= dr.rcp(dr.maximum(survival, 1e-6))
    return light
