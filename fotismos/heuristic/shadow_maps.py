"""Shadows from depth images of the lamps.

Williams, "Casting curved shadows on curved surfaces" (1978): a point is lit where the depth image
of the lamp has nothing nearer.

A lamp with a position has one depth image over all directions, on the six sides of a cube; parallel
light has one over the scene's projected disc. It is traced through the centres of its texels. A
point is looked up from slightly above its surface. On a plane the distance changes by ``w tan a``
over a width ``w`` across the light, which arrives at an angle ``a`` to the normal; a height of ``w
sin a`` compensates. To keep planes from hiding themselves, ``w`` is half the diagonal of a texel.
"""

from dataclasses import dataclass, replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from fotismos.heuristic import meshes
from fotismos.heuristic.convention import Array, Doubles
from fotismos.heuristic.heuristics import INPUTS, Heuristic, Parameter, Point
from fotismos.heuristic.lights import FAR, lamps

LAMPS = 16
"""Lamps with a depth image, at most."""

LEAST = 1e-4
"""Share of a distance by which a lookup may exceed the image's: single precision."""

SMALLEST_SINE = 0.1
"""For the height above surfaces that face the lamp: they may be curved."""


@dataclass
class DepthImage:
    """The depth image of a lamp: the six sides of a cube one after the other, or a square.

    ``resolution`` is of texels along a side; ``depths`` are FAR where nothing is hit. The square of
    parallel light has a ``frame`` with its third axis along the rays, and the ``radius`` of the
    scene.
    """

    resolution: int
    depths: Any
    centre: Any
    frame: Any = None
    radius: Any = None

    def offset(self, position: Any) -> Any:
        """Return a position as seen from the lamp."""
        if self.frame is None:
            return position - self.centre
        return self.frame.to_local(position - self.centre) + mi.Vector3f(0, 0, 1) * self.radius

    def read(self, offset: Any) -> tuple[Any, Any, Any]:
        """Return a point's distance from the lamp, the width of a texel there, and its number."""
        size = self.resolution
        if self.frame is None:
            distance = dr.norm(offset)
            return distance, distance * (2 / size), _cube_texel(offset, size)
        x = dr.clip(mi.Int32(dr.floor((offset.x / self.radius + 1) * (size / 2))), 0, size - 1)
        y = dr.clip(mi.Int32(dr.floor((offset.y / self.radius + 1) * (size / 2))), 0, size - 1)
        return offset.z, self.radius * (2 / size), mi.UInt32(y * size + x)


