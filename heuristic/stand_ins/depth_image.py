"""Ambient occlusion from the camera's depth image: horizons about each point, as engines do it.

Jimenez, Wu, Pesce and Jarabo, "Practical real-time strategies for accurate indirect occlusion"
(2016). The hemisphere is cut into slices that hold the view vector. In a slice, nearby points of
the image leave free the angles from ``h1`` to ``h2`` about the view. A surface inclined by ``g`` in
the slice sees of them, weighted by the cosine::

    a(h1) + a(h2)   with   a(h) = (cos g - cos(2 h - g) + 2 h sin g) / 4

times the length of the normal's projection. The sum over slices is divided by its value with
nothing near, so open surfaces have an openness of 1 for any number of slices. Anything not in the
image hides nothing.
"""

from dataclasses import dataclass
from math import pi
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from heuristic.errors import InputError
from heuristic.heuristics import HEURISTICS, Heuristic
from heuristic.plugins.interpolated import viewpoint
from heuristic.points import INPUTS, Array, Point
from heuristic.stand_ins.ambient_light import has_environment, lit
from heuristic.stand_ins.openness import REACH, calibrated, hashed, reach_of
from heuristic.stand_ins.tabulated import Table

SLICES = 4
STEPS = 8
"""Samples on each side of a slice."""

OWN = 1e-3
"""Anything nearer than this share of the reach is the surface itself."""

ABOVE = 0.05
"""So is anything that rises less above its tangent plane: the sine of an angle. Pixels are
coarse."""


@dataclass
class DepthImage:
    """The point that a camera sees at the centre of each pixel.

    Attributes
    ----------
    sensor
        The camera.
    width, height
        Pixels.
    places
        (3 N) positions in world space, row by row; infinite where nothing is seen.
    axes
        (6): unit vectors of the camera in world space, to its right and up.
    """

    sensor: Any
    width: int
    height: int
    places: Any
    axes: Any

    def at(self, position: Any) -> Any:
        """Return the image's point where a position would be seen; infinite if there is none."""
        it = dr.zeros(mi.Interaction3f)
        it.p = position
        sample, _ = self.sensor.sample_direction(it, mi.Point2f(0.5))
        x, y = (mi.Int32(dr.floor(side)) for side in (sample.uv.x, sample.uv.y))
        inside = (sample.pdf > 0) & (x >= 0) & (y >= 0) & (x < self.width) & (y < self.height)
        pixel = mi.UInt32(dr.select(inside, y * self.width + x, 0))
        return dr.select(inside, dr.gather(mi.Point3f, self.places, pixel, inside), dr.inf)


