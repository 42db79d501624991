"""Replicated renderings of the scenes between the halves, remembered by what they simulate.

Every image is rendered in a few replicates, each with a seed of its own, which all images share: so
that differences between images keep little noise, and the spread of the replicates tells how much.

A box filter allows a preview at no cost: the film has more and smaller pixels, each with fewer
samples, and the mean over a block of them is the pixel that the larger film would have.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import mitsuba as mi
import numpy as np

from comparisons.effects.between import Between
from heuristic.interpolation import Interpolation
from reference.effects import EFFECTS
from reference.effects.kernel_terms import POLYGONS, SPECTRAL
from reference.rendering.gbuffer import image_size, resize
from reference.rendering.passes import Stream, passes
from reference.rendering.renderer import Renderer, variant
from reference.scene.sampler import with_sampler

KERNEL, PLAIN_KERNEL, REFERENCE = "kernel", "kernel with Phong interpolation", "reference"


PREVIEW = 192
"""Pixels of a preview's longer side, at most."""

LEAST_SPP = 4
"""Samples per pixel of a preview's replicate, at least: fewer are not stratified."""


@dataclass(frozen=True)
class Replicates:
    """The replicates of one image.

    Attributes
    ----------
    images
        (R, H, W, 3).
    seconds
        What each but the first took.
    preview
        (f H, f W, 3): the mean of all in finer pixels, ``f`` in each direction for one of theirs.
    """

    images: np.ndarray
    seconds: np.ndarray
    preview: np.ndarray

    def __add__(self, other):
        return self._with(other, np.add)

    def __sub__(self, other):
        return self._with(other, np.subtract)

    def _with(self, other, operation):
        return Replicates(*map(operation, vars(self).values(), vars(other).values()))


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
        self.spp, self.seed = spp, seed
        self.variant = self.ready.reference.variant
        self.heuristic_variant = methods.heuristic_variant
        self._options, self._pairs = options, methods.pairs
        self._between = {self.variant: methods.between}
        self._known, self._glows = {}, {}
        self._film = image_size(self.ready.scene)
        self._size = size or self._film

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
        return self.of(effects) + (self.of(KERNEL) - self.of(PLAIN_KERNEL))

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
            return self._passes(self._end(key))
        between = self._between_here()
        found = self._passes(between.travelling(key, self._finer_spp))
        glow = self._glow(between, key)
        return found + glow if glow else found

    def _end(self, key):
        """Return what renders one of the images that are a half, or nearly."""
        ready = self.ready
        if key == REFERENCE:
            integrator = ready.reference.integrator
            return Renderer(ready.scene, integrator, self._finer_spp, "reference image")
        if key == KERNEL:
            return Renderer(ready.heuristic.scene, None, self._finer_spp, "image of the kernel")
        graph = with_sampler(self._pairs.plain().heuristic, ready.plan.sampler)
        return Renderer(graph.instantiate(), None, self._finer_spp, "image of the kernel")

    def _glow(self, between, key):
        """Return the replicates of what glows, which several images share."""
        glow = mi.variant(), between.glow_key(key)
        if glow not in self._glows:
            renderer = between.glowing(key, self._finer_spp)
            # What a camera ray meets shows its emission at next to no cost in a rendering of both.
            self._glows[glow] = renderer and replace(self._passes(renderer), seconds=np.float64(0))
        return self._glows[glow]

    @cached_property
    def finer(self):
        """Pixels of a preview in each direction for one of an image."""
        film, factor = self.ready.scene.sensors()[0].film(), 1
        if "Box" not in film.rfilter().class_name():
            return factor
        while (
            2 * factor * max(self._size) <= PREVIEW and self.spp % (4 * factor**2 * LEAST_SPP) == 0
        ):
            factor *= 2
        return factor

    @property
    def _finer_spp(self):
        return self.spp // self.finer**2

    def _passes(self, renderer):
        """Render the replicates on a film of the preview's size, which goes back to its own."""
        renderer.size = tuple(self.finer * side for side in self._size)
        loop = passes([renderer], self.seed, self.replicates, stream=Stream.REPLICATES)
        images = np.stack([np.array(one.images[0]) for one in loop])
        resize(renderer.scene, self._film)
        seconds = np.array(renderer.times[1:])
        return Replicates(_blocks(images, self.finer), seconds, images.mean(axis=0))

    def _between_here(self):
        if mi.variant() not in self._between:
            pair = self._pairs.plain()
            physical = with_sampler(pair.physical, self.ready.plan.sampler).instantiate()
            self._between[mi.variant()] = Between(pair, self.ready.plan, physical)
        return self._between[mi.variant()]


def _blocks(images, side):
    """Return the means (R, H, W, 3) over square blocks of pixels."""
    count, height, width, channels = images.shape
    shape = count, height // side, side, width // side, side, channels
    return images.reshape(shape).mean(axis=(2, 4))