def light_map(scene: Any, light: Any, resolution: int) -> DepthImage:
    """Trace the depth image of one of the kernel's lamps."""
    low, high = box(scene)
    # Half the diagonal of the box, above 0 even for an empty one.
    radius = 0.5 * float(np.linalg.norm(high - low)) + float(np.finfo(np.float32).tiny)
    if not light.parallel:
        # In all directions from the lamp, beginning outside its own body.
        centre = mi.Point3f(light.position)
        start = dr.maximum(LEAST * radius, light.shell)
        toward = dr.normalize(_cube_direction(resolution))
        depths = _traced(scene, centre + toward * start, toward) + start
        dr.eval(depths, centre)
        return DepthImage(resolution, depths, centre)
    # Parallel rays from a square in front of the scene, as wide as the scene.
    centre = mi.Point3f(((low + high) / 2).tolist())
    size = mi.Float(radius)
    dr.make_opaque(centre, size)
    frame = mi.Frame3f(dr.normalize(mi.Vector3f(light.direction)))
    texel = dr.arange(mi.UInt32, resolution**2)
    x = (2 * (mi.Float(texel % resolution) + 0.5) / resolution - 1) * size
    y = (2 * (mi.Float(texel // resolution) + 0.5) / resolution - 1) * size
    origin = centre + frame.s * x + frame.t * y - frame.n * size
    depths = _traced(scene, origin, frame.n)
    dr.eval(depths, frame)
    return DepthImage(resolution=resolution, depths=depths, centre=centre, frame=frame, radius=size)


def box(scene: Any) -> tuple[Doubles, Doubles]:
    """Return the corners (3,) of a scene's box; Mitsuba's leaves out meshes that it merged."""
    corners = [np.zeros((0, 3))]
    for shape in scene.shapes():
        if shape.is_mesh():
            corners.append(meshes.rows(shape, meshes.POSITIONS).astype(float))
        else:
            ends = shape.bbox().min, shape.bbox().max
            corners.append(np.array([np.ravel(end) for end in ends], float))
    points = np.concatenate(corners)
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        return np.zeros(3), np.zeros(3)
    return points.min(axis=0), points.max(axis=0)


def _traced(scene: Any, origin: Any, toward: Any) -> Any:
    """Return how far rays travel, and FAR for those that hit nothing."""
    hit = scene.ray_intersect_preliminary(mi.Ray3f(mi.Point3f(origin), mi.Vector3f(toward)))
    return dr.select(hit.is_valid(), hit.t, FAR)


def _cube_direction(size: int) -> Any:
    """Return the directions of all texels of a cube: side after side, row after row."""
    texel = dr.arange(mi.UInt32, 6 * size**2)
    side = texel // size**2
    inside = texel % size**2
    u = 2 * (mi.Float(inside % size) + 0.5) / size - 1
    v = 2 * (mi.Float(inside // size) + 0.5) / size - 1
    major = dr.select(side % 2 == 0, mi.Float(1), -1)
    axis = side // 2
    return dr.select(
        axis == 0,
        mi.Vector3f(major, u, v),
        dr.select(axis == 1, mi.Vector3f(u, major, v), mi.Vector3f(u, v, major)),
    )


def _cube_texel(position: Any, size: int) -> Any:
    """Return the number of the texel that a direction of any length hits."""
    length = abs(position)
    # The side is that of the largest component; the other two are places on it.
    is_x = (length.x >= length.y) & (length.x >= length.z)
    is_y = ~is_x & (length.y >= length.z)
    major = dr.select(is_x, position.x, dr.select(is_y, position.y, position.z))
    u = dr.select(is_x, position.y, position.x)
    v = dr.select(is_x | is_y, position.z, position.y)
    axis = dr.select(is_x, mi.UInt32(0), dr.select(is_y, mi.UInt32(1), 2))
    side = 2 * axis + dr.select(major >= 0, mi.UInt32(0), 1)
    inverse = dr.select(major != 0, 1 / abs(major), 0)
    x = mi.UInt32(dr.clip((u * inverse + 1) * (0.5 * size), 0, size - 1))
    y = mi.UInt32(dr.clip((v * inverse + 1) * (0.5 * size), 0, size - 1))
    return (side * size + y) * size + x


def light_maps(scene: Any, resolution: float) -> tuple[DepthImage, ...]:
    """Trace the depth images of all lamps, in their order."""
    si = dr.zeros(mi.SurfaceInteraction3f)
    return tuple(light_map(scene, lamp.light(si), round(resolution)) for lamp in lamps(scene))


def refuse(scene: Any) -> str:
    """Return why there are no depth images: no lamp, or too many; empty if there are."""
    count = len(lamps(scene))
    if count == 0:
        return "it has no lamp"
    return "" if count <= LAMPS else f"it has {count} lamps, and at most {LAMPS} get a depth image"


def shade(point: Point) -> Array:
    """Return the chapters' model, with shadows from the lamps' depth images."""
    # Emission and ambient light have no shadows.
    colour = point.textbook(lights=[])
    bare = replace(point.arguments.material, k_i=0, k_a=0)
    for light, image in zip(point.arguments.lights, point.prepared, strict=True):
        unshadowed = point.textbook(lights=[light], material=bare, ambient=0, visible=None)
        colour = colour + dr.select(_is_lit(point, light, image), unshadowed, 0)
    return colour


def _is_lit(point: Point, light: Any, image: DepthImage) -> Any:
    cosine = dr.dot(point.normal, light.illuminate(point.position).toward)
    sine = dr.maximum(dr.sqrt(dr.maximum(1 - dr.square(cosine), 0)), SMALLEST_SINE)
    _, width, _ = image.read(image.offset(point.position))
    height = point.parameters.bias * width * sine
    distance, _, texel = image.read(image.offset(point.position + point.normal * height))
    return distance * (1 - LEAST) <= dr.gather(mi.Float, image.depths, texel)


RESOLUTION = Parameter(name="resolution", default=512, low=16, high=2048, prepared=True)
"""Texels along a side of the image."""

BIAS = Parameter(name="bias", default=0.75, low=0.0, high=8.0)
"""Height above the surface, in texels: half a diagonal is enough for planes."""

MAP = Heuristic(
    name="shadow-map",
    shade=shade,
    label="shadow map",
    needs=frozenset(INPUTS) - {"uv", "environment", "visible"},
    parameters=(RESOLUTION, BIAS),
    prepare=light_maps,
    refuse=refuse,
)
