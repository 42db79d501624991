"""Hemisphere lighting: a sky and a ground of one colour each, fitted to the indirect light.

From a sky of radiance ``S`` above the horizon and a ground of ``G`` below, a surface with ``c =
n.up`` receives ``E / pi = S (1 + c) / 2 + G (1 - c) / 2``: the integral of both halves over its
hemisphere. ``S`` and ``G`` are fitted by least squares to the light gathered at the points that the
camera sees (:mod:`heuristic.stand_ins.gathering`), which keeps the image's mean.
"""

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from heuristic.heuristics import HEURISTICS, Heuristic
from heuristic.points import INPUTS, Array, Point
from heuristic.stand_ins.ambient_light import has_environment, lit
from heuristic.stand_ins.gathering import Gathered, gather
from heuristic.stand_ins.tabulated import Table

EVENNESS = 1e-3
"""Weight, relative to all points, that makes sky and ground equal if nothing distinguishes them
because all visible surfaces have the same inclination."""


@dataclass
class SkyAndGround:
    """The colours of both halves, the upward direction, and whether they replace ``I_a``."""

    sky: Table
    ground: Table
    up: list[float]
    replaces_ambient: bool


def irradiance(sky: Array, ground: Array, cosine: Array) -> Array:
    """Return ``E / pi`` of a surface whose normal has a cosine with the upward direction."""
    return sky * (0.5 + 0.5 * cosine) + ground * (0.5 - 0.5 * cosine)


def upward(scene: Any) -> np.ndarray:
    """Return the axis of the world, or its opposite, nearest to the camera's up vector."""
    column = np.array(scene.sensors()[0].world_transform().matrix, float).reshape(4, 4, -1)[
        :3, 1, 0
    ]
    axis = int(np.argmax(np.abs(column)))
    return np.sign(column[axis]) * np.eye(3)[axis]


def fit(gathered: Gathered, up: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return sky and ground, (K,) each and not negative, by weighted least squares.

    If one would be negative it is 0, and the other alone keeps the mean.
    """
    cosine = gathered.normal @ up
    found = [
        _fit_one(cosine, arriving, weight)
        for arriving, weight in zip(gathered.arriving.T, gathered.k_d.T, strict=True)
    ]
    sky, ground = np.transpose(found)
    return sky, ground


def _fit_one(cosine: np.ndarray, arriving: np.ndarray, weight: np.ndarray) -> tuple[float, float]:
    """Fit one channel: ``A + B c`` with ``A`` through the mean, and ``|B| <= A``."""
    total = weight.sum()
    if total <= 0:
        return 0.0, 0.0
    middle, mean = (weight @ cosine / total, weight @ arriving / total)
    spread = weight @ (cosine - middle) ** 2 + EVENNESS * total
    slope = weight @ ((cosine - middle) * (arriving - mean)) / spread
    # sky = A + B and ground = A - B are not negative, with A + B middle = mean.
    slope = float(np.clip(slope, -mean / (1 - middle + 1e-9), mean / (1 + middle + 1e-9)))
    level = mean - slope * middle
    return max(level + slope, 0.0), max(level - slope, 0.0)


def prepare(scene: Any) -> SkyAndGround:
    """Fit sky and ground to the indirect light of a scene."""
    up = upward(scene)
    sky, ground = fit(gather(scene), up)
    return SkyAndGround(Table(sky), Table(ground), up.tolist(), has_environment(scene))


def shade(point: Point) -> Array:
    """Return the chapters' model with the light of sky and ground."""
    prepared = point.prepared
    sky, ground = (one.at(point.wavelengths) for one in (prepared.sky, prepared.ground))
    cosine = dr.dot(point.normal, mi.Vector3f(prepared.up))
    return lit(point, irradiance(sky, ground, cosine), prepared.replaces_ambient)


HEMISPHERE = HEURISTICS.own(
    Heuristic(
        "hemisphere-ambient",
        shade,
        "hemisphere ambient light",
        needs=frozenset(INPUTS) - {"uv", "visible"},
        prepare=prepare,
    )
)
