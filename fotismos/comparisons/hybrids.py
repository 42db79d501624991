"""Hybrids: images in which some effects are simulated, the others as in the textbook half.

The halves of a pair differ in a few effects. Any subset of them makes a scene: the physical half
with the BSDFs, lights and environment of the heuristic one where an effect is left out. Light adds
up: one rendering traces paths with all lights of both halves, and keeps the light of those apart
that an effect adds or replaces, with shadows and without, direct and all. Images of equal surfaces
are sums of such parts. Emission and ambient light of the textbook half are not transported light.
They are passes of their own, of what a camera ray meets, which are added.

Every image is rendered in a few replicates, each with its own seed, which all images share. So
differences between images keep little noise, and the spread of the replicates measures it.

A box filter gives a preview at no cost: the film has more and smaller pixels, each with fewer
samples, and the mean over a block of them is the pixel that the coarser film would have.
"""

from collections.abc import Iterable, Sequence, Set
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import mitsuba as mi
import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from fotismos.comparisons.departure.blocks import averaged, ratio
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import Prepared, pair_for, pair_options
from fotismos.comparisons.records.comparison import CAUSES
from fotismos.heuristic.convention import Floats, Scene
from fotismos.heuristic.heuristics import Interpolation
from fotismos.reference.pairing import lights
from fotismos.reference.pairing.halves import Pair
from fotismos.reference.planning.effects import (
    EFFECTS,
    ENVIRONMENT,
    ONE_INTENSITY,
    POLYGONS,
    PRUNED,
    SPECTRAL,
    Effect,
    GlowingEffect,
    ReplacedEffect,
)
from fotismos.reference.planning.facts import BSDF, EMITTER, SHAPE, Facts
from fotismos.reference.planning.plan import physical_integrator
from fotismos.reference.planning.plan_record import Plan
from fotismos.reference.rendering import direct
from fotismos.reference.rendering.passes import Progress, Stream, passes
from fotismos.reference.rendering.renderer import Renderer, variant
from fotismos.reference.rendering.sampler import with_sampler
from fotismos.reference.rendering.transport import LightGroups, Transport
from fotismos.reference.scene.graph import Graph, Reference, properties

REPLACED = tuple(effect for effect in EFFECTS if isinstance(effect, ReplacedEffect))
IN_SCENE: frozenset[Effect] = frozenset(REPLACED)
"""Effects that change the scene; the others change only what the integrator does."""

IN_EMISSION = tuple(effect for effect in REPLACED if isinstance(effect, GlowingEffect))
"""Effects that change the emission pass."""

OF_KERNEL = frozenset({POLYGONS, ONE_INTENSITY})
"""Effects that only the kernel can do without: flat and Gouraud shading, lights of two colours."""

UNWEIGHTED = "perspective", "orthographic", "thinlens"
"""Cameras that leave light as it is."""

NEAR = 9
"""Width of the square of pixels over which the noise of two previews is correlated."""

FINER = 2
"""Pixels of a preview per pixel of an image, in each direction."""


def labels(effects: Sequence[Effect], simulated: frozenset[Effect]) -> tuple[str, ...]:
    """Return the labels of the effects that are simulated, in their order."""
    return tuple(effect.label for effect in effects if effect in simulated)


class Pairs:
    """The pairs of one scene, each derived once: in several variants, with several kernels.

    The pair of ``ready``, which is prepared with the same options, is the first of them.
    """

    def __init__(self, ready: Prepared, options: Options) -> None:
        self.options = options
        self.ready = ready
        self.heuristic_variant = options.heuristic_variant or ready.reference.variant
        self._known = {(ready.reference.variant, pair_options(options)): ready.pair}

    def of(self, interpolation: Interpolation) -> Pair:
        """Return the pair with an interpolation and the requested tessellation, in this variant.

        ``InputError`` if a shape cannot be a mesh, or flat and Gouraud shading have no viewpoint.
        """
        return self._of(self.options.changed(interpolation=interpolation.value))

    def plain(self) -> Pair:
        """Return the pair with the scene's own geometry, in this variant."""
        return self._of(
            self.options.changed(interpolation="phong", tessellation=None, vertex_weights=None)
        )

    def effects(self, differences: Iterable[Effect]) -> tuple[Effect, ...]:
        """Return the effects in which the textbook half as requested differs from the reference.

        ``differences`` are those of the pair with the scene's own geometry, in this variant.
        """
        options = self.options
        found = set(differences)
        if pair_options(options).has_meshes:
            found.add(POLYGONS)
        if self.heuristic_variant != self.ready.reference.variant:
            found.add(SPECTRAL)
        return tuple(effect for effect in EFFECTS if effect in found)

    def _of(self, options: Options) -> Pair:
        key = mi.variant(), pair_options(options)
        if key not in self._known:
            self._known[key] = pair_for(self.ready.source, options)
        return self._known[key]


