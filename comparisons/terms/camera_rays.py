"""Camera rays through the centres of pixels."""

from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray


def rays(scene: Any, resolution: tuple[int, int], x: NDArray, y: NDArray) -> mi.Ray3f:
    """Return the rays through the centres of pixels, arrays of columns and rows."""
    width, height = resolution
    film = mi.Point2f(mi.Float((np.ravel(x) + 0.5) / width), mi.Float((np.ravel(y) + 0.5) / height))
    return scene.sensors()[0].sample_ray(0.0, 0.5, film, mi.Point2f(0.5))[0]
