"""The surface that the camera sees, sample by sample: what a fit evaluates the kernel on.

Geometry does not change while parameters are fitted. So it is kept
(:mod:`comparisons.fit.recorder`), and an image costs one call of the kernel, without a ray.
"""

from dataclasses import dataclass, field, replace

import drjit as dr
import mitsuba as mi
import numpy as np

from heuristic.materials import Material

VECTORS = ("position", "normal", "view")


@dataclass(frozen=True)
class Samples:
    """The samples that see one material from the side that is shaded.

    Attributes
    ----------
    position, normal, view
        Dr.Jit arrays of three components, N samples: arguments of :func:`heuristic.shade`.
    pixel
        (N,), the index of each sample's pixel in reading order.
    textures
        Colours (N samples) of the coefficients that vary over the surface, under their names.
    visible
        One mask (N samples) for each light, in the kernel's order; empty where nothing is hidden.
    """

    position: object
    normal: object
    view: object
    pixel: np.ndarray
    textures: dict = field(default_factory=dict)
    visible: tuple = ()

    def shadow_test(self):
        """Return the ``visible`` of :func:`heuristic.shade` for one call: the masks in turn."""
        masks = iter(self.visible)
        return (lambda toward, distance: next(masks)) if self.visible else None


@dataclass(frozen=True)
class Surface:
    """All that an image of the heuristic half is made of, but for its parameters.

    Attributes
    ----------
    names
        Of the materials.
    materials
        :class:`heuristic.Material` of each, as paired, in plain numbers; a coefficient that varies
        over the surface is 1, and stands for a factor on its texture.
    samples
        :class:`Samples` of each material.
    lights, ambient
        See :func:`heuristic.shade`.
    fixed
        (H W, 3), what no parameter changes: emission (8.1) and background.
    samples_a_pixel
        Over all passes; a pixel is the mean of them (box filter).
    """

    names: tuple[str, ...]
    materials: tuple[Material, ...]
    samples: tuple[Samples, ...]
    lights: tuple
    ambient: object
    fixed: np.ndarray
    samples_a_pixel: int

    def within(self, counted):
        """Return the part of the surface that a mask (H W) of pixels counts, pixels renumbered."""
        places = np.cumsum(counted) - 1
        samples = []
        for part in self.samples:
            index = mi.UInt32(np.flatnonzero(counted[part.pixel]))
            samples.append(
                Samples(
                    *(gathered(getattr(part, key), index) for key in VECTORS),
                    pixel=places[part.pixel[np.array(index)]],
                    textures={key: gathered(value, index) for key, value in part.textures.items()},
                    visible=tuple(gathered(mask, index) for mask in part.visible),
                )
            )
        return replace(self, samples=tuple(samples), fixed=self.fixed[counted])

    def pixels(self, samples, values):
        """Return the image (H W, 3) of one value for each sample of a material."""
        values = np.broadcast_to(
            np.atleast_2d(np.array(values, np.float64)), (3, len(samples.pixel))
        )
        count = len(self.fixed)
        sums = [np.bincount(samples.pixel, channel, count) for channel in values]
        return np.stack(sums, axis=1) / self.samples_a_pixel


def gathered(values, index):
    """Return the samples of a Dr.Jit array with the given numbers."""
    return dr.gather(type(values), values, index)