class HybridScenes:
    """The scenes of hybrids of a pair without tessellation, in the current variant.

    ``scene`` is the physical half, with the sampler of ``plan``, which is the reference's.
    """

    def __init__(self, pair: Pair, plan: Plan, scene: Scene) -> None:
        self.pair = pair
        self.plan = plan
        self.scene = scene
        self.facts = Facts.of(pair, scene)
        self.differences = tuple(
            effect for effect in EFFECTS if effect.differs(self.facts, plan.calls_for(effect))
        )
        """The effects in which the halves differ, in their order."""

    def of(self, simulated: Set[Effect]) -> Scene:
        """Return the scene of some effects, without its emission pass."""
        return self._scene_and_graph(simulated)[0]

    def _scene_and_graph(self, simulated: Set[Effect]) -> tuple[Scene, Graph]:
        key = self.key(simulated)
        if key == self.key(set(self.differences)):
            return self.scene, self.pair.physical
        graph = self.pair.physical.copy()
        for effect in REPLACED:
            if effect in self.differences and effect not in simulated:
                effect.put(graph, self.facts, effect.sites(self.facts))
        return with_sampler(graph, self.plan.sampler).instantiate(), graph

    def key(self, simulated: Set[Effect]) -> frozenset[Effect]:
        """Return the effects among them that change the scene."""
        return IN_SCENE & set(simulated) & set(self.differences)

    def rendered_alike(self, simulated: Set[Effect]) -> frozenset[Effect]:
        """Return the effects that all images of one rendering share.

        Where light passes surfaces, shadow rays are those of `volpath`, which makes one image.
        """
        if self.facts.lets_straight_through:
            return self.key(simulated) | (frozenset(PRUNED) & set(simulated))
        return self.key(simulated) - set(self._lights)

    @cached_property
    def _lights(self) -> dict[Effect, "ReplacedLights"]:
        """The effects that change only lights, and which."""
        physical = self.pair.physical
        before = lights_of(physical)
        surfaces = [(shape, physical.bsdfs_of(shape)) for shape in physical.shapes()]
        found: dict[Effect, ReplacedLights] = {}
        for effect in REPLACED:
            if effect not in self.differences:
                continue
            graph = physical.copy()
            effect.put(graph, self.facts, effect.sites(self.facts))
            after = lights_of(graph)
            left_out = frozenset(key for key in before if after.get(key) != before[key])
            added = [index for key, index in after.items() if before.get(key) != index]
            is_surface = surfaces != [(shape, graph.bsdfs_of(shape)) for shape in graph.shapes()]
            if (left_out or added) and not is_surface:
                found[effect] = ReplacedLights(
                    left_out=left_out,
                    added=tuple(graph.instantiate(index) for index in added),
                    group=2 * len(found) + 1,
                )
        return found

    def transport(self, sets: Sequence[Set[Effect]], spp: int) -> "Parts":
        """Return the renderer of transported light, and the parts that make each set's image.

        All sets have the same surfaces; one integrator, which can leave out effects, renders them.
        """
        # Every image has what the halves treat alike: only their differences are left out.
        alike = set(EFFECTS) - set(self.differences)
        plans = [self.plan.directly().simulating(alike | set(simulated)) for simulated in sets]
        if self.facts.lets_straight_through and plans[0].shadows:
            scene = self.of(sets[0])
            through = replace(plans[0], integrator=self.plan.stock_integrator)
            integrator = physical_integrator(through, scene, self.pair.hide_emitters)
            renderer = Renderer(scene, integrator, pass_spp=spp, label="image of some effects")
            return Parts(renderer, count=1, images=((0,),))
        # Lights that all images have, or none of them, need no group of their own.
        kept = set.intersection(*map(set, sets))
        apart = {
            effect: change
            for effect, change in self._lights.items()
            if effect not in kept and any(effect in simulated for simulated in sets)
        }
        scene, graph = self._scene_and_graph(set(sets[0]) | set(apart))
        numbers = {place: change.group for change in apart.values() for place in change.left_out}
        groups = LightGroups(
            scene,
            numbers=[numbers.get(place, 0) for place in lights_of(graph)],
            others={change.group + 1: change.added for change in apart.values() if change.added},
        )
        known = {group for _, group in groups.members(scene)}
        parts: dict[Transport, int] = {}
        images = []
        for simulated, plan in zip(sets, plans, strict=True):
            held = {0} | {
                change.group + (effect not in simulated) for effect, change in apart.items()
            }
            transports = [
                Transport(
                    shadows=plan.shadows,
                    bsdf_samples=plan.bsdf_samples,
                    max_depth=plan.max_depth,
                    group=group,
                )
                for group in sorted(held & known)
            ]
            images.append(tuple(parts.setdefault(part, len(parts)) for part in transports))
        integrator = physical_integrator(plans[0], scene, self.pair.hide_emitters)
        integrator.transports = tuple(parts) or (Transport(),)
        integrator.groups = groups
        # Without interreflection, clear surfaces are looked through, as by the kernel.
        integrator.looks_through = True
        renderer = Renderer(scene, integrator, pass_spp=spp, label="image of some effects")
        return Parts(renderer, count=len(integrator.transports), images=tuple(images))

    def emission(self, effect: GlowingEffect, spp: int) -> Renderer | None:
        """Return the renderer of what shines of itself without an effect; None if nothing does.

        Emission, ambient light and background. Its images are to be added to transported light of
        equal seeds.
        """
        graph = self.pair.heuristic.copy()
        # A background that is not simulated stays; all other lights go.
        for key, index in graph.children(0, EMITTER):
            seen = not lights.is_heuristic(graph.plugin(index)) and effect is ENVIRONMENT
            if not seen or self.pair.hide_emitters:
                graph.detach(0, key)
        for shape in graph.nodes(SHAPE):
            for _, index in graph.children(shape, BSDF):
                phong = graph.props(index)
                emitted = effect.emission(phong, self.facts)
                if emitted:
                    twosided = phong.get("twosided", False)
                    props = properties("heuristic_glow", **emitted, twosided=twosided)
                    graph.attach(shape, "glow", graph.add(EMITTER, props))
        if not graph.nodes(EMITTER):
            return None
        scene = with_sampler(graph, self.plan.sampler).instantiate()
        # Hiding emitters would hide the emission; a hidden environment was detached above.
        direct.register()
        integrator = mi.load_dict(
            {"type": "direct_all", "max_depth": 1, "hide_emitters": False, "looks_through": True}
        )
        return Renderer(
            scene, integrator, pass_spp=spp, label="image of emission and ambient light"
        )


