"""The built-in study scenes, and their parameters.

All materials are grey. Lights give the irradiance ``pi`` where the surface (the centre of the
sphere) faces them: a white diffuse surface has the value 1 there.

``lobe`` needs no image: a flat surface under parallel light has one radiance per direction, which
the kernel and Mitsuba's BSDF give directly. The surface lies in the plane z = 0, and the light in
the plane y = 0 at negative x, so its mirror image is at azimuth 0. Directions point away from the
surface. The others are rendered.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache
from math import cos, inf, isfinite, radians, sin, tan
from typing import Any, TypeAlias

import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike

from fotismos.comparisons.audit import furnace
from fotismos.comparisons.audit.subjects import shaded
from fotismos.comparisons.halves import Halves
from fotismos.comparisons.options import Options
from fotismos.comparisons.pictures import FEWEST, Pictures
from fotismos.heuristic import heuristics
from fotismos.heuristic.errors import InputError
from fotismos.heuristic.lights import DirectionalLight
from fotismos.reference.pairing.albedo import RoughPlastic, to_phong, to_roughplastic
from fotismos.reference.pairing.factors import Convention, Phong
from fotismos.reference.pairing.pairing_record import Miss

Point: TypeAlias = dict[str, float]
"""Values by parameter."""

Dict: TypeAlias = dict[str, Any]
"""What ``mitsuba.load_dict`` takes."""

Vector: TypeAlias = tuple[float, float, float]

CAMERA_DISTANCE = 8.0
LIGHT_DISTANCE = 10.0
"""For ``sphere``, in radii: a lamp of any size is behind the camera."""

ROOM = 4.0
CEILING = 3.9
"""For ``enclosure``, in radii: half the room's side, and the lamp's height."""


@dataclass(frozen=True)
class StudyParameter:
    """A parameter: its unit, inclusive range, default, and meaning."""

    unit: str
    low: float
    high: float
    default: float
    meaning: str

    def checked(self, value: float, where: str) -> float:
        """Return a value of the parameter; `InputError` begins with ``where`` it was given."""
        if not (isfinite(value) and self.low <= value <= self.high):
            span = f"number from {self.low:g} to {self.high:g} {self.unit}".removesuffix(" 1")
            allowed = span if isfinite(self.low) else "finite number"
            raise InputError(f"{where} = {value:g}: give a {allowed}.")
        return value


ROUGHPLASTIC = {
    "alpha": StudyParameter(
        unit="1",
        low=0.02,
        high=1,
        default=0.3,
        meaning="roughness of roughplastic: root mean square slope",
    ),
    "int_ior": StudyParameter(
        unit="1", low=1.05, high=4, default=1.5, meaning="index of refraction of roughplastic"
    ),
    "reflectance": StudyParameter(
        unit="1", low=0, high=1, default=0.5, meaning="diffuse reflectance of roughplastic"
    ),
}
PHONG = {
    "n": StudyParameter(unit="1", low=0, high=1e4, default=9, meaning="Phong's exponent"),
    "k_d": StudyParameter(
        unit="1", low=0, high=1, default=0.5, meaning="diffuse coefficient of Phong's model"
    ),
    "k_s": StudyParameter(
        unit="1", low=0, high=1e4, default=0.5, meaning="specular coefficient of Phong's model"
    ),
}
LIGHT_ANGLE = StudyParameter(
    unit="deg", low=0, high=89, default=45, meaning="angle of the light to the normal"
)
PHASE_ANGLE = StudyParameter(
    unit="deg",
    low=0,
    high=90,
    default=45,
    meaning="angle between the light and the viewer at the centre",
)
LIGHT_SIZE = StudyParameter(
    unit="deg",
    low=0.1,
    high=120,
    default=2,
    meaning="angular diameter of the lamp, from the centre",
)
WALL_ALBEDO = StudyParameter(
    unit="1", low=0, high=0.95, default=0.5, meaning="reflectance of the walls"
)


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
    position = (LIGHT_DISTANCE * sin(angle), 0.0, LIGHT_DISTANCE * cos(angle))
    return {
        "type": "scene",
        "integrator": {"type": "path", "hide_emitters": True},
        "sensor": _camera((0, 0, CAMERA_DISTANCE), (0, 0, 0), (0, 1, 0), 16.0),
        "sphere": {"type": "sphere", "bsdf": material},
        "lamp": _lamp(position, LIGHT_DISTANCE, point["light_size"]),
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


def _lamp(position: Vector, distance: float, size: float) -> Dict:
    """Return a disk of a given angular size that faces the origin, with irradiance ``pi`` there.

    A disk of radiance ``L`` and half angle ``a`` gives ``E = pi L sin^2(a)`` on its axis.
    """
    half = radians(size) / 2
    # `up` must not be parallel to the axis; lamps are in the plane y = 0.
    to_world = mi.ScalarTransform4f().look_at(position, (0, 0, 0), (0, 1, 0))
    return {
        "type": "disk",
        "to_world": to_world.scale(distance * tan(half)),
        "bsdf": {"type": "diffuse", "reflectance": 0.0},
        "emitter": {"type": "area", "radiance": 1 / sin(half) ** 2},
    }


def _camera(position: Vector, target: Vector, up: Vector, field_of_view: float) -> Dict:
    return {
        "type": "perspective",
        "fov": field_of_view,
        "to_world": mi.ScalarTransform4f().look_at(position, target, up),
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

UNLIMITED = StudyParameter(
    unit="", low=-inf, high=inf, default=0, meaning="a parameter of the scene, by its path"
)
"""Any parameter of a user's scene."""

