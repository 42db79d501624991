"""Replicated renderings of the scenes between the halves, cached by what they simulate.

Every image is rendered in a few replicates, each with its own seed, which all images share. So
differences between images keep little noise, and the spread of the replicates measures it.

A box filter gives a preview at no cost: the film has more and smaller pixels, each with fewer
samples, and the mean over a block of them is the pixel that the coarser film would have.
"""

from collections.abc import Callable, Iterable, Set
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from comparisons.cost.methods import Methods
from comparisons.effects.between import Between
from comparisons.options import Options
from heuristic.arrays import Scene
from heuristic.interpolation import Interpolation
from reference.effects import EFFECTS
from reference.effects.effect import Effect
from reference.effects.kernel_terms import POLYGONS, SPECTRAL
from reference.rendering.gbuffer import image_size, resize
from reference.rendering.passes import Stream, passes
from reference.rendering.renderer import Renderer, variant
from reference.scene.sampler import with_sampler

KERNEL, PLAIN_KERNEL, REFERENCE = "kernel", "kernel with Phong interpolation", "reference"

Key = str | frozenset[Effect]
"""An image: one of the three names above, or the effects that it simulates."""

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
        Time of each but the first.
    preview
        (f H, f W, 3): the mean of all in finer pixels, ``f`` per pixel in each direction.
    """

    images: np.ndarray
    seconds: np.ndarray
    preview: np.ndarray

    def __add__(self, other: Self) -> Self:
        return self._with(other, np.add)

    def __sub__(self, other: Self) -> Self:
        return self._with(other, np.subtract)

    def _with(self, other: Self, operation: Callable[..., NDArray]) -> Self:
        return type(self)(*map(operation, vars(self).values(), vars(other).values()))


class Lattice:
    """All images between the heuristic half as requested and the reference.

    Parameters
    ----------
    options
        See :func:`comparisons.compare.compare`.
    methods
        The scene, its pairs, and the scenes between.
    replicates
        Of each image, at least 3. The first compiles: its image counts, its time does not.
    spp
        Samples per pixel of each replicate.
    seed
        Of the study.
    size
        Width and height to render; the film's if omitted.
    """

    def __init__(
        self,
        options: Options,
        methods: Methods,
        replicates: int,
        spp: int,
        seed: int,
        size: tuple[int, int] | None = None,
    ):
        self.ready, self.replicates = methods.ready, replicates
        self.spp, self.seed = spp, seed
        self.variant = self.ready.reference.variant
        self.heuristic_variant = methods.heuristic_variant
        self._options, self._pairs = options, methods.pairs
        self._between = {self.variant: methods.between}
        self._known: dict[Key, Replicates] = {}
        self._glows: dict[tuple[str, Key], Replicates | None] = {}
        self._film = image_size(self.ready.scene)
        self._size = size or self._film
        self._finer_spp = spp // self.finer**2

    @cached_property
    def effects(self) -> tuple[Effect, ...]:
        """The effects in which the heuristic half as requested differs from the reference."""
        options = self._options
        found = set(self._between[self.variant].differences)
        if options.interpolation is not Interpolation.PHONG or options.tessellation is not None:
            found.add(POLYGONS)
        if self.heuristic_variant != self.variant:
            found.add(SPECTRAL)
        return tuple(effect for effect in EFFECTS if effect in found)

    def render(self, keys: Iterable[Key]) -> None:
        """Render what is not cached, image by image: every scene that is alive slows all others."""
        missing = [key for key in dict.fromkeys(keys) if key not in self._known]
        for name, group in self._by_variant(missing).items():
            with variant(name):
                for key in group:
                    self._known[key] = self._replicates(key)
        for between in self._between.values():
            between.forget()

    def of(self, key: Key) -> Replicates:
        """Return the replicates of an image."""
        self.render([key])
        return self._known[key]

    def simulating(self, effects: Set[Effect]) -> Replicates:
        """Return the image in which some of ``effects`` are simulated.

        None is the kernel as requested, all are the reference. Only the kernel has flat and Gouraud
        shading; where they remain, an image gets the difference that they make there.
        """
        effects = frozenset(effects)
        if not effects:
            return self.of(KERNEL)
        if effects == frozenset(self.effects):
            return self.of(REFERENCE)
        if POLYGONS not in self.effects or POLYGONS in effects:
            return self.of(effects - {POLYGONS})
        return self.of(effects) + (self.of(KERNEL) - self.of(PLAIN_KERNEL))

    def needed(self, effects: Set[Effect]) -> list[Key]:
        """Return the images that :meth:`simulating` needs for a set of effects."""
        if not effects:
            return [KERNEL]
        if frozenset(effects) == frozenset(self.effects):
            return [REFERENCE]
        kernels = [KERNEL, PLAIN_KERNEL] if POLYGONS in self.effects else []
        return [*kernels, frozenset(effects) - {POLYGONS}]

    @property
    def grafted(self) -> Key:
        """The image with all effects grafted onto the heuristic half, for the closure."""
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
        if isinstance(key, str):
            return self.variant if key == REFERENCE else self.heuristic_variant
        is_current = SPECTRAL in key or SPECTRAL not in self.effects
        return self.variant if is_current else self.heuristic_variant

    def _scene_name(self, key):
        if isinstance(key, str):
            return key
        scene = self._between[self.variant].scene_key(key)
        return " ".join(sorted(effect.label for effect in scene))

    def _replicates(self, key):
        """Render an image in its variant, which is current."""
        if isinstance(key, str):
            return self._passes(self._end(key))
        between = self._between_here()
        found = self._passes(between.travelling(key, self._finer_spp))
        glow = self._glow(between, key)
        return found + glow if glow else found

    def _end(self, key):
        """Return the renderer of an image that is a half, or nearly."""
        ready, spp = self.ready, self._finer_spp
        if key == REFERENCE:
            return Renderer(ready.scene, ready.reference.integrator, spp, "reference image")
        scene = ready.heuristic.scene
        if key == PLAIN_KERNEL:
            scene = with_sampler(self._pairs.plain().heuristic, ready.plan.sampler).instantiate()
        return Renderer(scene, None, spp, "image of the kernel")

    def _glow(self, between, key):
        """Return the replicates of the glow, which several images share."""
        glow = mi.variant(), between.glow_key(key)
        if glow not in self._glows:
            renderer = between.glowing(key, self._finer_spp)
            # Rendered with the rest, emission would cost next to nothing.
            self._glows[glow] = renderer and replace(self._passes(renderer), seconds=np.float64(0))
        return self._glows[glow]

    @cached_property
    def finer(self) -> int:
        """Pixels of a preview per pixel of an image, in each direction."""
        scene: Scene = self.ready.scene
        factor, even = 1, 4 * LEAST_SPP
        if "Box" not in scene.sensors()[0].film().rfilter().class_name():
            return factor
        while 2 * factor * max(self._size) <= PREVIEW and self.spp % (even * factor**2) == 0:
            factor *= 2
        return factor

    def _passes(self, renderer):
        """Render the replicates on a film of the preview's size, then restore the film's."""
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
