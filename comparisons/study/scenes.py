"""The built-in study scenes, and their parameters.

``lobe`` needs no image: a flat surface under parallel light has one radiance per direction, which
the kernel and Mitsuba's BSDF give directly (:mod:`comparisons.study.surface`). The others are
rendered.
All materials are grey. Lights give the irradiance ``pi`` where the surface (the centre of the
sphere) faces them: a white diffuse surface has the value 1 there.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, inf, radians, sin, tan
from typing import Any, TypeAlias

import mitsuba as mi

Point: TypeAlias = dict[str, float]
"""Values by parameter."""

Dict: TypeAlias = dict[str, Any]
"""What ``mitsuba.load_dict`` takes."""

Vector: TypeAlias = tuple[float, float, float]

CAMERA_DISTANCE, LIGHT_DISTANCE = 8.0, 10.0
"""For ``sphere``, in radii: a lamp of any size is behind the camera."""

ROOM, CEILING = 4.0, 3.9
"""For ``enclosure``, in radii: half the room's side, and the lamp's height."""


@dataclass(frozen=True)
class StudyParameter:
    """A parameter: its unit, inclusive range, default, and meaning."""

    unit: str
    low: float
    high: float
    default: float
    meaning: str


ROUGHPLASTIC = {
    "alpha": StudyParameter("1", 0.02, 1, 0.3, "roughness of roughplastic: root mean square slope"),
    "int_ior": StudyParameter("1", 1.05, 4, 1.5, "index of refraction of roughplastic"),
    "reflectance": StudyParameter("1", 0, 1, 0.5, "diffuse reflectance of roughplastic"),
}
PHONG = {
    "n": StudyParameter("1", 0, 1e4, 9, "Phong's exponent"),
    "k_d": StudyParameter("1", 0, 1, 0.5, "diffuse coefficient of Phong's model"),
    "k_s": StudyParameter("1", 0, 1e4, 0.5, "specular coefficient of Phong's model"),
}
LIGHT_ANGLE = StudyParameter("deg", 0, 89, 45, "angle of the light to the normal")
PHASE_ANGLE = StudyParameter(
    "deg", 0, 90, 45, "angle between the light and the viewer at the centre"
)
LIGHT_SIZE = StudyParameter("deg", 0.1, 120, 2, "angular diameter of the lamp, from the centre")
WALL_ALBEDO = StudyParameter("1", 0, 0.95, 0.5, "reflectance of the walls")


def bsdf(point: Point) -> Dict:
    """Return the dictionary of a point's material, ``roughplastic`` or ``phong``."""
    if "n" in point:
        return {"type": "phong", "k_d": point["k_d"], "k_s": point["k_s"], "n": point["n"]}
    return {
        "type": "roughplastic",
        "alpha": point["alpha"],
        "int_ior": point["int_ior"],
        "ext_ior": 1.0,
        "diffuse_reflectance": point["reflectance"],
    }


def _sphere(point: Point, material: Dict) -> Dict:
    angle = radians(point["light_angle"])
    place = (LIGHT_DISTANCE * sin(angle), 0.0, LIGHT_DISTANCE * cos(angle))
    return {
        "type": "scene",
        "integrator": {"type": "path", "hide_emitters": True},
        "sensor": _camera((0, 0, CAMERA_DISTANCE), (0, 0, 0), (0, 1, 0), 16.0),
        "sphere": {"type": "sphere", "bsdf": material},
        "lamp": _lamp(place, LIGHT_DISTANCE, point["light_size"]),
    }


def _enclosure(point: Point, material: Dict) -> Dict:
    return {
        "type": "scene",
        "integrator": {"type": "path", "hide_emitters": True},
        "sensor": _camera((0, -3.8, 0.5), (0, 0, -0.4), (0, 0, 1), 60.0),
        "sphere": {"type": "sphere", "bsdf": material},
        "walls": {
            "type": "cube",
            "flip_normals": True,
            "to_world": mi.ScalarTransform4f().scale(ROOM),
            "bsdf": {"type": "diffuse", "reflectance": point["wall_albedo"]},
        },
        "lamp": _lamp((0.0, 0.0, CEILING), CEILING, point["light_size"]),
    }


def _lamp(place: Vector, distance: float, size: float) -> Dict:
    """Return a disk of a given angular size that faces the origin, with irradiance ``pi`` there.

    A disk of radiance ``L`` and half angle ``a`` gives ``E = pi L sin^2(a)`` on its axis.
    """
    half = radians(size) / 2
    # `up` must not be parallel to the axis; lamps are in the plane y = 0.
    to_world = mi.ScalarTransform4f().look_at(place, (0, 0, 0), (0, 1, 0))
    return {
        "type": "disk",
        "to_world": to_world.scale(distance * tan(half)),
        "bsdf": {"type": "diffuse", "reflectance": 0.0},
        "emitter": {"type": "area", "radiance": 1 / sin(half) ** 2},
    }


def _camera(place: Vector, target: Vector, up: Vector, field_of_view: float) -> Dict:
    return {
        "type": "perspective",
        "fov": field_of_view,
        "to_world": mi.ScalarTransform4f().look_at(place, target, up),
        "film": {"type": "hdrfilm", "rfilter": {"type": "box"}},
    }


SCENES = {
    # A flat surface under parallel light, seen from all directions.
    "lobe": {"light_angle": LIGHT_ANGLE},
    # A sphere under a round lamp far away.
    "sphere": {"light_angle": PHASE_ANGLE, "light_size": LIGHT_SIZE},
    # A sphere in a closed room of diffuse walls, under a round lamp at the ceiling.
    "enclosure": {"light_size": LIGHT_SIZE, "wall_albedo": WALL_ALBEDO},
}
"""The parameters of the study scenes, besides those of one of the two materials. Other scenes are
studied through paths to their parameters."""

RENDERED: dict[str, Callable[[Point, Dict], Dict]] = {"sphere": _sphere, "enclosure": _enclosure}
"""What makes the dictionaries of study scenes from a point and a BSDF."""

UNLIMITED = StudyParameter("", -inf, inf, 0, "a parameter of the scene, by its path")
"""Any parameter of a user's scene."""
