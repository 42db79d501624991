"""Ambient light that is set to the indirect light of a scene: one colour, or sky and ground.

``I = ... + k_d A``, where ``A`` stands for the indirect light at the points that the camera sees
(:mod:`heuristic.approximations.indirect`). In ``mean-ambient`` it is their mean, each weighted by
its ``k_d``: artists of the 1990s set ``I_a`` by hand to imitate it, and the mean is the best single
number for the image's level.

In ``hemisphere-ambient`` it comes from a sky of radiance ``S`` above the horizon and a ground of
``G`` below. A surface with ``c = n.up`` receives ``E / pi = S (1 + c) / 2 + G (1 - c) / 2``: the
integral of both halves over its hemisphere. ``S`` and ``G`` are fitted by least squares to the same
points, which keeps the image's mean.

``I_a`` stands for the environment if the scene has one, and is then replaced. If the scene has its
own ``I_a``, it stays, and the light reflected by surfaces is added.
"""

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from heuristic import colours
from heuristic.approximations.indirect import GatheredLight, Table, gather
from heuristic.heuristics import Heuristic
from heuristic.points import INPUTS, Array, Point

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


def upward(scene: Any) -> np.ndarray:
    """Return the axis of the world, or its opposite, nearest to the camera's up vector."""
    matrix = np.array(scene.sensors()[0].world_transform().matrix, float)
    column = matrix.reshape(4, 4, -1)[:3, 1, 0]
    axis = int(np.argmax(np.abs(column)))
    return np.sign(column[axis]) * np.eye(3)[axis]


def fit(gathered: GatheredLight, up: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return sky and ground, (K,) each and not negative, by weighted least squares.

    A channel is ``A + B c`` with ``A`` through the mean, and ``|B| <= A``: if sky or ground would
    be negative it is 0, and the other alone keeps the mean.
    """
    cosine = (gathered.normal @ up)[:, None]
    weight, total = gathered.k_d, gathered.k_d.sum(axis=0)
    share = np.divide(weight, total, out=np.zeros_like(weight), where=total > 0)
    middle, mean = (share * cosine).sum(axis=0), gathered.mean()
    spread = (share * (cosine - middle) ** 2).sum(axis=0) + EVENNESS
    slope = (share * (cosine - middle) * (gathered.arriving - mean)).sum(axis=0) / spread
    # sky = A + B and ground = A - B are not negative, with A + B middle = mean.
    slope = np.clip(slope, -mean / (1 - middle + 1e-9), mean / (1 + middle + 1e-9))
    level = mean - slope * middle
    return np.maximum(level + slope, 0), np.maximum(level - slope, 0)


def prepare_mean(scene: Any) -> SkyAndGround:
    """Gather the mean of the indirect light of a scene."""
    mean = gather(scene).mean()
    return SkyAndGround(Table(mean), Table(mean), [0.0, 0.0, 1.0], scene.environment() is not None)


def prepare(scene: Any) -> SkyAndGround:
    """Fit sky and ground to the indirect light of a scene."""
    up = upward(scene)
    sky, ground = fit(gather(scene), up)
    return SkyAndGround(Table(sky), Table(ground), up.tolist(), scene.environment() is not None)


def shade_mean(point: Point) -> Array:
    """Return the chapters' model with the mean of the indirect light."""
    return _with_light(point, point.prepared.sky.at(point.wavelengths))


def shade(point: Point) -> Array:
    """Return the chapters' model with the light of sky and ground."""
    sky, ground = (one.at(point.wavelengths) for one in (point.prepared.sky, point.prepared.ground))
    cosine = dr.dot(point.normal, mi.Vector3f(point.prepared.up))
    return _with_light(point, sky * (0.5 + 0.5 * cosine) + ground * (0.5 - 0.5 * cosine))


def _with_light(point: Point, arriving: Array) -> Array:
    """Return the chapters' model plus ``k_d`` times the light ``E / pi`` from all around."""
    ambient = colours.checked("ambient", point.arguments.ambient)
    stays = not (point.prepared.replaces_ambient or colours.is_zero(ambient))
    colour = point.textbook(ambient=ambient if stays else 0)
    return colour + point.material.k_d * arriving


_NEEDS = frozenset(INPUTS) - {"uv", "visible"}
MEAN = Heuristic(
    "mean-ambient", shade_mean, "mean ambient light", needs=_NEEDS, prepare=prepare_mean
)
HEMISPHERE = Heuristic(
    "hemisphere-ambient", shade, "hemisphere ambient light", needs=_NEEDS, prepare=prepare
)
