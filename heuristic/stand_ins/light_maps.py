"""Depth images from lamps: how far light travels in each direction before it hits something.

A lamp with a position has one over all directions, on the six sides of a cube; parallel light has
one over the scene's projected disc. The image is traced through the centres of its texels.

A point is looked up from slightly above its surface. On a plane the distance changes by ``w tan a``
over a width ``w`` across the light, which arrives at an angle ``a`` to the normal; a height of ``w
sin a`` compensates. To keep planes from hiding themselves, ``w`` is half the diagonal of the
averaged area: the texel plus the filter.
"""

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from heuristic import mesh_arrays
from heuristic.lights import DirectionalLight
from heuristic.plugins.emitters import FAR

LEAST = 1e-4
"""Share of a distance by which a lookup may exceed the image's: single precision."""

SMALLEST_SINE = 0.1
"""For the height above surfaces that face the lamp: they may be curved."""


@dataclass
class LightMap:
    """The depth image of one lamp.

    Attributes
    ----------
    resolution
        Texels along a side.
    depths
        Distances, FAR where nothing is hit: six sides of a cube one after the other, or one square.
    """

    resolution: int
    depths: Any

    def texel(self, distance: Any) -> Any:
        """Return the width of a texel at a distance, in units of the scene."""
        raise NotImplementedError

    def depth(self, offset: Any, across: tuple[Any, Any], u: Any, v: Any) -> Any:
        """Return the image's value ``u`` and ``v`` texels away from a point's ``offset``."""
        raise NotImplementedError

    def distance(self, offset: Any) -> Any:
        """Return the distance of a point from the lamp."""
        raise NotImplementedError

    def offset(self, position: Any) -> Any:
        """Return a position as seen from the lamp."""
        raise NotImplementedError


@dataclass
class CubeMap(LightMap):
    """The depth image of a lamp with a position."""

    centre: Any

    def texel(self, distance: Any) -> Any:
        return distance * (2 / self.resolution)

    def offset(self, position: Any) -> Any:
        return position - self.centre

    def distance(self, offset: Any) -> Any:
        return dr.norm(offset)

    def depth(self, offset: Any, across: tuple[Any, Any], u: Any, v: Any) -> Any:
        width = self.texel(dr.norm(offset))
        place = offset + (across[0] * u + across[1] * v) * width
        return dr.gather(mi.Float, self.depths, _cube_texel(place, self.resolution))


@dataclass
class SquareMap(LightMap):
    """Of parallel light: ``frame`` has its third axis along the rays; ``radius`` is the scene's."""

    centre: Any
    frame: Any
    radius: Any

    def texel(self, distance: Any) -> Any:
        return self.radius * (2 / self.resolution)

    def offset(self, position: Any) -> Any:
        return self.frame.to_local(position - self.centre) + mi.Vector3f(0, 0, 1) * self.radius

    def distance(self, offset: Any) -> Any:
        return offset.z

    def depth(self, offset: Any, across: tuple[Any, Any], u: Any, v: Any) -> Any:
        size = self.resolution
        x, y = (
            dr.clip(
                mi.Int32(dr.floor((place / self.radius + 1) * (size / 2) + beside)), 0, size - 1
            )
            for place, beside in ((offset.x, u), (offset.y, v))
        )
        return dr.gather(mi.Float, self.depths, mi.UInt32(y * size + x))


def box(scene: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners (3,) of a scene's box; Mitsuba's leaves out meshes that it merged."""
    corners = [np.zeros((0, 3))]
    for shape in scene.shapes():
        if shape.is_mesh():
            corners.append(mesh_arrays.rows(shape, mesh_arrays.POSITIONS).astype(float))
        else:
            ends = shape.bbox().min, shape.bbox().max
            corners.append(np.array([np.ravel(end) for end in ends], float))
    points = np.concatenate(corners)
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        return np.zeros(3), np.zeros(3)
    return points.min(axis=0), points.max(axis=0)


def light_map(scene: Any, light: Any, resolution: int) -> LightMap:
    """Trace the depth image of one of the kernel's lamps."""
    low, high = box(scene)
    radius = 0.5 * float(np.linalg.norm(high - low)) + float(np.finfo(np.float32).tiny)
    if isinstance(light, DirectionalLight):
        return _square(scene, light, resolution, (low + high) / 2, radius)
    return _cube(scene, light, resolution, dr.maximum(LEAST * radius, light.shell))


def _cube(scene: Any, light: Any, resolution: int, start: Any) -> CubeMap:
    centre = mi.Point3f(light.position)
    toward = dr.normalize(_cube_direction(resolution))
    depths = _traced(scene, centre + toward * start, toward) + start
    dr.eval(depths, centre)
    return CubeMap(resolution, depths, centre)


def _square(
    scene: Any, light: Any, resolution: int, middle: np.ndarray, radius: float
) -> SquareMap:
    centre, size = mi.Point3f(middle.tolist()), mi.Float(radius)
    dr.make_opaque(centre, size)
    frame = mi.Frame3f(dr.normalize(mi.Vector3f(light.direction)))
    texel = dr.arange(mi.UInt32, resolution**2)
    x, y = (
        (2 * (mi.Float(part) + 0.5) / resolution - 1) * size
        for part in (texel % resolution, texel // resolution)
    )
    origin = centre + frame.s * x + frame.t * y - frame.n * size
    depths = _traced(scene, origin, frame.n)
    dr.eval(depths, frame)
    return SquareMap(resolution, depths, centre, frame, size)


def _traced(scene: Any, origin: Any, toward: Any) -> Any:
    """Return how far rays travel, and FAR for those that hit nothing."""
    hit = scene.ray_intersect_preliminary(mi.Ray3f(mi.Point3f(origin), mi.Vector3f(toward)))
    return dr.select(hit.is_valid(), hit.t, FAR)


def _cube_direction(size: int) -> Any:
    """Return the directions of all texels of a cube: side after side, row after row."""
    texel = dr.arange(mi.UInt32, 6 * size**2)
    side, inside = texel // size**2, texel % size**2
    u, v = (2 * (mi.Float(part) + 0.5) / size - 1 for part in (inside % size, inside // size))
    major = dr.select(side % 2 == 0, mi.Float(1), -1)
    axis = side // 2
    return dr.select(
        axis == 0,
        mi.Vector3f(major, u, v),
        dr.select(axis == 1, mi.Vector3f(u, major, v), mi.Vector3f(u, v, major)),
    )


def _cube_texel(place: Any, size: int) -> Any:
    """Return the number of the texel that a direction of any length hits."""
    length = abs(place)
    is_x = (length.x >= length.y) & (length.x >= length.z)
    is_y = ~is_x & (length.y >= length.z)
    major = dr.select(is_x, place.x, dr.select(is_y, place.y, place.z))
    u = dr.select(is_x, place.y, place.x)
    v = dr.select(is_x | is_y, place.z, place.y)
    axis = dr.select(is_x, mi.UInt32(0), dr.select(is_y, mi.UInt32(1), 2))
    side = 2 * axis + dr.select(major >= 0, mi.UInt32(0), 1)
    inverse = dr.select(major != 0, 1 / abs(major), 0)
    x, y = (mi.UInt32(dr.clip((part * inverse + 1) * (0.5 * size), 0, size - 1)) for part in (u, v))
    return (side * size + y) * size + x
