"""The integrator plugin ``heuristic``: shading at the first surface that a camera ray hits.

==================  ==================  ===========================================================
Parameter           Type (default)      Meaning
==================  ==================  ===========================================================
``model``           string (phong)      name of the heuristic that shades
                                        (:mod:`fotismos.heuristic.heuristics`)
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

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from operator import is_
from time import perf_counter
from typing import Any, Self

import drjit as dr
import mitsuba as mi

from fotismos.heuristic import heuristics
from fotismos.heuristic.convention import (
    Colour,
    Direction,
    Interaction,
    Mask,
    Properties,
    Scene,
    Visibility,
)
from fotismos.heuristic.errors import InputError, unknown
from fotismos.heuristic.heuristics import Interpolation, ShadingArguments
from fotismos.heuristic.lights import FAR, Light
from fotismos.heuristic.plugins.coefficients import SceneMaterials, emitted, may_be_nonzero

LAYERS = 64
"""Surfaces that a camera ray passes at most: a bound for stacks of empty ones."""


def define() -> dict[str, Any]:
    """Return ``{name: what makes it}`` for the integrator in the current variant."""

    class HeuristicIntegrator(mi.SamplingIntegrator):
        """See the module's docstring."""

        def __init__(self, props: Properties) -> None:
            super().__init__(props)
            self.ambient = emitted(props, "ambient", 0.0)
            self.model = heuristics.named(props.get("model", heuristics.PHONG.name))
            self.parameters = {
                parameter.name: mi.Float(
                    parameter.checked(props.get(parameter.name, parameter.default))
                )
                for parameter in self.model.parameters
            }
            self.parameters_changed()
            self.shares: dict[str, Any] | None = None
            self.parts: Any = None
            self.values: Any = None
            self.preparation = 0.0
            self.occlusion = props.get("occlusion", False) or "visible" in self.model.needs
            # A user's heuristic gets only arrays: a plain 0 has no components.
            self.prune = props.get("prune", True) and self.model.is_builtin
            self.interpolation = Interpolation(props.get("interpolation", "phong"))

        def sample(
            self, scene: Scene, sampler: Any, ray: Any, medium: Any = None, active: Mask = True
        ) -> tuple[Colour, Mask, list[Any]]:
            materials = self.known(scene).materials  # a symbolic loop could not make them
            if any(bsdf.is_clear for bsdf in materials.bsdfs):
                # A heuristic that cannot be recorded, such as one in GLSL, needs an evaluated loop.
                recorded = self.model.traced and dr.flag(dr.JitFlag.SymbolicLoops)
                with dr.scoped_set_flag(dr.JitFlag.SymbolicLoops, recorded):
                    colour, hit = _through_layers(
                        self, scene, ray=mi.Ray3f(ray), active=mi.Bool(active)
                    )
            else:
                colour, hit, _ = self.layer(scene, ray, active)
            # The mask marks pixels with a value: all of them where the environment shows.
            sees_all = scene.environment() is not None and not self.hide_emitters
            return colour, active if sees_all else hit, []

        def layer(self, scene: Scene, ray: Any, active: Mask) -> tuple[Colour, Mask, Interaction]:
            """Return the value where a ray first hits, or else the background; and the hit."""
            si = scene.ray_intersect(ray, active)
            hit = active & si.is_valid()
            colour = self.surface_colour(scene, si, mi.Vector3f(-ray.d), hit)
            return colour + self.background(scene, si, active & ~hit), hit, si

        def background(self, scene: Scene, si: Interaction, active: Mask) -> Colour:
            """Return the environment's light where rays hit nothing; a plain 0 if it is hidden."""
            environment = scene.environment()
            if environment is None or self.hide_emitters:
                return 0
            return dr.select(active, environment.eval(si, active), 0)

        def surface_colour(
            self, scene: Scene, si: Interaction, view: Direction, active: Mask
        ) -> Colour:
            """Return the value seen where a ray hits, with the normal of 6.37 and 6.38."""
            normal, is_shaded = self.seen_side(scene, si, active)
            colour = self.shaded(scene, si, view, normal, active)
            return dr.select(active & is_shaded, colour, 0)

        def seen_side(self, scene: Scene, si: Interaction, active: Mask) -> tuple[Direction, Mask]:
            """Return the normal of the side that is seen, and whether that side is shaded."""
            materials = self.known(scene).materials
            normal = materials.normal(si, active)
            twosided = materials.twosided(si, active)
            if twosided is not False:
                # `wi` points to the viewer: with a negative z the back is seen.
                normal = dr.select(twosided & (si.wi.z < 0), -normal, normal)
            return normal, twosided | (si.wi.z > 0)

        def shaded(
            self, scene: Scene, si: Interaction, view: Direction, normal: Direction, active: Mask
        ) -> Colour:
            """Shade at a surface interaction, whose material is one of several."""
            model = self.model_at(scene, si)
            lights = self.lights(scene, si, active)
            ambient = self.ambient_at(si, active)
            visible = self.visibility(scene, si, active)
            colour = mi.Spectrum(0)
            # One evaluation for each form of the lobe; the masks do not overlap.
            for material, is_here in self.known(scene).materials.at(si, active):
                value = model(si.p, normal, view, material, lights, ambient, visible)
                colour += dr.select(is_here, value, 0)
            return colour

        def model_at(self, scene: Scene, si: Interaction) -> Callable[..., Colour]:
            """Return the heuristic as a function of the arguments of the kernel's ``shade``.

            ``shares`` are factors on the material's coefficients, for images of single terms.
            """
            prepared = self.known(scene).prepared
            emitter = scene.environment()
            behind = None
            if emitter is not None:
                from fotismos.heuristic.background import radiance  # loaded late: many have none

                behind = partial(radiance, emitter, at=si)

            def evaluate(*arguments: Any) -> Colour:
                shading = ShadingArguments._make(arguments)
                if self.shares is not None:
                    changed = {
                        name: getattr(shading.material, name) * share
                        for name, share in self.shares.items()
                    }
                    shading = shading._replace(material=replace(shading.material, **changed))
                return self.model.evaluate(
                    shading, si.uv, self.parameters, prepared, si.wavelengths, behind
                )

            return evaluate

        def known(self, scene: Scene) -> Self:
            """Return the integrator with ``materials`` and ``prepared`` of a scene.

            The latter is the heuristic's preparation; it took ``preparation`` seconds.
            """
            # Its parts identify a scene: holding the scene would be a cycle, never freed.
            parts = [*scene.shapes(), *scene.emitters(), *scene.sensors()]
            is_same = self.parts is not None and len(parts) == len(self.parts)
            # Prepared again for another scene, and for other values of prepared parameters.
            if not (is_same and all(map(is_, parts, self.parts)) and self.values == self.numbers):
                self.materials = SceneMaterials(
                    scene, self.prune, form=self.model.form, physical=not self.model.is_builtin
                )
                begin = perf_counter()
                self.prepared = self.model.prepared(scene, self.numbers)
                # Kernels run asynchronously: without this the time would miss them.
                dr.sync_thread()
                self.preparation = perf_counter() - begin if self.model.prepare else 0.0
                self.parts = parts
                self.values = self.numbers
            return self

        def collect(self, scene: Scene) -> None:
            """Collect what a rendering needs; otherwise the first sample does."""
            self.known(scene)

        def lights(self, scene: Scene, si: Interaction, active: Mask) -> list[Light]:
            """Return the kernel's form of the lights; reject those that it does not know."""
            lights = []
            for emitter in scene.emitters():
                if hasattr(emitter, "light"):
                    lights.append(emitter.light(si, active))
                elif not (emitter.is_environment() or hasattr(emitter, "k_a")):
                    raise InputError(
                        f"emitter {emitter.id()!r} ({emitter.class_name()}) has no textbook form."
                        " The integrator heuristic renders the textbook half of a pair, which"
                        " fotismos.reference.pair makes."
                    )
            return lights

        def ambient_at(self, si: Interaction, active: Mask) -> Colour:
            """Return ``I_a``, a plain 0 if there is none."""
            is_there = may_be_nonzero(self.ambient) or not self.prune
            return self.ambient.eval(si, active) if is_there else 0

        def visibility(self, scene: Scene, si: Interaction, active: Mask) -> Visibility | None:
            """Return the shadow test for the kernel's ``shade``, None if there is none."""
            if not self.occlusion:
                return None

            def visible(toward: Direction, distance: Any) -> Mask:
                # Mitsuba aims at a point for parallel light too, which matters for grazing rays.
                distance = FAR if isinstance(distance, float) else distance
                return ~scene.ray_test(si.spawn_ray_to(si.p + toward * distance), active)

            return visible

        def traverse(self, callback: Any) -> None:
            for name, value in {"ambient": self.ambient, **self.parameters}.items():
                callback.put(name, value, mi.ParamFlags.Differentiable)

        def parameters_changed(self, keys: Sequence[str] = ()) -> None:
            """Make edited numbers opaque, so new values compile nothing."""
            dr.make_opaque(self.parameters)
            # `prepare` takes plain numbers, and `known` compares them.
            prepared = [parameter.name for parameter in self.model.parameters if parameter.prepared]
            self.numbers = {name: float(self.parameters[name][0]) for name in prepared}

        def to_string(self) -> str:
            return f"HeuristicIntegrator[model = {self.model.name}, ambient = {self.ambient}]"

    def make(props: Properties) -> Any:
        name = props.get("interpolation", "phong")
        names = [kind.value for kind in Interpolation]
        if name not in names:
            raise unknown("interpolation", name, names)
        if name == "phong":
            return HeuristicIntegrator(props)
        # Loaded late: most scenes have no meshes.
        from fotismos.heuristic.plugins import interpolated

        return interpolated.derived(HeuristicIntegrator)(props)

    return {"heuristic": make}


@dr.syntax
def _through_layers(integrator: Any, scene: Scene, ray: Any, active: Mask) -> tuple[Colour, Mask]:
    """Follow rays straight through surfaces that transmit light, at most :data:`LAYERS` of them.

    ``C = sum_j c_j prod_(i < j) T_i``: each surface adds its light ``c_j``, which includes its
    opacity, behind the transmittances ``T_i`` of those before it.
    """
    colour = mi.Spectrum(0)
    throughput = mi.Spectrum(1)
    hit_any = mi.Bool(False)
    layer = mi.UInt32(0)
    while active & (layer < LAYERS):
        value, hit, si = integrator.layer(scene, ray, active)
        colour += throughput * mi.Spectrum(value)
        throughput *= mi.Spectrum(integrator.known(scene).materials.transmittance(si, hit))
        hit_any |= hit
        # On from the far side of the surface, in the same direction.
        ray = si.spawn_ray(ray.d)
        active = hit & (dr.max(throughput) > 0)
        layer += 1
    return colour, hit_any
