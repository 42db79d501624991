"""Replicated renderings of the scenes between the halves, remembered by what they simulate.

Every image is rendered in a few replicates, each with a seed of its own, which all images share: so
that differences between images keep little noise, and the spread of the replicates tells how much.
"""

from dataclasses import dataclass
from functools import cached_property

import mitsuba as mi
import numpy as np

from comparisons.effects.between import Between
from heuristic.interpolation import Interpolation
from reference.effects import EFFECTS
from reference.effects.kernel_terms import POLYGONS, SPECTRAL
from reference.rendering.passes import Stream, passes
from reference.rendering.renderer import Renderer, variant
from reference.scene.sampler import with_sampler

KERNEL, PLAIN_KERNEL, REFERENCE = "kernel", "kernel with Phong interpolation", "reference"


@dataclass(frozen=True)
class Replicates:
    """The replicates of one image: (R, H, W, 3), and the seconds that each but the first took."""

    images: np.ndarray
    seconds: np.ndarray


class Lattice:
    """All images between the heuristic half as asked for and the reference.

    Parameters
    ----------
    options
        As of :func:`comparisons.compare.compare`.
    methods : comparisons.cost.methods.Methods
        What has the scene, its pairs, and the scenes between.
    replicates
        Of each image, at least 3. The first compiles: its image counts, its time does not.
    spp
        Samples a pixel of each replicate.
    seed
        Of the study.
    size
        Width and height to render in place of the film's; None leaves them.
    """

    def __init__(self, options, methods, replicates, spp, seed, size=None):
        self.ready, self.replicates = methods.ready, replicates
        self.spp, self.seed, self.size = spp, seed, size
        self.variant = self.ready.reference.variant
        self.heuristic_variant = methods.heuristic_variant
        self._options, self._pairs = options, methods.pairs
        self._between = {self.variant: methods.between}
        self._known, self._glows = {}, {}

    @cached_property
    def effects(self):
        """The effects in which the heuristic half as asked for differs from the reference."""
        options = self._options
        found = set(self._between[self.variant].differences)
        if options.interpolation is not Interpolation.PHONG or options.tessellation is not None:
            found.add(POLYGONS)
        if self.heuristic_variant != self.variant:
            found.add(SPECTRAL)
        return tuple(effect for effect in EFFECTS if effect in found)

    def render(self, wanted):
        """Render what is not known yet, image by image.

        Not in turn: every scene that is alive slows all others, since Dr.Jit traces its BSDFs too.

        Parameters
        ----------
        wanted
            :data:`KERNEL`, :data:`PLAIN_KERNEL`, :data:`REFERENCE`, or sets of effects.
        """
        wanted = [key for key in dict.fromkeys(wanted) if key not in self._known]
        for name, keys in self._by_variant(wanted).items():
            with variant(name):
                for key in keys:
                    self._known[key] = self._replicates(key)
        for between in self._between.values():
            between.forget()

    def of(self, key):
        """Return the :class:`Replicates` of one of the images that :meth:`render` knows."""
        self.render([key])
        return self._known[key]

    def simulating(self, effects):
        """Return the image in which some of :attr:`effects` are simulated.

        None of them is the kernel as asked for, all of them the reference. Flat and Gouraud shading
        exist in the kernel alone: where they stay, an image gets the difference that they make
        there.
        """
        effects = frozenset(effects)
        if not effects:
            return self.of(KERNEL)
        if effects == frozenset(self.effects):
            return self.of(REFERENCE)
        if POLYGONS not in self.effects or POLYGONS in effects:
            return self.of(effects - {POLYGONS})
        found, kernels = self.of(effects), [self.of(key) for key in (KERNEL, PLAIN_KERNEL)]
        return Replicates(
            found.images + (kernels[0].images - kernels[1].images),
            found.seconds + (kernels[0].seconds - kernels[1].seconds),
        )

    def needed(self, effects):
        """Return what :meth:`simulating` needs rendered for a set of effects."""
        if not effects:
            return [KERNEL]
        if frozenset(effects) == frozenset(self.effects):
            return [REFERENCE]
        kernels = [KERNEL, PLAIN_KERNEL] if POLYGONS in self.effects else []
        return [*kernels, frozenset(effects) - {POLYGONS}]

    @property
    def grafted(self):
        """What renders all effects as they are grafted onto the heuristic half, for the closure."""
        if not self.effects:
            return KERNEL
        return frozenset(self.effects) - {POLYGONS}

    def _by_variant(self, keys):
        """Group keys by the variant that renders them, equal scenes next to each other."""
        groups = {}
        for key in keys:
            groups.setdefault(self._variant_of(key), []).append(key)
        return {name: sorted(group, key=self._scene_name) for name, group in groups.items()}

    def _variant_of(self, key):
        if key == REFERENCE:
            return self.variant
        if key in (KERNEL, PLAIN_KERNEL):
            return self.heuristic_variant
        is_current = SPECTRAL in key or SPECTRAL not in self.effects
        return self.variant if is_current else self.heuristic_variant

    def _scene_name(self, key):
        if isinstance(key, str):
            return key
        scene = self._between[self.variant].scene_key(key)
        return " ".join(sorted(effect.label for effect in scene))

    def _replicates(self, key):
        """Render an image in the current variant, which is its own."""
        if isinstance(key, str):
            return Replicates(*self._passes(self._end(key)))
        between = self._between_here()
        images, seconds = self._passes(between.travelling(key, self.spp))
        # What a camera ray meets shows its emission at next to no cost in one rendering of both.
        return Replicates(images + self._glow(between, key), seconds)

    def _end(self, key):
        """Return what renders one of the images that are a half, or nearly."""
        ready = self.ready
        if key == REFERENCE:
            return Renderer(ready.scene, ready.reference.integrator, self.spp, "reference image")
        if key == KERNEL:
            return Renderer(ready.heuristic.scene, None, self.spp, "image of the kernel")
        graph = with_sampler(self._pairs.plain().heuristic, ready.plan.sampler)
        return Renderer(graph.instantiate(), None, self.spp, "image of the kernel")

    def _glow(self, between, key):
        """Return the replicates of what glows, which several images share."""
        glow = mi.variant(), between.glow_key(key)
        if glow not in self._glows:
            renderer = between.glowing(key, self.spp)
            self._glows[glow] = self._passes(renderer)[0] if renderer else np.float32(0)
        return self._glows[glow]

    def _passes(self, renderer):
        renderer.size = self.size
        loop = passes([renderer], self.seed, self.replicates, stream=Stream.REPLICATES)
        images = [np.array(one.images[0]) for one in loop]
        return np.stack(images), np.array(renderer.times[1:])

    def _between_here(self):
        if mi.variant() not in self._between:
            pair = self._pairs.plain()
            physical = with_sampler(pair.physical, self.ready.plan.sampler).instantiate()
            self._between[mi.variant()] = Between(pair, self.ready.plan, physical)
        return self._between[mi.variant()]
