"""The integrator plugin ``heuristic``: shading at the first surface that a camera ray hits.

==================  ==================  ===========================================================
Parameter           Type (default)      Meaning
==================  ==================  ===========================================================
``model``           string (phong)      name of the heuristic that shades
                                        (:mod:`heuristic.heuristics`)
``ambient``         spectrum (0)        ``I_a`` of 8.2
``interpolation``   string (phong)      ``phong`` shades every point, with the normal that Mitsuba
                                        interpolates; ``gouraud`` the vertices and ``flat`` the
                                        faces of meshes
``occlusion``       boolean (false)     hide lights behind surfaces by shadow rays, which the
                                        chapters' model does not
``prune``           boolean (true)      trace only the terms that some material of the scene has
``hide_emitters``   boolean (false)     show black instead of the environment where a ray
                                        hits nothing
==================  ==================  ===========================================================

The parameters that the heuristic declares are additional floats.

It works on scenes whose BSDFs are ``phong`` and whose lights are ``heuristic_*`` plugins; an
environment emitter is background only. Films, samplers, cameras, filters and AOVs are Mitsuba's.
The camera ray is drawn from the sampler first, as in ``direct`` and ``path``, so equal seeds give
equal rays. Python::

    {'type': 'heuristic', 'ambient': 1.0}
"""

from dataclasses import dataclass
from operator import is_
from time import perf_counter
from typing import Any

import drjit as dr
import mitsuba as mi

from heuristic import heuristics
from heuristic.convention import Position
from heuristic.errors import InputError
from heuristic.interpolation import (
    Interpolation,
    MeshCorners,
    shade_mesh,
    shading_points,
    stored_shade,
)
from heuristic.plugins.emitters import FAR
from heuristic.plugins.phong import SceneMaterials
from heuristic.plugins.textures import emitted, may_be_nonzero
from heuristic.points import ShadingArguments

LAYERS = 64
"""Surfaces that a camera ray passes at most: a bound for stacks of empty ones."""


@dataclass
class _Known:
    """What a rendering needs to know about a scene, and the scene's parts.

    ``prepared`` is the heuristic's preparation with ``values`` of its parameters, None if it has
    none; ``seconds`` is the time that it took.
    """

    parts: list[mi.Object]
    values: dict[str, float]
    materials: SceneMaterials
    prepared: object
    seconds: float

    def is_of(self, parts: list[mi.Object], values: dict[str, float]) -> bool:
        """Return whether the scene has these parts and was prepared with these values."""
        is_same = len(parts) == len(self.parts) and all(map(is_, parts, self.parts))
        return is_same and values == self.values


