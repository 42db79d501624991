"""Ambient occlusion by rays: the mean ambient light where it is not hidden near by.

``I = ... + k_d A o`` with the openness ``o = 1 / N sum_j V(w_j)`` over directions that follow the
cosine, hence ``1 / pi`` times the integral of ``V (n.w)``; ``V`` is 0 where something lies within
``reach``. ``A`` keeps the image's mean of indirect light, as :mod:`heuristic.stand_ins.mean_ambient`
does. The same directions about every normal make it a function of the place alone.
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

RAYS = 16

REACH = Parameter("reach", 0.25, 0.001, 1.0, prepared=True)
"""How far away things hide light, in diagonals of the scene's box. Without a bound a closed room
would be dark."""


@dataclass(frozen=True)
class Hidden:
    """Ambient light where nothing is near, the reach in units of the scene."""

    arriving: Table
    distance: Any
    replaces_ambient: bool


@dr.syntax
def openness(visible: Callable, normal: Any, distance: Any) -> Any:
    """Return the share of the cosine-weighted hemisphere that nothing hides within a distance."""
    frame = mi.Frame3f(normal)
    count, number = mi.Float(0), mi.UInt32(0)
    while number < RAYS:
        square = mi.Point2f((mi.Float(number) + 0.5) / RAYS, mi.radical_inverse_2(number, 0))
        radius, turn = dr.sqrt(square.x), dr.two_pi * square.y
        sine, cosine = dr.sincos(turn)
        toward = frame.to_world(mi.Vector3f(radius * cosine, radius * sine, dr.sqrt(1 - square.x)))
        count += dr.select(visible(toward, distance), 1, 0)
        number += 1
    return count / RAYS


def reach_of(scene: Any, reach: float) -> float:
    """Return the length of a share of the diagonal of the scene's box."""
    return reach * float(np.linalg.norm(np.ravel(scene.bbox().max - scene.bbox().min)))


def calibrated(scene: Any, hidden: Callable[[gathering.Seen], Any]) -> Table:
    """Return the ambient light that has the image's mean once it is hidden."""
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
    light = calibrated(scene, lambda at: openness(at.visible(scene), at.normal, distance))
    return Hidden(light, distance, has_environment(scene))


def shade(point: Point) -> Array:
    """Return the chapters' model with the mean of the indirect light, hidden near by."""
    prepared = point.prepared
    share = openness(point.given.visible, point.normal, prepared.distance)
    arriving = prepared.arriving.at(point.wavelengths) * share
    return lit(point, arriving, prepared.replaces_ambient)


OPENNESS = HEURISTICS.own(
    Heuristic(
        "ambient-occlusion",
        shade,
        "ambient occlusion",
        needs=frozenset(INPUTS) - {"uv"},
        parameters=(REACH,),
        prepare=prepare,
        refuse=lambda scene: "" if scene.shapes() else "it has no shape",
    )
)
