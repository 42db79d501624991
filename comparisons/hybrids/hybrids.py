"""Hybrids: images in which some effects are simulated, the others as in the heuristic half.

The halves of a pair differ in a few effects. Any subset of them makes a scene: the physical half
with the BSDFs, lights and environment of the heuristic one where an effect is left out. Emission
and ambient light of the heuristic half are not transported light. They are a pass of their own, of
what a camera ray meets, which is added.

Every image is rendered in a few replicates, each with its own seed, which all images share. So
differences between images keep little noise, and the spread of the replicates measures it.

A box filter gives a preview at no cost: the film has more and smaller pixels, each with fewer
samples, and the mean over a block of them is the pixel that the coarser film would have.
"""

from collections.abc import Callable, Hashable, Iterable, Sequence, Set
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import Any, Self, TypeVar

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from comparisons.options import Options
from comparisons.prepared import Prepared
from heuristic.convention import Scene
from heuristic.heuristics import Interpolation
from reference.pairing import lights
from reference.pairing.halves import Pair
from reference.planning.effects import (
    EFFECTS,
    ENVIRONMENT,
    POLYGONS,
    SPECTRAL,
    Effect,
)
from reference.planning.facts import BSDF, EMITTER, SHAPE, Facts
from reference.planning.plan import Plan, physical_integrator
from reference.rendering.gbuffer import image_size, resize
from reference.rendering.renderer import Renderer, Stream, passes, variant
from reference.rendering.sampler import with_sampler
from reference.scene.graph import Graph, properties
from reference.scene.source import Source

REPLACED = tuple(effect for effect in EFFECTS if effect.put)
IN_SCENE: frozenset[Effect] = frozenset(REPLACED)
"""Effects that change the scene; the others change only what the integrator does."""

IN_EMISSION = tuple(effect for effect in REPLACED if effect.emission)
"""Effects that change the emission pass."""

KERNEL, PLAIN_KERNEL = "kernel", "kernel with Phong interpolation"

Key = str | frozenset[Effect]
"""An image: one of the two names above, or the effects that it simulates."""

Player = TypeVar("Player", bound=Hashable)
"""An effect; in tests of the sums, any name."""

PREVIEW = 96
"""Pixels of a preview's longer side, at most."""

LEAST_SPP = 4
"""Samples per pixel of a preview's replicate, at least: fewer are not stratified."""


def subsets(players: Sequence[Player]) -> list[frozenset[Player]]:
    """Return all sets of some effects, small ones first."""
    sizes = range(len(players) + 1)
    return [frozenset(chosen) for size in sizes for chosen in combinations(players, size)]


def labels(effects: Sequence[Effect], simulated: frozenset[Effect]) -> tuple[str, ...]:
    """Return the labels of the effects that are simulated, in their order."""
    return tuple(effect.label for effect in effects if effect in simulated)


class Pairs:
    """The pairs of one scene, each derived once: in several variants, with several kernels.

    The pair of ``ready``, which is prepared with the same options, is the first of them.
    """

    def __init__(self, source: Source, options: Options, ready: Prepared) -> None:
        self.options, self.ready = options, ready
        self.heuristic_variant = options.heuristic_variant or ready.reference.variant
        self._source = source
        key = ready.reference.variant, options.polygon_shading, options.tessellation
        self._known = {key: ready.pair}

    def of(self, interpolation: Interpolation) -> Pair:
        """Return the pair with an interpolation and the requested tessellation, in this variant.

        ``InputError`` if a shape cannot be a mesh, or flat and Gouraud shading have no viewpoint.
        """
        return self._of(interpolation, self.options.tessellation)

    def plain(self) -> Pair:
        """Return the pair with the scene's own geometry, in this variant."""
        return self._of(Interpolation.PHONG, None)

    def _of(self, interpolation: Interpolation, tessellation: int | None) -> Pair:
        key = mi.variant(), interpolation, tessellation
        if key not in self._known:
            changed = self.options.changed(
                interpolation=interpolation.value, tessellation=tessellation
            )
            self._known[key] = changed.pair(self._source)
        return self._known[key]