def define() -> None:
    """Create the classes for the current variant and register them under one name."""

    class HeuristicIntegrator(mi.SamplingIntegrator):
        """See the module's docstring."""

        def __init__(self, props):
            super().__init__(props)
            self.ambient = emitted(props, "ambient", 0.0)
            self.model = heuristics.named(props.get("model", heuristics.PHONG.name))
            self.parameters = {
                known.name: mi.Float(known.checked(props.get(known.name, known.default)))
                for known in self.model.parameters
            }
            self.parameters_changed()
            self._known = None
            self.occlusion = props.get("occlusion", False) or "visible" in self.model.needs
            # A user's heuristic gets only arrays: a plain 0 has no components.
            self.prune = props.get("prune", True) and self.model.is_own
            self.interpolation = _interpolation(props)

        def sample(self, scene, sampler, ray, medium=None, active=True):
            materials = self.known(scene).materials  # a symbolic loop could not make them
            if any(bsdf.is_clear for bsdf in materials.bsdfs):
                recorded = self.model.traced and dr.flag(dr.JitFlag.SymbolicLoops)
                with dr.scoped_set_flag(dr.JitFlag.SymbolicLoops, recorded):
                    colour, hit = _through_layers(self, scene, mi.Ray3f(ray), mi.Bool(active))
            else:
                colour, hit, _ = self.layer(scene, ray, active)
            sees_all = scene.environment() is not None and not self.hide_emitters
            return colour, active if sees_all else hit, []

        def layer(self, scene, ray, active):
            """Return the value where a ray first hits, or else the background; and the hit."""
            si = scene.ray_intersect(ray, active)
            hit = active & si.is_valid()
            colour = self.surface_colour(scene, si, mi.Vector3f(-ray.d), hit)
            environment = scene.environment()
            if environment is not None and not self.hide_emitters:
                colour += dr.select(active & ~hit, environment.eval(si, active & ~hit), 0)
            return colour, hit, si

        def surface_colour(self, scene, si, view, active):
            """Return the value seen where a ray hits, with the normal of 6.37 and 6.38."""
            normal, is_shaded = self.seen_side(scene, si, active)
            colour = self.shaded(scene, si, view, normal, active)
            return dr.select(active & is_shaded, colour, 0)

        def seen_side(self, scene, si, active):
            """Return the normal of the side that is seen, and whether that side is shaded."""
            twosided = self.twosided(scene, si, active)
            normal = self.known(scene).materials.normal(si, active)
            if twosided is not False:
                normal = dr.select(twosided & (si.wi.z < 0), -normal, normal)
            return normal, twosided | (si.wi.z > 0)

        def shaded(self, scene, si, view, normal, active):
            """Shade at a surface interaction, whose material is one of several."""
            model = self.model_at(scene, si)
            lights = self.lights(scene, si, active)
            ambient = self.ambient_at(si, active)
            visible = self.visibility(scene, si, active)
            colour = mi.Spectrum(0)
            for material, is_here in self.known(scene).materials.at(si, active):
                value = model(si.p, normal, view, material, lights, ambient, visible)
                colour += dr.select(is_here, value, 0)
            return colour

        def model_at(self, scene, si):
            """Return the heuristic as a function of the arguments of :func:`heuristic.shade`."""
            prepared = self.known(scene).prepared
            return lambda *given: self.model.evaluate(
                ShadingArguments(*given), si.uv, self.parameters, prepared, si.wavelengths
            )

        def known(self, scene):
            """Return the :class:`_Known` of a scene, made once for everything traced of it."""
            # Its parts identify a scene: holding the scene would be a cycle, never freed.
            parts = [*scene.shapes(), *scene.emitters(), *scene.sensors()]
            values = self._prepared_with
            if self._known is None or not self._known.is_of(parts, values):
                materials = SceneMaterials(
                    scene, self.prune, self.model.form, not self.model.is_own
                )
                begin = perf_counter()
                prepared = self.model.prepared(scene, values)
                dr.sync_thread()
                seconds = perf_counter() - begin if self.model.prepare else 0.0
                self._known = _Known(parts, values, materials, prepared, seconds)
            return self._known

        def prepare(self, scene):
            """Collect what a rendering needs; otherwise the first sample does."""
            self.known(scene)

        @property
        def preparation(self):
            """Seconds that preparing took for the scene rendered last."""
            return self._known.seconds if self._known is not None else 0.0

        def lights(self, scene, si, active):
            """Return the kernel's form of the scene's lights."""
            return [emitter.light(si, active) for emitter in _lights(scene)]

        def ambient_at(self, si, active):
            """Return ``I_a``, a plain 0 if there is none."""
            is_there = may_be_nonzero(self.ambient) or not self.prune
            return self.ambient.eval(si, active) if is_there else 0

        def visibility(self, scene, si, active):
            """Return the shadow test for :func:`heuristic.shade`, None if there is none."""
            return _shadow_test(scene, si, active) if self.occlusion else None

        def twosided(self, scene, si, active):
            """Return whether the surface is two-sided; a plain False if none of the scene is."""
            return self.known(scene).materials.twosided(si, active)

        def traverse(self, callback):
            for name, value in {"ambient": self.ambient, **self.parameters}.items():
                callback.put(name, value, mi.ParamFlags.Differentiable)

        def parameters_changed(self, keys=()):
            """Make edited numbers opaque, so new values compile nothing."""
            dr.make_opaque(self.parameters)
            prepared = [known.name for known in self.model.parameters if known.prepared]
            self._prepared_with = {name: float(self.parameters[name][0]) for name in prepared}

        def to_string(self):
            return f"HeuristicIntegrator[model = {self.model.name}, ambient = {self.ambient}]"

    interpolating = _interpolating(HeuristicIntegrator)

    def make(props):
        is_phong = props.get("interpolation", "phong") == "phong"
        return (HeuristicIntegrator if is_phong else interpolating)(props)

    mi.register_integrator("heuristic", make)


@dr.syntax
def _through_layers(integrator, scene, ray, active):
    """Follow rays straight through surfaces that transmit light, at most :data:`LAYERS` of them.

    ``C = sum_j c_j prod_(i < j) T_i``: each surface adds its light ``c_j``, which includes its
    opacity, behind the transmittances ``T_i`` of those before it.
    """
    colour, throughput = mi.Spectrum(0), mi.Spectrum(1)
    hit_any = mi.Bool(False)
    layer = mi.UInt32(0)
    while active & (layer < LAYERS):
        seen, hit, si = integrator.layer(scene, ray, active)
        colour += throughput * mi.Spectrum(seen)
        throughput *= mi.Spectrum(integrator.known(scene).materials.transmittance(si, hit))
        hit_any |= hit
        ray = si.spawn_ray(ray.d)
        active = hit & (dr.max(throughput) > 0)
        layer += 1
    return colour, hit_any


