"""Scenes between the two halves: some differences simulated, the others as the heuristic has them.

The halves of a pair differ in a few effects. Any subset of them makes a scene: the physical half
with the BSDFs, lights and environment of the heuristic one where an effect is left out. Emission
and ambient light of the heuristic half do not travel, so they are a picture of their own, of what
a camera ray meets, to be added to the light that does.
"""

from dataclasses import dataclass, field
from functools import cached_property

import mitsuba as mi

from reference.pairing import lights
from reference.pairing.halves import BSDF, INTEGRATOR, with_sampler
from reference.planning.effects import Effect
from reference.planning.planner import Plan
from reference.planning.structure import EMITTER, SHAPE, examine
from reference.rendering import direct
from reference.rendering.environment import AlbedoTable
from reference.rendering.renderer import Renderer
from reference.scene.graph import Reference, properties

OF_BSDFS = {Effect.MICROFACETS, Effect.TRANSMISSION}
"""Effects that tell a surface's two forms apart."""

OF_INTEGRATOR = {Effect.OCCLUSION, Effect.INTERREFLECTION}
"""Effects that the integrator simulates or leaves out: the scene is the same."""


@dataclass(frozen=True)
class Between:
    """The scenes between the halves of a pair, in the current variant.

    Parameters
    ----------
    pair : reference.pairing.halves.Pair
        Both halves, without tessellation.
    plan : reference.planning.planner.Plan
        Of the reference.

    scene : mitsuba.Scene
        The physical half, with the plan's sampler.

    The last scene is kept for subsets that differ in what the integrator does alone, and no other:
    Dr.Jit traces every BSDF that is alive, in whatever scene.
    """

    pair: object
    plan: Plan
    scene: object
    _last: dict = field(default_factory=dict, init=False, repr=False)
    _tables: dict = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def differences(self):
        """The effects in which the halves differ, in the order of the enumeration."""
        found = set(self._bsdf_effects.values()) | set(self._light_effects.values())
        if any(self.pair.physical.children(shape, EMITTER) for shape in self._shapes):
            found.add(Effect.EXTENDED)
        if self._environments:
            found.add(Effect.ENVIRONMENT)
        if self.plan.calls_for(Effect.OCCLUSION) and not self.has_occlusion:
            found.add(Effect.OCCLUSION)
        if self.plan.calls_for(Effect.INTERREFLECTION) and self.pair.max_depth != 2:
            found.add(Effect.INTERREFLECTION)
        return tuple(effect for effect in Effect if effect in found)

    @cached_property
    def has_occlusion(self):
        """Whether the heuristic half itself has shadows."""
        return self._integrator.get("occlusion", False)

    def of(self, simulated):
        """Return the Mitsuba scene of some effects, whose light travels."""
        key = self.scene_key(simulated)
        if key == self.scene_key(self.differences):
            return self.scene
        if key not in self._last:
            self._last.clear()
            graph = with_sampler(self.graph(simulated), self.plan.sampler)
            self._last[key] = graph.instantiate()
        return self._last[key]

    def scene_key(self, simulated):
        """Return those of the effects that tell one scene from another."""
        return frozenset(simulated) & set(self.differences) - OF_INTEGRATOR

    def glow_key(self, simulated):
        """Return those of the effects that tell what glows."""
        return frozenset(simulated) & {Effect.EXTENDED, Effect.ENVIRONMENT}

    def forget(self):
        """Let go of the last scene."""
        self._last.clear()

    def graph(self, simulated):
        """Return the graph of the scene whose light travels."""
        heuristic, graph = self.pair.heuristic, self.pair.physical.copy()
        grafted = {}
        for shape, effect in self._bsdf_effects.items():
            if effect not in simulated:
                ((key, _),) = graph.children(shape, BSDF)
                ((_, phong),) = heuristic.children(shape, BSDF)
                if phong not in grafted:
                    grafted[phong] = _graft(graph, heuristic, phong)
                graph.attach(shape, key, grafted[phong])
        lights = dict(heuristic.children(0, EMITTER))
        for key, effect in self._light_effects.items():
            if effect not in simulated:
                graph.attach(0, key, _graft(graph, heuristic, lights[key]))
        if Effect.ENVIRONMENT not in simulated:
            for key in self._environments:
                graph.detach(0, key)
        if Effect.EXTENDED not in simulated:
            self._replace_area_lights(graph, lights)
        return graph

    def _replace_area_lights(self, graph, lights):
        for shape in self._shapes:
            for key, _ in graph.children(shape, EMITTER):
                graph.detach(shape, key)
                if self.pair.hide_emitters:
                    graph.remove(shape)
        given = dict(self.pair.physical.children(0, EMITTER))
        for key, index in lights.items():
            if key not in given:
                graph.attach(0, key, _graft(graph, self.pair.heuristic, index))

    def travelling(self, simulated, spp):
        """Return what renders the light that travels, with the effects ``simulated``."""
        scene = self.of(simulated)
        hidden = self.plan.calls_for(Effect.OCCLUSION)
        shadows = hidden and (self.has_occlusion or Effect.OCCLUSION in simulated)
        direct.register()
        integrator = mi.load_dict(
            {
                "type": "direct_all",
                "hide_emitters": self.pair.hide_emitters,
                "shadows": shadows,
                "bsdf_samples": int(shadows or not hidden),
                "max_depth": self.pair.max_depth if Effect.INTERREFLECTION in simulated else 2,
            }
        )
        if self.plan.tabulate_environment and Effect.ENVIRONMENT in simulated:
            bsdfs = frozenset(simulated) & OF_BSDFS
            if bsdfs not in self._tables:
                self._tables[bsdfs] = AlbedoTable(scene.shapes()[0].bsdf())
            integrator.environment_albedo = self._tables[bsdfs]
        return Renderer(scene, integrator, spp, "image of some effects")

    def glowing(self, simulated, spp):
        """Return what renders emission, ambient light and background; None where there is none.

        It is to be added to the light that travels, with equal seeds.
        """
        if {Effect.EXTENDED, Effect.ENVIRONMENT} <= set(simulated):
            return None
        graph = self.pair.heuristic.copy()
        ambient = self._integrator.get("ambient", None)
        for key, index in graph.children(0, EMITTER):
            is_background = not lights.is_heuristic(graph.plugin(index))
            seen = is_background and Effect.ENVIRONMENT not in simulated
            if not seen or self.pair.hide_emitters:
                graph.detach(0, key)
        for shape in graph.nodes(SHAPE):
            for _, index in graph.children(shape, BSDF):
                phong, glow = graph.props(index), {}
                if "k_i" in phong and Effect.EXTENDED not in simulated:
                    glow["k_i"] = phong["k_i"]
                if "k_a" in phong and ambient is not None and Effect.ENVIRONMENT not in simulated:
                    glow |= {"k_a": phong["k_a"], "ambient": ambient}
                if glow:
                    glow["twosided"] = phong.get("twosided", False)
                    props = properties("heuristic_glow", **glow)
                    graph.attach(shape, "glow", graph.add(EMITTER, props))
        if not graph.nodes(EMITTER):
            return None
        scene = with_sampler(graph, self.plan.sampler).instantiate()
        # Hiding emitters would hide the glow; the environment is gone where it is hidden.
        integrator = mi.load_dict({"type": "path", "max_depth": 1, "hide_emitters": False})
        return Renderer(scene, integrator, spp, "image of emission and ambient light")

    @cached_property
    def _integrator(self):
        return self.pair.heuristic.props(self.pair.heuristic.nodes(INTEGRATOR)[0])

    @cached_property
    def _shapes(self):
        return self.pair.physical.nodes(SHAPE)

    @cached_property
    def _bsdf_effects(self):
        """The effect that tells a shape's two BSDFs apart, by shape; a diffuse one is exact."""
        graph, found = self.pair.physical, {}
        facts = {shape.name: shape for shape in self._structure.shapes}
        for shape in self._shapes:
            for _, bsdf in graph.children(shape, BSDF):
                inner = [child for _, child in graph.children(bsdf, BSDF)] or [bsdf]
                if any(graph.plugin(index) != "diffuse" for index in inner):
                    fact = facts.get(graph.props(shape).id())
                    is_opaque = fact is None or fact.opaque
                    found[shape] = Effect.MICROFACETS if is_opaque else Effect.TRANSMISSION
        return found

    @cached_property
    def _structure(self):
        return examine(self.pair.physical, self.scene)

    @cached_property
    def _light_effects(self):
        """The effect that tells the two forms of a light apart, by its key in the scene."""
        inexact = {record.name for record in self.pair.emitters if not record.exact}
        return {
            key: effect
            for key, index in self.pair.heuristic.children(0, EMITTER)
            if key in dict(self.pair.physical.children(0, EMITTER))
            and (effect := _of_light(self.pair.heuristic.plugin(index)))
            and self.pair.heuristic.label(index) in inexact
        }

    @cached_property
    def _environments(self):
        """The keys of the physical half's lights that are no single point or direction."""
        graph = self.pair.physical
        found = graph.children(0, EMITTER)
        return [key for key, index in found if not lights.of(graph.plugin(index)).exact]


def _of_light(plugin):
    """Return the effect that tells a light's two forms apart.

    A spot's attenuation goes with its cone: Mitsuba has no spot that falls off in another way.
    """
    kind = lights.of(plugin)
    if kind.has("cutoff"):
        return Effect.CONE
    return Effect.ATTENUATION if kind.has("attenuation") else None


def _graft(graph, other, index):
    """Copy a node of another graph, and all that it refers to, into this one."""
    props = mi.Properties(other.props(index))
    for key, value in list(props.items()):
        if isinstance(value, Reference):
            props[key] = Reference(_graft(graph, other, value.index()))
    return graph.add(other.kind(index), props)
