"""What the camera sees of a scene's geometry, for pairing quantities that depend on it."""

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

GRID = 192
"""Camera rays along each side: some 37,000 points, enough for means to three digits."""


@dataclass(frozen=True)
class VisibleSurface:
    """Points that the camera sees: positions and unit normals, (M, 3) each, in world space."""

    position: np.ndarray
    normal: np.ndarray

    def mean_irradiance(self, light_position, falloff):
        """Return the mean of ``(N.L)+ falloff(d)`` over the points, for a unit light."""
        offset = np.asarray(light_position) - self.position
        distance = np.linalg.norm(offset, axis=1)
        distance = np.where(distance > 0, distance, np.inf)
        cosine = np.sum(self.normal * offset, axis=1) / distance
        return float(np.mean(np.maximum(cosine, 0) * falloff(distance))) if len(distance) else 0.0


def visible_surface(scene, sensor=0):
    """Intersect one camera ray for each cell of a grid, through the cells' centres."""
    centres = (np.arange(GRID) + 0.5) / GRID
    x, y = (axis.ravel() for axis in np.meshgrid(centres, centres))
    position = mi.Point2f(mi.Float(x), mi.Float(y))
    ray, _ = scene.sensors()[sensor].sample_ray(0.0, 0.5, position, mi.Point2f(0.5))
    si = scene.ray_intersect(ray)
    hit = np.array(si.is_valid())
    normal = dr.mulsign(mi.Vector3f(si.sh_frame.n), si.wi.z)  # of the side that is seen
    return VisibleSurface(np.array(si.p).T[hit], np.array(normal).T[hit])
