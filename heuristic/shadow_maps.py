"""Shadows from depth images of the lamps: hard ones, and soft ones by percentage-closer filtering.

Williams, "Casting curved shadows on curved surfaces" (1978): a point is lit where the depth image
of the lamp has nothing nearer. Reeves, Salesin and Cook, "Rendering antialiased shadows with depth
maps" (1987): the share of nearby texels that say so is the share of the light that arrives. It
softens every edge by the same width in the image, whereas a lamp's penumbra grows with the distance
from the occluder.

A lamp with a position has one depth image over all directions, on the six sides of a cube; parallel
light has one over the scene's projected disc. It is traced through the centres of its texels. A
point is looked up from slightly above its surface. On a plane the distance changes by ``w tan a``
over a width ``w`` across the light, which arrives at an angle ``a`` to the normal; a height of ``w
sin a`` compensates. To keep planes from hiding themselves, ``w`` is half the diagonal of the
averaged area: the texel plus the filter.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from heuristic import meshes
from heuristic.convention import Array
from heuristic.heuristics import INPUTS, Heuristic, Parameter, Point
from heuristic.lights import FAR, DirectionalLight

LAMPS = 16
"""Lamps with a depth image, at most."""

TAPS = 4
"""Texels along each side of the averaged square."""

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

    def distance(self, offset: Any) -> Any:
        """Return the distance of a point from the lamp."""
        return dr.norm(offset) if self.frame is None else offset.z

    def texel(self, distance: Any) -> Any:
        """Return the width of a texel at a distance, in units of the scene."""
        return (distance if self.frame is None else self.radius) * (2 / self.resolution)

    def depth(self, offset: Any, frame: Any, u: float, v: float) -> Any:
        """Return the image's value ``u`` and ``v`` texels away from a point's ``offset``."""
        size = self.resolution
        if self.frame is None:
            place = offset + (frame.s * u + frame.t * v) * self.texel(dr.norm(offset))
            return dr.gather(mi.Float, self.depths, _cube_texel(place, size))
        x, y = (
            dr.clip(
                mi.Int32(dr.floor((place / self.radius + 1) * (size / 2) + beside)), 0, size - 1
            )
            for place, beside in ((offset.x, u), (offset.y, v))
        )
        return dr.gather(mi.Float, self.depths, mi.UInt32(y * size + x))


def light_map(scene: Any, light: Any, resolution: int) -> DepthImage:
    """Trace the depth image of one of the kernel's lamps."""
    low, high = box(scene)
    radius = 0.5 * float(np.linalg.norm(high - low)) + float(np.finfo(np.float32).tiny)
    if not isinstance(light, DirectionalLight):
        centre = mi.Point3f(light.position)
        start = dr.maximum(LEAST * radius, light.shell)
        toward = dr.normalize(_cube_direction(resolution))
        depths = _traced(scene, centre + toward * start, toward) + start
        dr.eval(depths, centre)
        return DepthImage(resolution, depths, centre)
    centre, size = mi.Point3f(((low + high) / 2).tolist()), mi.Float(radius)
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
    return DepthImage(resolution, depths, centre, frame, size)


def box(scene: Any) -> tuple[np.ndarray, np.ndarray]:
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


def prepare(scene: Any, resolution: float) -> tuple[DepthImage, ...]:
    """Trace the depth images of all lamps, in their order."""
    si = dr.zeros(mi.SurfaceInteraction3f)
    return tuple(light_map(scene, lamp.light(si), round(resolution)) for lamp in _lamps(scene))


def refuse(scene: Any) -> str:
    """Return why there are no depth images: no lamp, or too many; empty if there are."""
    count = len(_lamps(scene))
    if count == 0:
        return "it has no lamp"
    return "" if count <= LAMPS else f"it has {count} lamps, and at most {LAMPS} get a depth image"


def _lamps(scene: Any) -> list[Any]:
    return [emitter for emitter in scene.emitters() if hasattr(emitter, "light")]


def hard(point: Point) -> Array:
    """Return the chapters' model, with shadows from the lamps' depth images."""
    return _shaded(point, [(0.0, 0.0)], 0.0)


def soft(point: Point) -> Array:
    """Return the chapters' model, with the unhidden share of each lamp's light."""
    radius = point.parameters.radius
    places = [radius * (2 * (tap + 0.5) / TAPS - 1) for tap in range(TAPS)]
    return _shaded(point, [(u, v) for u in places for v in places], 1.5 * radius)


def _shaded(point: Point, taps: Sequence[tuple], width: Any) -> Array:
    """Return the sum over lamps, each with its share; ``width`` is half the filter's diagonal."""
    colour = point.textbook(lights=[])
    bare = replace(point.arguments.material, k_i=0, k_a=0)
    for light, depths in zip(point.arguments.lights, point.prepared, strict=True):
        own = point.textbook(lights=[light], material=bare, ambient=0, visible=None)
        colour = colour + own * _share(point, light, depths, taps, width)
    return colour


def _share(point: Point, light: Any, depths: Any, taps: Sequence[tuple], width: Any) -> Array:
    """Return the share of a lamp's light that its image lets through."""
    toward = light.illuminate(point.position).toward
    cosine = dr.dot(point.normal, toward)
    sine = dr.maximum(dr.sqrt(dr.maximum(1 - dr.square(cosine), 0)), SMALLEST_SINE)
    texel = depths.texel(depths.distance(depths.offset(point.position)))
    height = (point.parameters.bias + width) * texel * sine
    offset = depths.offset(point.position + point.normal * height)
    distance = depths.distance(offset) * (1 - LEAST)
    frame = mi.Frame3f(dr.normalize(mi.Vector3f(offset)))
    share = mi.Float(0)
    for u, v in taps:
        share += dr.select(distance <= depths.depth(offset, frame, u, v), 1.0, 0.0)
    return share / len(taps)


RESOLUTION = Parameter("resolution", 512, 16, 2048, prepared=True)
"""Texels along a side of the image."""

BIAS = Parameter("bias", 0.75, 0.0, 8.0)
"""Height above the surface, in texels: half a diagonal is enough for planes."""

RADIUS = Parameter("radius", 2.0, 0.25, 16.0)
"""Half the side of the averaged square, in texels."""

_NEEDS = frozenset(INPUTS) - {"uv", "visible"}
HARD = Heuristic(
    "shadow-map", hard, "shadow map", _NEEDS, (RESOLUTION, BIAS), prepare, refuse=refuse
)
SOFT = Heuristic(
    "soft-shadow-map",
    soft,
    "filtered shadow map",
    _NEEDS,
    (RESOLUTION, BIAS, RADIUS),
    prepare,
    refuse=refuse,
)
