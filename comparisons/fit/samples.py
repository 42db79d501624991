"""The surface that the camera sees, sample by sample, on which a fit evaluates the kernel.

Geometry does not change while parameters are fitted. So it is kept
(:mod:`comparisons.fit.recorder`), and an image costs one call of the kernel, without a ray.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from heuristic.arrays import Array, Colour, Direction, Mask, Position
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
        ``{name: colours (N samples)}`` of the coefficients that vary over the surface.
    visible
        One mask (N samples) for each light, in the kernel's order; empty if nothing is hidden.
    """

    position: Position
    normal: Direction
    view: Direction
    pixel: np.ndarray
    textures: dict[str, Colour] = field(default_factory=dict)
    visible: tuple[Mask, ...] = ()

    def shadow_test(self) -> Callable[[Any, Any], Mask] | None:
        """Return the ``visible`` of :func:`heuristic.shade` for one call: the masks in turn."""
        masks = iter(self.visible)
        return (lambda toward, distance: next(masks)) if self.visible else None


@dataclass(frozen=True)
class Surface:
    """All of an image of the heuristic half but its parameters.

    Attributes
    ----------
    names
        Of the materials.
    materials
        The paired materials, in plain numbers; a coefficient that varies over the surface is 1, a
        factor on its texture.
    samples
        Of each material.
    lights, ambient
        See :func:`heuristic.shade`.
    fixed
        (H W, 3), the light that no parameter changes: emission (8.1) and background.
    samples_per_pixel
        Over all passes; a pixel is their mean (box filter).
    """

    names: tuple[str, ...]
    materials: tuple[Material, ...]
    samples: tuple[Samples, ...]
    lights: tuple[Any, ...]
    ambient: Colour
    fixed: np.ndarray
    samples_per_pixel: int

    def within(self, counted: NDArray[np.bool_]) -> "Surface":
        """Return the part of the surface in a mask (H W) of pixels, pixels renumbered."""
        places = np.cumsum(counted) - 1
        samples = []
        for part in self.samples:
            index = mi.UInt32(np.flatnonzero(counted[part.pixel]))
            samples.append(
                Samples(
                    **{key: gathered(getattr(part, key), index) for key in VECTORS},
                    pixel=places[part.pixel[np.array(index)]],
                    textures={key: gathered(value, index) for key, value in part.textures.items()},
                    visible=tuple(gathered(mask, index) for mask in part.visible),
                )
            )
        return replace(self, samples=tuple(samples), fixed=self.fixed[counted])

    def pixels(self, samples: Samples, values: Colour) -> NDArray[np.float64]:
        """Return the image (H W, 3) of one value for each sample of a material."""
        values = np.broadcast_to(
            np.atleast_2d(np.array(values, np.float64)), (3, len(samples.pixel))
        )
        count = len(self.fixed)
        sums = [np.bincount(samples.pixel, channel, count) for channel in values]
        return np.stack(sums, axis=1) / self.samples_per_pixel


def gathered(values: Array, index: Array) -> Array:
    """Return the samples of a Dr.Jit array with the given indices."""
    return dr.gather(type(values), values, index)