def _interpolation(props):
    name = props.get("interpolation", "phong")
    known = [kind.value for kind in Interpolation]
    if name not in known:
        raise InputError(f"interpolation {name!r} is not known: choose one of {', '.join(known)}.")
    return Interpolation(name)


def _shadow_test(scene, si, active):
    """Return the test whether a light in some direction, at some distance, is seen from ``si``."""

    def visible(toward, distance):
        # Mitsuba aims at a point for parallel light too, which matters for grazing rays.
        distance = FAR if isinstance(distance, float) else distance
        return ~scene.ray_test(si.spawn_ray_to(si.p + toward * distance), active)

    return visible


def _lights(scene):
    """Return the emitters that light the scene; reject those that the model does not know."""
    lights = []
    for emitter in scene.emitters():
        if hasattr(emitter, "light"):
            lights.append(emitter)
        elif not (emitter.is_environment() or hasattr(emitter, "k_a")):
            raise InputError(
                f"emitter {emitter.id()!r} ({emitter.class_name()}) has no heuristic form. The"
                " integrator heuristic renders the heuristic half of a pair, which reference.pair"
                " makes."
            )
    return lights


def _interpolating(base: type) -> type:
    """Return the class for the current variant with ``flat`` or ``gouraud`` (6.35, 6.36).

    In RGB variants the heuristic runs once per vertex or face before the rendering, for the sensor
    that renders, and Mitsuba interpolates the stored values. Spectral variants draw other
    wavelengths for each ray; there it runs at the corners of the face that a ray hits.
    """

    class InterpolatingIntegrator(base):
        """See the module's docstring."""

        def render(self, scene, sensor=0, seed=0, spp=0, develop=True, evaluate=True):
            if not mi.is_spectral:
                self._store(scene, scene.sensors()[sensor] if isinstance(sensor, int) else sensor)
            return super().render(scene, sensor, seed, spp, develop, evaluate)

        def surface_colour(self, scene, si, view, active):
            if mi.is_spectral:
                return self._at_corners(scene, si, view, active)
            twosided = any(shape.bsdf().twosided for shape in scene.shapes())
            values = stored_shade(si, self.interpolation, twosided=twosided, active=active)
            return mi.Color3f(values) if mi.is_rgb else mi.Spectrum(values[0])

        def _store(self, scene, sensor):
            viewer = viewpoint(sensor)
            for mesh in _meshes(scene):
                at = shading_points(mesh, self.interpolation)
                shade_mesh(
                    mesh,
                    self.interpolation,
                    viewer,
                    mesh.bsdf().material(
                        at, True, self.prune, self.model.form, not self.model.is_own
                    ),
                    self.lights(scene, at, True),
                    self.ambient_at(at, True),
                    self.visibility(scene, at, True),
                    # Stored for all, because reading cannot distinguish the shapes.
                    twosided=any(shape.bsdf().twosided for shape in scene.shapes()),
                    model=self.model_at(scene, at),
                )

        def _at_corners(self, scene, si, view, active):
            _meshes(scene)
            corners = MeshCorners(scene).at(si, active)
            viewer = si.p + view * si.t
            front = dr.dot(si.n, view) > 0
            if self.interpolation is Interpolation.FLAT:
                corners = [(mi.Float(1), _centroid(si, corners))]
            colour = mi.Spectrum(0)
            for weight, corner in corners:
                normal = dr.select(front, mi.Vector3f(corner.sh_frame.n), -corner.sh_frame.n)
                value = self.shaded(scene, corner, viewer - corner.p, normal, active)
                colour += weight * value
            twosided = self.twosided(scene, si, active)
            return dr.select(active & (twosided | front), colour, 0)

    return InterpolatingIntegrator


def _meshes(scene):
    """Return the scene's shapes; reject those that are not meshes."""
    for shape in scene.shapes():
        if not shape.is_mesh():
            raise InputError(
                f"shape {shape.id()!r} is a {shape.class_name()}: flat and Gouraud shading need"
                " triangle meshes. Make one with heuristic.meshes.to_mesh; fotismos does so itself."
            )
    return scene.shapes()


def viewpoint(sensor: Any) -> Position:
    """Return the viewer's position; reject cameras without one."""
    if not isinstance(sensor, mi.ProjectiveCamera) or "Orthographic" in sensor.class_name():
        raise InputError(
            f"sensor {sensor.id()!r} ({sensor.class_name()}) has no single viewpoint, which flat"
            " and Gouraud shading need: use perspective or thinlens, or phong interpolation."
        )
    return sensor.world_transform().translation()


def _centroid(si, corners):
    """Return the interaction at the centroid of the face, with the face's own normal."""
    point = mi.SurfaceInteraction3f(si)
    point.p = sum(corner.p for _, corner in corners) / 3
    point.uv = sum(corner.uv for _, corner in corners) / 3
    point.sh_frame.n = point.n = si.n
    return point