# --- A flat surface ------------------------------------------------------------------------------

HEIGHTS = 240
AZIMUTHS = 120
"""Directions of the quadrature over half the hemisphere; the other half is symmetric."""

VIEW_HEIGHTS = 96
VIEW_AZIMUTHS = 64

PEAK_STEP = 0.05
"""Degrees between the directions searched for a lobe's peak."""


@lru_cache(maxsize=256)
def material(
    point: tuple[tuple[str, float], ...], convention: Convention
) -> tuple[Phong, RoughPlastic, tuple[Miss, ...]]:
    """Return a point's material in both models, of which it has one, and the pairing's misses."""
    values = dict(point)
    if "n" not in values:
        grey = (values["reflectance"],) * 3
        plastic = RoughPlastic(grey, values["alpha"], values["int_ior"])
        return to_phong(plastic, convention), plastic, ()
    k_d = (values["k_d"],) * 3
    k_s = (values["k_s"],) * 3
    phong = Phong(k_d, k_s, values["n"])
    if not any(k_s):  # pairing makes it plain diffuse, not roughplastic
        return phong, RoughPlastic(k_d, 1.0, 1.0), ()
    return phong, *to_roughplastic(phong, convention)


def columns(point: Point, convention: Convention) -> dict[str, float]:
    """Return the parameters of a point's material in both models, and the largest miss."""
    phong, plastic, misses = material(tuple(point.items()), convention)
    return {
        "miss": largest_miss(misses),
        "alpha": plastic.alpha,
        "int_ior": plastic.int_ior,
        "reflectance": plastic.diffuse_reflectance[0],
        "n": phong.n,
        "k_d": phong.k_d[0],
        "k_s": phong.k_s[0],
    }


def direction(theta: ArrayLike, phi: ArrayLike) -> np.ndarray:
    """Return unit vectors (3, N) from polar angles and azimuths in degrees."""
    return furnace.direction(np.deg2rad(theta), np.deg2rad(phi))


