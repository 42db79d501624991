"""The origins of camera rays: a set of points, not one.

A perspective camera's rays begin on its near clip plane, those of a thin lens on that plane too,
and those of an orthographic camera on a plane as wide as the picture. If the set is unknown, as for
a sensor on a shape, no rule may rely on the camera's position.
"""

from dataclasses import dataclass

import mitsuba as mi
import numpy as np

PLANAR = ("perspective", "thinlens", "orthographic")
"""Sensors whose rays begin in one plane, within the convex hull of those at the film's corners and
the lens's edge."""

EDGE = 8
"""Points along each side of the square that maps to the lens."""

MARGIN = 1.05
"""Widens the polygon of points on a lens's edge until it holds the disk, with rounding."""


@dataclass(frozen=True)
class CameraFacts:
    """The origins of the rays of the scene's camera.

    Attributes
    ----------
    plugin
        Plugin of the sensor.
    origins
        Corners of a convex set that holds all origins, (N, 3); None if unknown.
    axis
        Unit normal of the plane that the set lies in, (3,).
    is_still
        Whether the shutter opens only for an instant.
    """

    plugin: str
    origins: np.ndarray | None
    axis: np.ndarray | None
    is_still: bool

    def is_outside(self, corners: np.ndarray) -> bool:
        """Return whether all rays certainly begin outside a box, given its corners (8, 3).

        Two convex sets are apart if a plane lies between them; it tries planes along the axes and
        along the camera's own.
        """
        if self.origins is None:
            return False
        for direction in (*np.eye(3), self.axis):
            box, begin = corners @ direction, self.origins @ direction
            gap = max(box.min() - begin.max(), begin.min() - box.max())
            if gap > 1e-6 * max(np.abs(box).max(), np.abs(begin).max()):
                return True
        return False


def camera_of(plugin: str, sensors: list[mi.Sensor]) -> CameraFacts:
    """Return the facts of a scene's camera; with several sensors nothing is known."""
    if len(sensors) != 1:
        return CameraFacts(plugin, None, None, False)
    (sensor,) = sensors
    is_still = sensor.shutter_open_time() == 0
    if plugin not in PLANAR:
        return CameraFacts(plugin, None, None, is_still)
    film = sensor.film()
    border = 0.0
    if film.sample_border():
        border = film.rfilter().border_size() / min(film.crop_size())
    corners = [(x, y) for x in (-border, 1 + border) for y in (-border, 1 + border)]
    place, lens = (
        np.array(axis) for axis in zip(*((c, e) for c in corners for e in _edge()), strict=True)
    )
    ray, _ = sensor.sample_ray(0.0, 0.5, mi.Point2f(place.T), mi.Point2f(lens.T))
    origins = np.array(ray.o, float).T
    middle = origins.mean(axis=0)
    axis = np.ravel(np.array(sensor.world_transform().matrix, float)[:3, 2])
    return CameraFacts(
        plugin, middle + MARGIN * (origins - middle), axis / np.linalg.norm(axis), is_still
    )


def _edge() -> list[tuple[float, float]]:
    """Return points along the sides of the unit square, which is mapped to the lens."""
    steps = np.arange(EDGE) / EDGE
    sides = [
        (steps, 0 * steps),
        (1 + 0 * steps, steps),
        (1 - steps, 1 + 0 * steps),
        (0 * steps, 1 - steps),
    ]
    return [(float(x), float(y)) for xs, ys in sides for x, y in zip(xs, ys, strict=True)]