def depth_image(scene: Any) -> DepthImage:
    """Render the depth image of a scene's camera, a ray to the centre of each pixel."""
    sensor = scene.sensors()[0]
    width, height = map(int, sensor.film().crop_size())
    pixel = dr.arange(mi.UInt32, width * height)
    x, y = (mi.Float(part) + 0.5 for part in (pixel % width, pixel // width))
    ray, _ = sensor.sample_ray(0.0, 0.5, mi.Point2f(x / width, y / height), mi.Point2f(0.5))
    si = scene.ray_intersect(ray)
    places = dr.ravel(dr.select(si.is_valid(), si.p, dr.inf))
    dr.eval(places)
    across = np.array(sensor.world_transform().matrix, float).reshape(4, 4, -1)[:3, :2, 0].T
    axes = mi.Float(np.ravel(across / np.linalg.norm(across, axis=1, keepdims=True)))
    return DepthImage(sensor, width, height, places, axes)


def free(horizon: Any, tilt: Any) -> Any:
    """Return ``a(h)``: the cosine-weighted share of a slice from the view to a horizon."""
    return 0.25 * (dr.cos(tilt) - dr.cos(2 * horizon - tilt) + 2 * horizon * dr.sin(tilt))


def openness(image: DepthImage, position: Any, normal: Any, view: Any, reach: Any) -> Any:
    """Return the share of the cosine-weighted hemisphere that the image leaves free."""
    found, whole = mi.Float(0), mi.Float(0)
    shift, turn = hashed(position)
    right, up = (dr.gather(mi.Vector3f, image.axes, mi.UInt32(axis)) for axis in (0, 1))
    reach = mi.Float(reach)  # a loop may widen its argument
    for number in range(SLICES):
        sine, cosine = dr.sincos((number + turn) * (pi / SLICES))
        across = right * cosine + up * sine
        across = dr.normalize(across - view * dr.dot(across, view))
        axis = dr.cross(view, across)
        flat = normal - axis * dr.dot(normal, axis)
        tilt = dr.atan2(dr.dot(flat, across), dr.dot(flat, view))
        length = dr.norm(flat)
        low, high = tilt - pi / 2, tilt + pi / 2
        at = position, normal, view
        first = dr.maximum(-_horizon(image, *at, -across, reach, shift), low)
        second = dr.minimum(_horizon(image, *at, across, reach, shift), high)
        found += length * (free(first, tilt) + free(second, tilt))
        whole += length * (free(low, tilt) + free(high, tilt))
    return dr.clip(found / dr.maximum(whole, dr.epsilon(mi.Float)), 0, 1)


@dr.syntax
def _horizon(
    image: DepthImage, position: Any, normal: Any, view: Any, across: Any, reach: Any, shift: Any
) -> Any:
    """Return the angle from the view to the highest thing on one side, pi if nothing is near."""
    cosine, number = mi.Float(-1), mi.UInt32(0)
    while dr.hint(number < STEPS, exclude=[image]):
        far = reach * dr.square((mi.Float(number) + 1 - 0.5 * shift) / STEPS)
        offset = image.at(position + across * far) - position
        distance = dr.norm(offset)
        is_near = (distance < reach) & (distance > OWN * reach)
        is_near &= dr.dot(offset, normal) > ABOVE * distance
        cosine = dr.select(is_near, dr.maximum(cosine, dr.dot(offset, view) / distance), cosine)
        number += 1
    return dr.safe_acos(cosine)


@dataclass
class Shown:
    """Unhidden ambient light, the depth image, and the reach in units of the scene."""

    arriving: Table
    image: DepthImage
    distance: Any
    replaces_ambient: bool


def prepare(scene: Any, reach: float) -> Shown:
    """Render the depth image, and gather the mean of the indirect light and of the openness."""
    image, distance = depth_image(scene), mi.Float(reach_of(scene, reach))
    dr.make_opaque(distance)
    viewer = mi.Point3f(viewpoint(scene.sensors()[0]))

    def hidden(at: Any) -> Any:
        view = dr.normalize(viewer - at.si.p)
        return dr.select(at.si.is_valid(), openness(image, at.si.p, at.normal, view, distance), 0)

    return Shown(calibrated(scene, hidden), image, distance, has_environment(scene))


def shade(point: Point) -> Array:
    """Return the chapters' model with the mean indirect light, hidden by nearby things."""
    prepared, given = point.prepared, point.given
    share = openness(prepared.image, given.position, point.normal, point.view, prepared.distance)
    arriving = prepared.arriving.at(point.wavelengths) * share
    return lit(point, arriving, prepared.replaces_ambient, share)


def refuse(scene: Any) -> str:
    """Return why a scene has no depth image with a horizon about the view, if so."""
    try:
        viewpoint(scene.sensors()[0])
    except InputError:
        return "its camera has no single viewpoint, so no depth image"
    return ""


DEPTH_IMAGE = HEURISTICS.own(
    Heuristic(
        "screen-occlusion",
        shade,
        "ambient occlusion from the depth image",
        needs=frozenset(INPUTS) - {"uv", "visible"},
        parameters=(REACH,),
        prepare=prepare,
        refuse=refuse,
    )
)
