"""Which object of a scene carries a change."""

from __future__ import annotations

from dataclasses import dataclass

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from reference.rendering.gbuffer import camera_rays, image_size

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Seen:
    """What each pixel sees: the place (H, W) of a shape's name in `names`, -1 for none."""

    names: tuple[str, ...]
    places: NDArray[np.int64]

    def carried(self, change: Array) -> dict[str, float]:
        """Return the share that each shape has of a change (H, W) ≥ 0, the largest first.

        What no shape is seen for is left out; a change of nothing has no shares.
        """
        total = change.sum()
        if not total > 0.0:
            return {}
        shares = {
            name: float(change[self.places == place].sum() / total)
            for place, name in enumerate(self.names)
        }
        ordered = sorted(shares.items(), key=lambda item: -item[1])
        return {name: share for name, share in ordered if share > 0.0}


def seen(scene: mi.Scene) -> Seen:
    """Trace a ray through the centre of each pixel of a scene's first sensor."""
    width, height = image_size(scene)
    met = scene.ray_intersect(camera_rays(scene, width, height)).shape
    places = np.full(width * height, -1)
    names = []
    for shape in scene.shapes():
        places[np.array(met == mi.ShapePtr(shape))] = len(names)
        names.append(shape.id())
    return Seen(tuple(names), places.reshape(height, width))
