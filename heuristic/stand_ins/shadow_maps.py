"""Shadows from depth images of the lamps: hard ones, and soft ones by percentage-closer filtering.

Williams, "Casting curved shadows on curved surfaces" (1978): a point is lit where the depth image
of the lamp (:mod:`heuristic.stand_ins.light_maps`) has nothing nearer. Reeves, Salesin and Cook,
"Rendering antialiased shadows with depth maps" (1987): the share of nearby texels that say so is
the share of the light that arrives. It softens every edge by the same width in the image, whereas a
lamp's penumbra grows with the distance from the occluder.
"""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import drjit as dr
import mitsuba as mi

from heuristic.heuristics import HEURISTICS, Heuristic, Parameter
from heuristic.points import INPUTS, Array, Point
from heuristic.stand_ins.light_maps import LEAST, SMALLEST_SINE, LightMap, light_map

LAMPS = 16
"""Lamps with a depth image, at most."""

TAPS = 4
"""Texels along each side of the averaged square."""

RESOLUTION = Parameter("resolution", 512, 16, 2048, prepared=True)
"""Texels along a side of the image."""

BIAS = Parameter("bias", 0.75, 0.0, 8.0)
"""Height above the surface, in texels: half a diagonal is enough for planes."""

RADIUS = Parameter("radius", 2.0, 0.25, 16.0)
"""Half the side of the averaged square, in texels."""


def prepare(scene: Any, resolution: float) -> tuple[LightMap, ...]:
    """Trace the depth images of all lamps, in their order."""
    si = dr.zeros(mi.SurfaceInteraction3f)
    lamps = (emitter.light(si) for emitter in _lamps(scene))
    return tuple(light_map(scene, lamp, round(resolution)) for lamp in lamps)


def refuse(scene: Any) -> str:
    """Return why there are no depth images: no lamp, or too many; empty if there are."""
    count = sum(1 for _ in _lamps(scene))
    if count == 0:
        return "it has no lamp"
    return "" if count <= LAMPS else f"it has {count} lamps, and at most {LAMPS} get a depth image"


def _lamps(scene: Any) -> Iterable[Any]:
    return (emitter for emitter in scene.emitters() if hasattr(emitter, "light"))


def hard(point: Point) -> Array:
    """Return the chapters' model, with shadows from the lamps' depth images."""
    return _shaded(point, ((0.0, 0.0),), 0.0)


def soft(point: Point) -> Array:
    """Return the chapters' model, with the unhidden share of each lamp's light."""
    radius = point.parameters.radius
    places = [radius * (2 * (tap + 0.5) / TAPS - 1) for tap in range(TAPS)]
    return _shaded(point, [(u, v) for u in places for v in places], 1.5 * radius)


def _shaded(point: Point, taps: Iterable[tuple], width: Any) -> Array:
    """Return the sum over lamps, each with its share; ``width`` is half the filter's diagonal."""
    taps = tuple(taps)
    colour = point.textbook(lights=[])
    bare = replace(point.given.material, k_i=0, k_a=0)
    for light, depths in zip(point.given.lights, point.prepared, strict=True):
        own = point.textbook(lights=[light], material=bare, ambient=0, visible=None)
        colour = colour + own * _share(point, light, depths, taps, width)
    return colour


def _share(point: Point, light: Any, depths: LightMap, taps: tuple, width: Any) -> Array:
    """Return the share of a lamp's light that its image lets through."""
    toward = light.illuminate(point.position).toward
    cosine = dr.dot(point.normal, toward)
    sine = dr.maximum(dr.sqrt(dr.maximum(1 - dr.square(cosine), 0)), SMALLEST_SINE)
    texel = depths.texel(depths.distance(depths.offset(point.position)))
    height = (point.parameters.bias + width) * texel * sine
    offset = depths.offset(point.position + point.normal * height)
    distance = depths.distance(offset) * (1 - LEAST)
    frame = mi.Frame3f(dr.normalize(mi.Vector3f(offset)))
    lit = mi.Float(0)
    for u, v in taps:
        lit += dr.select(distance <= depths.depth(offset, (frame.s, frame.t), u, v), 1.0, 0.0)
    return lit / len(taps)


_READ = frozenset(INPUTS) - {"uv", "visible"}
SHADOW_MAP = HEURISTICS.own(
    Heuristic(
        "shadow-map",
        hard,
        "shadow map",
        needs=_READ,
        parameters=(RESOLUTION, BIAS),
        prepare=prepare,
        refuse=refuse,
    )
)
SOFT_SHADOW_MAP = HEURISTICS.own(
    Heuristic(
        "soft-shadow-map",
        soft,
        "filtered shadow map",
        needs=_READ,
        parameters=(RESOLUTION, BIAS, RADIUS),
        prepare=prepare,
        refuse=refuse,
    )
)