class HybridScenes:
    """The scenes of hybrids of a pair without tessellation, in the current variant.

    Only the last scene is kept, for sets that differ only in what the integrator does: Dr.Jit
    traces every BSDF that is alive, in any scene. ``scene`` is the physical half, with the sampler
    of ``plan``, which is the reference's.
    """

    def __init__(self, pair: Pair, plan: Plan, scene: Scene) -> None:
        self.pair, self.plan, self.scene = pair, plan, scene
        self.facts = Facts.of(pair, scene)
        self.differences = tuple(
            effect for effect in EFFECTS if effect.differs(self.facts, plan.calls_for(effect))
        )
        """The effects in which the halves differ, in their order."""
        self._last: dict[frozenset[Effect], Scene] = {}

    def of(self, simulated: Set[Effect]) -> Scene:
        """Return the scene of some effects, without its emission pass."""
        key = self.key(simulated)
        if key == self.key(set(self.differences)):
            return self.scene
        if key not in self._last:
            self._last.clear()
            graph = with_sampler(self.graph(simulated), self.plan.sampler)
            self._last[key] = graph.instantiate()
        return self._last[key]

    def key(self, simulated: Set[Effect]) -> frozenset[Effect]:
        """Return the effects among them that change the scene."""
        return IN_SCENE & set(simulated) & set(self.differences)

    def forget(self) -> None:
        """Release the last scene."""
        self._last.clear()

    def graph(self, simulated: Set[Effect]) -> Graph:
        """Return the graph of :meth:`of`."""
        graph = self.pair.physical.copy()
        for effect in REPLACED:
            if effect not in simulated:
                assert effect.put, "REPLACED has only such effects"
                effect.put(graph, self.facts, effect.sites(self.facts))
        return graph

    def transport(self, simulated: Set[Effect], spp: int) -> Renderer:
        """Return the renderer of transported light, with the effects ``simulated``.

        All sets share one integrator, which can leave out effects.
        """
        scene = self.of(simulated)
        alike = set(EFFECTS) - set(self.differences)
        plan = self.plan.directly().simulating(alike | set(simulated))
        integrator = physical_integrator(plan, scene, self.pair.hide_emitters)
        return Renderer(scene, integrator, spp, "image of some effects")

    def emission(self, simulated: Set[Effect], spp: int) -> Renderer | None:
        """Return the renderer of the emission pass: emission, ambient light and background.

        None if there are none. Its images are to be added to transported light of equal seeds.
        """
        left_out = [effect for effect in IN_EMISSION if effect not in simulated]
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
                emitted: dict[str, Any] = {}
                for effect in left_out:
                    assert effect.emission, "IN_EMISSION has only such effects"
                    emitted |= effect.emission(phong, self.facts)
                if emitted:
                    emitted["twosided"] = phong.get("twosided", False)
                    props = properties("heuristic_glow", **emitted)
                    graph.attach(shape, "glow", graph.add(EMITTER, props))
        if not graph.nodes(EMITTER):
            return None
        scene = with_sampler(graph, self.plan.sampler).instantiate()
        # Hiding emitters would hide the emission; a hidden environment was detached above.
        integrator = mi.load_dict({"type": "path", "max_depth": 1, "hide_emitters": False})
        return Renderer(scene, integrator, spp, "image of emission and ambient light")


@dataclass(frozen=True)
class Replicates:
    """The replicates of one image.

    ``images`` are (R, H, W, 3), and ``preview`` is the mean of all in finer pixels (f H, f W, 3),
    ``f`` per pixel in each direction.
    """

    images: np.ndarray
    preview: np.ndarray

    def __add__(self, other: Self) -> Self:
        return self._with(other, np.add)

    def __sub__(self, other: Self) -> Self:
        return self._with(other, np.subtract)

    def _with(self, other: Self, operation: Callable[..., NDArray]) -> Self:
        return type(self)(*map(operation, vars(self).values(), vars(other).values()))


