"""Ambient occlusion by rays: the mean ambient light, unless hidden by nearby things.

``I = ... + k_d A o`` with the openness ``o = 1 / N sum_j V(w_j)`` over directions that follow the
cosine, hence ``1 / pi`` times the integral of ``V (n.w)``; ``V`` is 0 if something lies within
``reach``. ``A`` keeps the image's mean indirect light, like
:mod:`heuristic.stand_ins.mean_ambient`. The directions are a fixed pattern, turned and shifted by a
hash of the place: they differ from point to point and repeat from run to run.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from heuristic.heuristics import HEURISTICS, Heuristic, Parameter
from heuristic.points import INPUTS, Array, Point
from heuristic.stand_ins import gathering, tabulated
from heuristic.stand_ins.ambient_light import has_environment, lit
from heuristic.stand_ins.tabulated import Table

RAYS = Parameter("rays", 8, 1, 256)
"""Rays from each point; a pixel of several samples has that many times more."""

MANY = 64
"""Rays for the mean openness, which calibrates the ambient light."""

REACH = Parameter("reach", 0.5, 0.01, 100.0, prepared=True)
"""How far away things hide light, in units of the size of the visible scene (:func:`reach_of`).
Without a bound a closed room would be dark."""


@dataclass
class Hidden:
    """Unhidden ambient light, and the reach in units of the scene."""

    arriving: Table
    distance: Any
    replaces_ambient: bool


def hashed(position: Any) -> tuple[Any, Any]:
    """Return two numbers from 0 to 1 that depend on a place and look random."""
    bits = [
        dr.reinterpret_array(mi.UInt32, dr.float32_array_t(mi.Float)(part))
        for part in (position.x, position.y, position.z)
    ]
    first = mi.sample_tea_32(bits[0], bits[1])[0]
    return tuple(mi.Float(mi.sample_tea_float32(first, bits[2] + more)) for more in (0, 1))


@dr.syntax
def openness(visible: Callable, position: Any, normal: Any, distance: Any, rays: Any) -> Any:
    """Return the share of the cosine-weighted hemisphere unhidden within a distance.

    ``rays`` is their number, as a plain or Dr.Jit number.
    """
    frame = mi.Frame3f(normal)
    shift, turn = hashed(position)
    distance, rays = mi.Float(distance), dr.round(mi.Float(rays))  # loops widen their arguments
    count, number = mi.Float(0), mi.UInt32(0)
    while mi.Float(number) < rays:
        square = (mi.Float(number) + shift) / rays
        sine, cosine = dr.sincos(dr.two_pi * (mi.radical_inverse_2(number, 0) + turn))
        radius = dr.sqrt(square)
        toward = frame.to_world(mi.Vector3f(radius * cosine, radius * sine, dr.sqrt(1 - square)))
        count += dr.select(visible(toward, distance), 1, 0)
        number += 1
    return count / rays


def reach_of(scene: Any, reach: float) -> float:
    """Return a share of the size of the visible scene, in units of the scene.

    The size is the median distance of the points seen from their median: a floor or wall much
    larger than the objects in front of it does not change it.
    """
    si = gathering.seen(scene, wavelengths=tabulated.batches()[0]).si
    places = np.array(si.p, float).T[np.array(si.is_valid())]
    if not len(places):
        return reach
    return reach * float(np.median(np.linalg.norm(places - np.median(places, axis=0), axis=1)))


def calibrated(scene: Any, hidden: Callable[[gathering.Seen], Any]) -> Table:
    """Return the ambient light that has the image's mean after occlusion."""
    gathered = gathering.gather(scene)
    (first, *_) = tabulated.batches()
    at = gathering.seen(scene, wavelengths=first)
    share = np.array(hidden(at) + dr.zeros(mi.Float, gathering.GRID**2), float)[:, None]
    mean, left = gathered.mean(), gathered.mean(np.where(gathered.k_d > 0, share, 0))
    return Table(np.divide(mean, left, out=np.zeros_like(mean), where=left > 0))


def prepare(scene: Any, reach: float) -> Hidden:
    """Gather the mean of the indirect light of a scene, and of the openness where it arrives."""
    distance = mi.Float(reach_of(scene, reach))
    dr.make_opaque(distance)
    light = calibrated(
        scene, lambda at: openness(at.visible(scene), at.si.p, at.normal, distance, MANY)
    )
    return Hidden(light, distance, has_environment(scene))


def shade(point: Point) -> Array:
    """Return the chapters' model with the mean indirect light, hidden by nearby things."""
    prepared = point.prepared
    place = point.position, point.normal, prepared.distance
    share = openness(point.given.visible, *place, point.parameters.rays)
    arriving = prepared.arriving.at(point.wavelengths) * share
    return lit(point, arriving, prepared.replaces_ambient, share)


OPENNESS = HEURISTICS.own(
    Heuristic(
        "ambient-occlusion",
        shade,
        "ambient occlusion",
        needs=frozenset(INPUTS) - {"uv"},
        parameters=(REACH, RAYS),
        prepare=prepare,
        refuse=lambda scene: "" if scene.shapes() else "it has no shape",
    )
)