def heuristic_radiance(
    phong: Phong, light: np.ndarray, view: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the kernel's radiance (N,), in total and of the specular part alone.

    Directions (3, N) are of light and viewer. Display-linear: a white diffuse surface that faces
    the light has the value 1.
    """
    sun = DirectionalLight(-mi.Vector3f(light), 1.0)
    point = (0 * furnace.UP, furnace.UP, view)
    lobe = {"k_s": phong.k_s[0], "n": phong.n}
    total = np.array(shaded(heuristics.PHONG, point, lobe | {"k_d": phong.k_d[0]}, [sun]), float)[0]
    specular = np.array(shaded(heuristics.PHONG, point, lobe | {"k_d": 0.0}, [sun]), float)[0]
    return total, specular


def reference_radiance(
    plastic: RoughPlastic, light: np.ndarray, view: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the radiance of Mitsuba's BSDF, as :func:`heuristic_radiance` does."""
    diffuse = {"reflectance": plastic.diffuse_reflectance[0]}
    bsdfs = [{"type": "diffuse", **diffuse}] * 2
    # Equal indices have no interface, and no specular part.
    if plastic.int_ior != plastic.ext_ior:
        values = {name: getattr(plastic, name) for name in ("alpha", "int_ior", "ext_ior")}
        values |= {"type": "roughplastic", "diffuse_reflectance": diffuse["reflectance"]}
        # The specular part is the whole less the BSDF without it.
        bsdfs = [values | {"specular_reflectance": k} for k in (plastic.specular_reflectance[0], 0)]
    responses = [furnace.of_bsdf(mi.load_dict(bsdf))(light, view)[0] for bsdf in bsdfs]
    total, diffuse = responses
    return total, total - diffuse


@lru_cache(maxsize=1)
def hemisphere() -> tuple[np.ndarray, np.ndarray]:
    """Return directions (3, N) over half the hemisphere, with weights (N,) for means and albedos.

    These are the Gauss-Legendre nodes in polar angle and azimuth; weights are proportional to the
    projected solid angle, and sum to 1.
    """
    x, w = np.polynomial.legendre.leggauss(HEIGHTS)
    y, v = np.polynomial.legendre.leggauss(AZIMUTHS)
    theta, phi = np.meshgrid((x + 1) * 45, (y + 1) * 90)
    # `cos(theta) sin(theta)` is `sin(2 theta) / 2`, with `theta = (x + 1) 45`.
    weight = np.outer(v, w * np.sin(np.deg2rad(x * 90 + 90)))
    return direction(theta.ravel(), phi.ravel()), weight.ravel() / weight.sum()


@lru_cache(maxsize=1)
def views() -> np.ndarray:
    """Return directions of the viewer, (3, N), of equal projected solid angle.

    They cover half the hemisphere: centres of cells equal in ``sin^2(theta)`` and azimuth.
    """
    height = (np.arange(VIEW_HEIGHTS) + 0.5) / VIEW_HEIGHTS
    azimuth = (np.arange(VIEW_AZIMUTHS) + 0.5) * 180 / VIEW_AZIMUTHS
    theta, phi = np.meshgrid(np.rad2deg(np.arcsin(np.sqrt(height))), azimuth)
    return direction(theta.ravel(), phi.ravel())


def albedo(radiance: np.ndarray, light_angle: float) -> float:
    """Return the share of the light that leaves the surface, from radiances on :func:`hemisphere`.

    ``pi mean(L) / (pi cos(theta))``, the mean over projected solid angle: exitance over
    irradiance.
    """
    return float(hemisphere()[1] @ radiance / np.cos(np.deg2rad(light_angle)))


def lobe(point: Point, options: Options) -> tuple[dict[str, float], Halves]:
    """Return albedos and peaks of the specular part, and the halves, images (1, V, 3).

    The views have equal projected solid angles.
    """
    phong, plastic, _ = material(tuple(point.items()), Convention(options.pairing))
    angle = point["light_angle"]
    # All directions in one call: images, albedos, the plane of incidence, the mirror's.
    plane = direction(np.arange(0, 90, PEAK_STEP), 0.0)
    mirror = direction(angle, 0.0)
    parts = (views(), hemisphere()[0], plane, mirror)
    view = np.concatenate(parts, axis=1)
    light = np.broadcast_to(direction(angle, 180.0), view.shape)
    splits = np.cumsum([part.shape[1] for part in parts])[:-1]
    result = {}
    sources = []
    for half, (total, lobe_alone) in (
        ("heuristic", heuristic_radiance(phong, light, view)),
        ("reference", reference_radiance(plastic, light, view)),
    ):
        seen, everywhere, _, _ = np.split(total, splits)
        _, specular, in_plane, mirrored = np.split(lobe_alone, splits)
        sources.append(Pictures.of(half, [np.repeat(seen[None, :, None], 3, axis=2)]))
        result[f"albedo_{half}"] = albedo(everywhere, angle)
        result[f"specular_albedo_{half}"] = albedo(specular, angle)
        result[f"specular_{half}"] = float(mirrored[0])
        # A plateau of a degree or more is no peak.
        highest = in_plane > in_plane.max() * (1 - 1e-6)
        # n = 0 has no peak, and k_s = 0 no lobe.
        if in_plane.max() > 0 and np.count_nonzero(highest) * PEAK_STEP < 1:
            result[f"peak_{half}"] = float(np.argmax(in_plane)) * PEAK_STEP
    return result, Halves(
        name="lobe",
        options=options,
        first=sources[0],
        second=sources[1],
        passes=FEWEST,
        has=frozenset(),
        where=sources[0].opaque,
        is_exact=True,
    )


def largest_miss(misses: Iterable[Miss]) -> float:
    """Return the largest relative miss of a pairing, 0 if it is exact."""
    return max((abs(miss.reached / miss.wanted - 1) for miss in misses if miss.wanted), default=0.0)