class HybridImages:
    """All images between the heuristic half as requested and the reference, each rendered once.

    Of each image there are ``replicates``, at least 3, with ``spp`` samples per pixel, and of a
    ``size`` of (width, height). ``scenes`` are in the reference's variant.
    """

    def __init__(
        self,
        pairs: Pairs,
        scenes: HybridScenes,
        replicates: int,
        spp: int,
        seed: int,
        size: tuple[int, int],
    ) -> None:
        self.replicates, self.spp, self.size = replicates, spp, size
        self._pairs, self._ready, self._seed = pairs, pairs.ready, seed
        self._variant = pairs.ready.reference.variant
        self._scenes = {self._variant: scenes}
        self._known: dict[Key, Replicates] = {}
        self._emission: dict[tuple[str, Key], Replicates | None] = {}

    @cached_property
    def effects(self) -> tuple[Effect, ...]:
        """The effects in which the heuristic half as requested differs from the reference."""
        options = self._pairs.options
        found = set(self._scenes[self._variant].differences)
        if options.polygon_shading is not Interpolation.PHONG or options.tessellation is not None:
            found.add(POLYGONS)
        if self._pairs.heuristic_variant != self._variant:
            found.add(SPECTRAL)
        return tuple(effect for effect in EFFECTS if effect in found)

    def render(self, keys: Iterable[Key]) -> None:
        """Render what is not cached, image by image: every scene that is alive slows all others."""
        groups: dict[str, list[Key]] = {}
        for key in dict.fromkeys(keys):
            if key not in self._known:
                groups.setdefault(self._variant_of(key), []).append(key)
        for name, group in groups.items():
            with variant(name):
                for key in sorted(group, key=self._scene_name):  # equal scenes next to each other
                    self._known[key] = self._replicates(key)
        for scenes in self._scenes.values():
            scenes.forget()

    def of(self, key: Key) -> Replicates:
        """Return the replicates of an image."""
        self.render([key])
        return self._known[key]

    def simulating(self, effects: Set[Effect]) -> Replicates:
        """Return the image in which some of ``effects`` are simulated.

        None is the kernel as requested; all are the scene of the reference, edited, which would
        show faults of the edits. Only the kernel has flat and Gouraud shading; where they remain,
        an image gets the difference that they make there.
        """
        found = self.of(self.needed(effects)[-1])
        if not self._keeps_polygons(effects):
            return found
        return found + (self.of(KERNEL) - self.of(PLAIN_KERNEL))

    def needed(self, effects: Set[Effect]) -> list[Key]:
        """Return the images that :meth:`simulating` needs for a set of effects."""
        if not effects:
            return [KERNEL]
        kernels: list[Key] = [KERNEL, PLAIN_KERNEL] if self._keeps_polygons(effects) else []
        return [*kernels, frozenset(effects) - {POLYGONS}]

    def _keeps_polygons(self, effects: Set[Effect]) -> bool:
        return bool(effects) and POLYGONS in self.effects and POLYGONS not in effects

    @property
    def plain_kernel(self) -> Key:
        """The kernel with an exact normal at each point."""
        return PLAIN_KERNEL if POLYGONS in self.effects else KERNEL

    def _variant_of(self, key: Key) -> str:
        if isinstance(key, str):
            return self._pairs.heuristic_variant
        is_current = SPECTRAL in key or SPECTRAL not in self.effects
        return self._variant if is_current else self._pairs.heuristic_variant

    def _scene_name(self, key: Key) -> str:
        if isinstance(key, str):
            return key
        scene = self._scenes[self._variant].key(key)
        return " ".join(sorted(effect.label for effect in scene))

    def _replicates(self, key: Key) -> Replicates:
        """Render an image in its variant, which is current."""
        if isinstance(key, str):
            return self._passes(self._kernel(key))
        if mi.variant() not in self._scenes:
            pair = self._pairs.plain()
            physical = with_sampler(pair.physical, self._ready.plan.sampler).instantiate()
            self._scenes[mi.variant()] = HybridScenes(pair, self._ready.plan, physical)
        scenes = self._scenes[mi.variant()]
        transport = self._passes(scenes.transport(key, self._finer_spp))
        pass_key = mi.variant(), frozenset(IN_EMISSION) & key
        if pass_key not in self._emission:
            renderer = scenes.emission(key, self._finer_spp)
            self._emission[pass_key] = self._passes(renderer) if renderer else None
        emission = self._emission[pass_key]
        return transport + emission if emission else transport

    def _kernel(self, key: str) -> Renderer:
        """Return the renderer of a kernel."""
        ready, spp = self._ready, self._finer_spp
        scene = ready.heuristic.scene
        if key == PLAIN_KERNEL:
            scene = with_sampler(self._pairs.plain().heuristic, ready.plan.sampler).instantiate()
        return Renderer(scene, None, spp, "image of the kernel")

    @cached_property
    def finer(self) -> int:
        """Pixels of a preview per pixel of an image, in each direction."""
        scene: Scene = self._ready.scene
        factor, even = 1, 4 * LEAST_SPP
        if "Box" not in scene.sensors()[0].film().rfilter().class_name():
            return factor
        while 2 * factor * max(self.size) <= PREVIEW and self.spp % (even * factor**2) == 0:
            factor *= 2
        return factor

    @property
    def _finer_spp(self) -> int:
        return self.spp // self.finer**2

    def _passes(self, renderer: Renderer) -> Replicates:
        """Render the replicates on a film of the preview's size, then restore the film's."""
        (width, height), whole = self.size, image_size(renderer.scene)
        renderer.size = self.finer * width, self.finer * height
        loop = passes([renderer], self._seed, self.replicates, stream=Stream.REPLICATES)
        fine = np.stack([np.array(one.images[0]) for one in loop])
        resize(renderer.scene, whole)
        blocks = fine.reshape(len(fine), height, self.finer, width, self.finer, -1)
        images = blocks.mean(axis=(2, 4))
        return Replicates(images, fine.mean(axis=0))
