"""The integrator plugin ``direct_all``: direct light from every emitter at every sample.

Indirect light is added where it is asked for.

Mitsuba's ``direct`` picks one emitter at random for each sample, so that two point lights already
make noise. This one asks each emitter in turn: point, spot and directional lights, which need no
random number, are then exact at each camera ray, and only what has an extent is sampled, by emitter
and by BSDF, with the balance heuristic. BSDFs, emitters and visibility are Mitsuba's.

==================  ==================  ===========================================================
Parameter           Type (default)      Meaning
==================  ==================  ===========================================================
``hide_emitters``   boolean (false)     as of Mitsuba's ``direct``
``shadows``         boolean (true)      trace shadow rays; off where nothing can be hidden, or
                                        where shadows are to be missing
``bsdf_samples``    integer (1)         samples of the BSDF that look for lights, 0 or 1. Such a
                                        ray meets what hides a light: without shadows, 0 where
                                        something does. Mirrors and glass take theirs all the same,
                                        since nothing else finds a light in them
``max_depth``       integer (2)         as of Mitsuba's ``path``: more than 2, or -1 for no limit,
                                        adds indirect light (:mod:`reference.rendering.indirect`)
==================  ==================  ===========================================================
"""

import drjit as dr
import mitsuba as mi

from reference.rendering.indirect import indirect_light

_registered = set()


def register():
    """Make the plugin known to Mitsuba, for the current variant. Calling it again does nothing."""
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
            self.environment_albedo = None
            """An `AlbedoTable` in place of sampling the environment,
            for a scene of one BSDF that nothing hides from it; set after construction."""

        def sample(self, scene, sampler, ray, medium=None, active=True):
            si = self._first_surface(scene, ray, active)
            seen = active & (si.is_valid() | (not self.hide_emitters))
            colour = dr.select(seen, si.emitter(scene).eval(si, seen), 0)
            hit = active & si.is_valid()
            context = mi.BSDFContext()
            bsdf = si.bsdf(ray)
            extended = []
            for emitter in scene.emitters():
                if mi.has_flag(emitter.flags(), mi.EmitterFlags.Delta):
                    colour += self._from_emitter(
                        scene, si, bsdf, context, emitter, mi.Point2f(0.5), hit
                    )
                elif emitter.is_environment() and self.environment_albedo is not None:
                    albedo = self.environment_albedo.at(si.wi.z)
                    colour += dr.select(hit, albedo * emitter.eval(si, hit), 0)
                else:
                    extended.append(emitter)
            for emitter in extended:
                colour += self._from_emitter(
                    scene, si, bsdf, context, emitter, sampler.next_2d(hit), hit
                )
            if extended and (self.bsdf_samples or _has_delta(scene)):
                colour += _from_bsdf(scene, si, bsdf, context, sampler, hit, self.bsdf_samples)
            if self.max_depth != 2:
                colour += indirect_light(
                    scene, sampler, si, bsdf, self.max_depth, hit, self.shadows, self.bsdf_samples
                )
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

        def _from_emitter(self, scene, si, bsdf, context, emitter, sample, active):
            """One sample of an emitter, weighted against sampling the BSDF if that can find it."""
            ds, weight = emitter.sample_direction(si, sample, active)
            active = active & (ds.pdf > 0)
            if self.shadows:
                active &= ~scene.ray_test(si.spawn_ray_to(ds.p), active)
            wo = si.to_local(ds.d)
            if mi.has_flag(emitter.flags(), mi.EmitterFlags.Delta) or not self.bsdf_samples:
                return dr.select(active, bsdf.eval(context, si, wo, active) * weight, 0)
            value, bsdf_pdf = bsdf.eval_pdf(context, si, wo, active)
            return dr.select(active, value * weight * ds.pdf / (ds.pdf + bsdf_pdf), 0)

        def to_string(self):
            return f"DirectAllIntegrator[hide_emitters = {self.hide_emitters}]"

    mi.register_integrator("direct_all", DirectAllIntegrator)


def _has_delta(scene):
    """Tell whether a BSDF of the scene reflects or transmits in single directions."""
    bsdfs = (shape.bsdf() for shape in scene.shapes())
    return any(bsdf and mi.has_flag(bsdf.flags(), mi.BSDFFlags.Delta) for bsdf in bsdfs)


def _from_bsdf(scene, si, bsdf, context, sampler, active, bsdf_samples):
    """One sample of the BSDF, for the emitter that it happens to meet.

    Without ``bsdf_samples`` only directions count that no sample of an emitter takes.
    """
    bs, weight = bsdf.sample(context, si, sampler.next_1d(active), sampler.next_2d(active), active)
    active = active & (bs.pdf > 0)
    hit = scene.ray_intersect(si.spawn_ray(si.to_world(bs.wo)), active)
    emitter = hit.emitter(scene, active)
    ds = mi.DirectionSample3f(scene, hit, si)
    ds.emitter = emitter
    emitter_pdf = emitter.pdf_direction(si, ds, active)
    is_delta = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
    active &= is_delta | (bsdf_samples > 0)
    share = dr.select(is_delta, 1, bs.pdf / (bs.pdf + emitter_pdf))
    return dr.select(active, weight * emitter.eval(hit, active) * share, 0)
