"""Replicated renderings of the scenes between the halves, remembered by what they simulate.

Every image is rendered in a few replicates, each with a seed of its own, which all images share: so
that differences between images keep little noise, and the spread of the replicates tells how much.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from comparisons.cost.between import Between
from heuristic.interpolation import Interpolation
from reference import halves
from reference.effects import Effect
from reference.halves import with_sampler
from reference.rendering import Renderer, variant

REPLICATES = 4

KERNEL, PLAIN_KERNEL, REFERENCE = "kernel", "kernel with Phong interpolation", "reference"


@dataclass(frozen=True)
class Replicates:
    """The replicates of one image: (R, H, W, 3), and the seconds that each took."""

    images: np.ndarray
    seconds: np.ndarray


class Lattice:
    """All images between the heuristic half as asked for and the reference.

    Parameters
    ----------
    source, options
        As of :func:`comparisons.compare.compare`.
    ready : comparisons.compare.Prepared
        The scene, paired and planned.
    between : Between
        The scenes between, in the reference's variant.
    spp
        Samples a pixel of each replicate.
    seed
        Of the first replicate; one before it warms up.
    """

    def __init__(self, source, options, ready, between, spp, seed):
        self.ready, self.spp, self.seed = ready, spp, seed
        self.variant = ready.reference.variant
        self.heuristic_variant = options.heuristic_variant or self.variant
        self._source, self._options = source, options
        self._between = {self.variant: between}
        self._known = {}

    @cached_property
    def effects(self):
        """The effects in which the heuristic half as asked for differs from the reference."""
        options = self._options
        found = set(self._between[self.variant].differences)
        if options.interpolation is not Interpolation.PHONG or options.tessellation is not None:
            found.add(Effect.POLYGONS)
        if self.heuristic_variant != self.variant:
            found.add(Effect.SPECTRAL)
        return tuple(effect for effect in Effect if effect in found)

    def render(self, wanted):
        """Render what is not known yet, in turn.

        Parameters
        ----------
        wanted
            :data:`KERNEL`, :data:`PLAIN_KERNEL`, :data:`REFERENCE`, or sets of effects.
        """
        wanted = [key for key in dict.fromkeys(wanted) if key not in self._known]
        renderers = {key: self._renderer(key) for key in wanted}
        images = {key: [] for key in wanted}
        for number in range(REPLICATES + 1):
            for key, renderer in renderers.items():
                image = renderer.render(self.seed + number)
                if number:
                    images[key].append(np.array(image))
        for key, renderer in renderers.items():
            self._known[key] = Replicates(np.stack(images[key]), np.array(renderer.times[1:]))

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
        if Effect.POLYGONS not in self.effects or Effect.POLYGONS in effects:
            return self.of(effects - {Effect.POLYGONS})
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
        kernels = [KERNEL, PLAIN_KERNEL] if Effect.POLYGONS in self.effects else []
        return [*kernels, frozenset(effects) - {Effect.POLYGONS}]

    def _renderer(self, key):
        if key == REFERENCE:
            return Renderer(
                self.ready.scene, self.ready.reference.integrator, self.spp, "reference image"
            )
        if key == KERNEL:
            return self._kernel(self._options)
        if key == PLAIN_KERNEL:
            plain = replace(self._options, interpolation=Interpolation.PHONG, tessellation=None)
            return self._kernel(plain)
        is_current = Effect.SPECTRAL in key or Effect.SPECTRAL not in self.effects
        return self._in_variant(self.variant if is_current else self.heuristic_variant, key)

    def _kernel(self, options):
        with variant(self.heuristic_variant):
            pair = _pair(self._source, options)
            scene = with_sampler(pair.heuristic, self.ready.plan.sampler).instantiate()
            return Renderer(scene, None, self.spp, "image of the kernel")

    def _in_variant(self, name, effects):
        with variant(name):
            if name not in self._between:
                plain = replace(self._options, interpolation=Interpolation.PHONG, tessellation=None)
                self._between[name] = Between(_pair(self._source, plain), self.ready.plan)
            return self._between[name].renderer(effects, self.spp)


def _pair(source, options):
    return halves.pair(
        source,
        options.convention,
        options.resolution,
        options.interpolation,
        options.tessellation,
        prune=not options.everything,
    )
