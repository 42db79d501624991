"""Scenes between the two halves: some differences simulated, the others as in the heuristic half.

The halves of a pair differ in a few effects. Any subset of them makes a scene: the physical half
with the BSDFs, lights and environment of the heuristic one where an effect is left out. Emission
and ambient light of the heuristic half do not travel. They are a separate picture of what a camera
ray meets, to be added to the light that does travel.
"""

from collections.abc import Set
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import mitsuba as mi

from heuristic.arrays import Scene
from reference.effects import EFFECTS
from reference.effects.effect import Effect
from reference.effects.light_forms import ENVIRONMENT
from reference.pairing import lights
from reference.pairing.halves import Pair
from reference.planning.facts import BSDF, EMITTER, SHAPE, Facts, examine
from reference.planning.plan import Plan
from reference.rendering.renderer import Renderer, physical_integrator
from reference.scene.graph import Graph, properties
from reference.scene.sampler import with_sampler

GRAFTED = frozenset(effect for effect in EFFECTS if effect.graft)
GLOWING = tuple(effect for effect in EFFECTS if effect.glow)


@dataclass(frozen=True)
class Between:
    """The scenes between the halves of a pair, in the current variant.

    Only the last scene is kept, for subsets that differ only in what the integrator does: Dr.Jit
    traces every BSDF that is alive, in any scene.

    Parameters
    ----------
    pair
        Both halves, without tessellation.
    plan
        The reference's plan.
    scene
        The physical half, with the plan's sampler.
    """

    pair: Pair
    plan: Plan
    scene: Scene
    _last: dict[frozenset[Effect], Scene] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def differences(self) -> tuple[Effect, ...]:
        """The effects in which the halves differ, in their order."""
        return tuple(
            effect for effect in EFFECTS if effect.differs(self.facts, self.plan.calls_for(effect))
        )

    def of(self, simulated: Set[Effect]) -> Scene:
        """Return the Mitsuba scene of some effects, whose light travels."""
        key = self.scene_key(simulated)
        if key == self.scene_key(set(self.differences)):
            return self.scene
        if key not in self._last:
            self._last.clear()
            graph = with_sampler(self.graph(simulated), self.plan.sampler)
            self._last[key] = graph.instantiate()
        return self._last[key]

    def scene_key(self, simulated: Set[Effect]) -> frozenset[Effect]:
        """Return the effects among them that change the scene."""
        return GRAFTED & set(simulated) & set(self.differences)

    def glow_key(self, simulated: Set[Effect]) -> frozenset[Effect]:
        """Return the effects among them that change what glows."""
        return frozenset(GLOWING) & set(simulated)

    def forget(self) -> None:
        """Release the last scene."""
        self._last.clear()

    def graph(self, simulated: Set[Effect]) -> Graph:
        """Return the graph of the scene whose light travels."""
        graph = self.pair.physical.copy()
        for effect in EFFECTS:
            if effect.graft and effect not in simulated:
                effect.graft(graph, self.facts)
        return graph

    def travelling(self, simulated: Set[Effect], spp: int) -> Renderer:
        """Return the renderer of the light that travels, with the effects ``simulated``.

        All subsets share one integrator, which can leave out effects.
        """
        scene = self.of(simulated)
        alike = set(EFFECTS) - set(self.differences)
        plan = self.plan.directly().simulating(alike | set(simulated))
        integrator = physical_integrator(plan, scene, self.pair.hide_emitters)
        return Renderer(scene, integrator, spp, "image of some effects")

    def glowing(self, simulated: Set[Effect], spp: int) -> Renderer | None:
        """Return the renderer of emission, ambient light and background; None if there are none.

        Its images are to be added to the light that travels, with equal seeds.
        """
        left_out = [effect for effect in GLOWING if effect not in simulated]
        if not left_out:
            return None
        graph = self.pair.heuristic.copy()
        for key, index in graph.children(0, EMITTER):
            seen = not lights.is_heuristic(graph.plugin(index)) and ENVIRONMENT in left_out
            if not seen or self.pair.hide_emitters:
                graph.detach(0, key)
        for shape in graph.nodes(SHAPE):
            for _, index in graph.children(shape, BSDF):
                phong = graph.props(index)
                glow: dict[str, Any] = {}
                for effect in left_out:
                    assert effect.glow, "GLOWING has the effects with a glow"
                    glow |= effect.glow(phong, self.facts)
                if glow:
                    glow["twosided"] = phong.get("twosided", False)
                    props = properties("heuristic_glow", **glow)
                    graph.attach(shape, "glow", graph.add(EMITTER, props))
        if not graph.nodes(EMITTER):
            return None
        scene = with_sampler(graph, self.plan.sampler).instantiate()
        # Hiding emitters would hide the glow; a hidden environment was detached above.
        integrator = mi.load_dict({"type": "path", "max_depth": 1, "hide_emitters": False})
        return Renderer(scene, integrator, spp, "image of emission and ambient light")

    @cached_property
    def facts(self) -> Facts:
        """The facts in which the halves differ."""
        return Facts(self.pair, examine(self.pair.physical, self.scene))