@dataclass(frozen=True)
class ReplacedLights:
    """The lights of an effect: those that the physical half loses without it, and gets instead.

    ``left_out`` are their nodes' parents and keys; ``group`` is their group, and the next that of
    ``added``.
    """

    left_out: frozenset[tuple[int, str]]
    added: tuple[Any, ...]
    group: int


@dataclass(frozen=True)
class Parts:
    """A renderer whose passes hold ``count`` parts, and which of them add up to each image."""

    renderer: Renderer
    count: int
    images: tuple[tuple[int, ...], ...]

    def added(self, parts: Sequence[Floats]) -> list[Floats]:
        """Return the images, sums of the parts (..., 3)."""
        dark = np.zeros_like(parts[0])
        return [sum((parts[number] for number in image), dark) for image in self.images]


def lights_of(graph: Graph) -> dict[tuple[int, str], int]:
    """Return the nodes of lights by parent and key, in the order of Mitsuba's ``scene.emitters()``.

    Mitsuba lists the scene's children in turn: lights, and shapes with theirs.
    """
    found = {}
    for key, value in graph.props(0).items():
        if not isinstance(value, Reference):
            continue
        index = value.index()
        kind = graph.kind(index)
        if kind == EMITTER:
            found[0, key] = index
        elif kind == SHAPE:
            found |= {(index, name): light for name, light in graph.emitters_of(index)}
    return found


class HybridImages:
    """The images between the textbook half as requested and the reference, each rendered once.

    Of each image there are ``replicates``, at least 3, with ``replicate_spp`` samples per pixel,
    and of a ``size`` of (width, height). ``scenes`` are in the reference's variant. Images are
    arrays (R, f H, f W, 3) of ``finer`` pixels, ``f`` per pixel in each direction. ``progress`` is
    called with the passes of :meth:`render`.
    """

    def __init__(
        self,
        pairs: Pairs,
        scenes: HybridScenes,
        replicates: int,
        replicate_spp: int,
        seed: int,
        size: tuple[int, int],
        progress: Progress | None = None,
    ) -> None:
        self.replicates = replicates
        self.replicate_spp = replicate_spp
        self.size = size
        self._pairs = pairs
        self._ready = pairs.ready
        self._seed = seed
        self._progress = progress
        self._variant = pairs.ready.reference.variant
        self._scenes = {self._variant: scenes}
        self._known: dict[frozenset[Effect], Floats] = {}
        self._emission: dict[tuple[str, Effect], Floats | None] = {}
        self._kernels: dict[frozenset[Effect], Floats] = {}
        self.effects = pairs.effects(scenes.differences)
        rfilter = scenes.scene.sensors()[0].film().rfilter()
        self.finer = FINER if "Box" in rfilter.class_name() else 1

    def render(self, sets: Iterable[Set[Effect]]) -> None:
        """Render the images of sets of effects, those of one scene at once.

        A scene is released before the next: each that is alive slows all others.
        """
        groups: dict[tuple[str, frozenset[Effect]], list[frozenset[Effect]]] = {}
        for simulated in dict.fromkeys(frozenset(simulated) - OF_KERNEL for simulated in sets):
            groups.setdefault(self._group(simulated), []).append(simulated)
        total = self.replicates * len(groups)
        before = 0

        def report(stage: str, done: int, _: int) -> None:
            if self._progress:
                self._progress(stage, before + done, total)

        # Sorted by variant: a change of it takes as long as a small image.
        for (name, _), group in sorted(groups.items(), key=lambda found: found[0][0]):
            # In one order of transports: scenes that differ only in data share a kernel.
            group.sort(
                key=lambda simulated: [
                    effect in simulated for effect in EFFECTS if effect not in IN_SCENE
                ]
            )
            with variant(name):
                self._known |= zip(group, self._rendered(group, report), strict=True)
            before += self.replicates

    def plugin(self, effects: Set[Effect]) -> Floats:
        """Return the image of Mitsuba's plugins in which some of ``effects`` are simulated.

        None has the kernel's terms; all are the scene of the reference, edited, which would show
        faults of the edits.
        """
        key = frozenset(effects) - OF_KERNEL
        if key not in self._known:
            self.render([key])
        return self._known[key]

    def simulating(self, effects: Set[Effect]) -> Floats:
        """Return the image in which some of ``effects`` are simulated; for none it is the kernel's.

        Where an effect is missing that only the kernel can do without, an image gets the difference
        that this makes in the kernel.
        """
        if not effects:
            return self.kernel
        found = self.plugin(effects)
        of_kernel = OF_KERNEL.intersection(self.effects)
        if of_kernel <= set(effects):
            return found
        return found + (self._kernel(of_kernel.intersection(effects)) - self.plain_kernel)

    def reference(self) -> Floats:
        """Render the reference (R, H, W, 3) with the same seeds: rays, often paths, are shared."""
        renderer = self._ready.reference.sampled(self._pass_spp)
        return self.pixels(self._passes(renderer)[0])

    @property
    def kernel(self) -> Floats:
        """The kernel as requested."""
        return self._kernel(frozenset())

    @property
    def plain_kernel(self) -> Floats:
        """The kernel with an exact normal at each point, and one intensity of each light."""
        return self._kernel(OF_KERNEL.intersection(self.effects))

    def _kernel(self, effects: frozenset[Effect]) -> Floats:
        """Return the image of the kernel with some of :data:`OF_KERNEL`."""
        pairs = self._pairs
        scene = self._ready.heuristic.scene
        if effects not in self._kernels:
            with variant(pairs.heuristic_variant):
                if effects:
                    is_smooth = POLYGONS in effects
                    pair = pairs.plain() if is_smooth else pairs.of(pairs.options.polygon_shading)
                    graph = with_sampler(pair.heuristic, self._ready.plan.sampler)
                    if ONE_INTENSITY in effects:
                        lights.give_one_intensity(graph)
                    scene = graph.instantiate()
                renderer = Renderer(
                    scene, None, pass_spp=self._pass_spp, label="image of the kernel"
                )
                (self._kernels[effects],) = self._passes(renderer)
        return self._kernels[effects]

    def _group(self, effects: frozenset[Effect]) -> tuple[str, frozenset[Effect]]:
        """Return the variant and what all images of one rendering have in common."""
        is_current = SPECTRAL in effects or SPECTRAL not in self.effects
        name = self._variant if is_current else self._pairs.heuristic_variant
        scenes = self._scenes[self._variant]
        # Only the first image has the weight that the camera gives to light.
        is_weighted = "spectral" in name or scenes.facts.camera.plugin not in UNWEIGHTED
        return name, effects if is_weighted else scenes.rendered_alike(effects)

    def _rendered(self, sets: Sequence[frozenset[Effect]], progress: Progress) -> list[Floats]:
        """Render images of one scene, in their variant, which is current."""
        if mi.variant() not in self._scenes:
            pair = self._pairs.plain()
            physical = with_sampler(pair.physical, self._ready.plan.sampler).instantiate()
            self._scenes[mi.variant()] = HybridScenes(pair, self._ready.plan, physical)
        scenes = self._scenes[mi.variant()]
        parts = scenes.transport(sets, self._pass_spp)
        transported = self._passes(parts.renderer, parts.count, progress)
        images = []
        for simulated, image in zip(sets, parts.added(transported), strict=True):
            left_out = (effect for effect in IN_EMISSION if effect not in simulated)
            shining = (self._emitted(scenes, effect) for effect in left_out)
            images.append(sum((light for light in shining if light is not None), image))
        return images

    def _emitted(self, scenes: HybridScenes, effect: GlowingEffect) -> Floats | None:
        """Return what shines of itself without an effect, in this variant; None if nothing does."""
        key = mi.variant(), effect
        if key not in self._emission:
            renderer = scenes.emission(effect, self._pass_spp)
            self._emission[key] = self._passes(renderer)[0] if renderer else None
        return self._emission[key]

    @property
    def _pass_spp(self) -> int:
        return self.replicate_spp // self.finer**2

    def _passes(
        self, renderer: Renderer, count: int = 1, progress: Progress | None = None
    ) -> list[Floats]:
        """Render the replicates on a film of the preview's size.

        The channels of a pass are those of ``count`` images.
        """
        width, height = self.size
        size = self.finer * width, self.finer * height
        loop = passes(
            [renderer], self._seed, self.replicates, size=size, stream=Stream.REPLICATES,
            progress=progress, stage=CAUSES,
        )  # fmt: skip
        # (R, f H, f W, 3 count): the channels of an image are neighbours.
        made = np.stack([np.array(rendered[0]) for rendered in loop])
        # An image in grey has one channel.
        return [
            np.broadcast_to(image, (*image.shape[:3], 3)) for image in np.split(made, count, axis=3)
        ]

    def pixels(self, fine: Floats) -> Floats:
        """Return the images (R, H, W, 3): means over blocks of finer pixels."""
        width, height = self.size
        blocks = fine.reshape(len(fine), height, self.finer, width, self.finer, 3)
        means: Floats = blocks.mean(axis=(2, 4))
        return means

    def previews(
        self, sets: Iterable[Set[Effect]], clean: tuple[Floats, Floats] | None = None
    ) -> list[NDArray[np.float64]]:
        """Return the means (f H, f W, 3) of images' replicates, with less noise if possible.

        ``clean`` are the reference (H', W', 3) on a film of at least the preview's size, and its
        standard error. All images share camera rays and paths, so what the whole plan's replicates
        F deviate from the clean C tells part of the noise of an image X (a control variate)::

            X - beta (F - C),  beta = cor(X, F) sqrt(var X / (var F + var C))

        with the correlation over :data:`NEAR` pixels around each one, and variances over 3.
        """
        from scipy.ndimage import uniform_filter

        images = [self.simulating(simulated) for simulated in sets]
        full = self.simulating(frozenset(self.effects))
        count, height, width, _ = full.shape
        if clean is None or self.finer == 1 or len(clean[0]) < height:
            return [simulated.mean(axis=0) for simulated in images]
        # The clean reference at this size: the mean of n pixels has their error over √n.
        picture = averaged(clean[0], (height, width))
        error = averaged(clean[1], (height, width))
        error *= np.sqrt(height * width / clean[1][..., 0].size)

        def covariance(first: Floats, other: Floats) -> NDArray[np.float64]:
            covariances: NDArray[np.float64] = (first * other).sum(axis=0).mean(axis=-1) / (
                count * (count - 1)
            )
            return covariances

        def deviation(centred: Floats) -> NDArray[np.float64]:
            deviations: NDArray[np.float64] = np.sqrt(
                np.maximum(uniform_filter(covariance(centred, centred), 3), 0)
            )
            return deviations

        # F − C, and the deviations of F alone and of both.
        beyond = full.mean(axis=0) - picture
        other = full - full.mean(axis=0)
        known = deviation(other)
        unknown = np.hypot(known, error.mean(axis=-1))
        quiet = []
        for simulated in images:
            mean = simulated.mean(axis=0)
            noise = deviation(simulated - mean)
            alike = ratio(covariance(simulated - mean, other), noise * known)
            beta = ratio(uniform_filter(alike, NEAR).clip(-1, 1) * noise, unknown)
            quiet.append(mean - beta[..., None] * beyond)
        return quiet
