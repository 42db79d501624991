"""Radiance as a witness of the reference: whole diffuse scenes by a program that shares no code.

The translation reads shapes, reflectances, lights and camera of a Mitsuba scene, and leaves
intersections, sampling and sums to Radiance's ``rtrace``.

- An ambient ray goes on as one ray (``-ad 1``), and none is stored (``-aa 0``) or ended early
  (``-lr``, ``-lw``). A shadow ray goes to a random point of each lamp (``-ds 0 -dj 1``).
- Only ambient rays find the sky, whose light is rendered by itself, with one bounce more.
- Lamps in Radiance are black to ambient rays. One that reflects is a plate that lets a share of
  light through, straight; the lamp is just behind it, and brighter.
- ``front`` makes the backs of surfaces black, as those of Mitsuba's ``diffuse``.
- Cameras see lamps, but look through an ``illum``, as through Mitsuba's point lights.
"""

import subprocess
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import mitsuba as mi
import numpy as np
import pyradiance

from fotismos.comparisons.plain_scene import camera

FOLDER = Path(pyradiance.__file__).parent
OPTIONS = "-h -fff -w -u+ -aa 0 -ad 1 -as 0 -lr 99 -lw 0 -dt 0 -dc 1 -dr 0 -ds 0 -dj 1 -st 0"

GAP = 2e-6
"""Between plate and lamp. What is nearer than 1e-6 Radiance takes for one surface."""

POINT, SUN = 1e-3, 0.01
"""The radius of a point light, and the angle of parallel light in degrees."""

SQUARE = np.array([(-1, -1, 0, 1), (1, -1, 0, 1), (1, 1, 0, 1), (-1, 1, 0, 1)])

RAYS = 64
"""Per pixel and pass, in a lattice that is shifted at random."""


def render(scene: mi.Scene, depth: int, passes: int) -> np.ndarray:
    """Return passes (P, H, W, 3) with paths of Mitsuba's ``max_depth``; the clock seeds them."""
    seen = camera(scene)
    rays, total = _rays(seen, passes), 0.0
    for of_sky in {light.is_environment() for light in scene.emitters()}:
        with TemporaryDirectory() as folder:
            octree = Path(folder, "octree")
            octree.write_bytes(_run("oconv -", translated(scene, of_sky).encode()))
            found = _run(f"rtrace {OPTIONS} -ab {depth - 2 + of_sky} {octree}", rays)
        values = np.frombuffer(found, np.float32)
        values = values.reshape(passes, seen["height"], seen["width"], RAYS, 3)
        total = total + values.mean(axis=3, dtype=float)
    return total


def translated(scene: mi.Scene, of_sky: bool) -> str:
    """Return a scene in Radiance's language, with the light of the sky or of lamps alone."""
    lines = ["void brightfunc front 2 if(Rdot,1,0) . 0 0"]
    for number, shape in enumerate(scene.shapes()):
        lines += _shape(f"shape{number}", shape, mi.traverse(shape), of_sky)
    for number, light in enumerate(scene.emitters()):
        if light.is_environment() == of_sky:
            lines += _light(f"light{number}", light.class_name(), mi.traverse(light))
    return "\n".join(lines)


def _shape(name: str, shape: mi.Shape, values: Any, of_sky: bool) -> Iterator[str]:
    """Yield a rectangle, which may shine, a sphere, or the triangles of a mesh."""
    colour, to_world, share = _rgb(values, "reflectance"), _matrix(values), 0.0
    kind, parts = "polygon", [SQUARE @ to_world.T]
    if shape.is_emitter() and not of_sky:
        share = 1 - colour.max()
        colour = colour / colour.max()
        behind = parts[0] - GAP * to_world[:, 2] / np.linalg.norm(to_world[:, 2])
        yield _primitive("void light", f"{name}.lamp", _rgb(values, "radiance") / colour / share)
        yield _primitive(f"{name}.lamp polygon", f"{name}.behind", behind)
    elif shape.class_name() == "Sphere":
        kind, parts = "sphere", [[*to_world[:, 3], np.linalg.norm(to_world[:, 0])]]
    elif shape.class_name() != "Rectangle":
        points = np.reshape(values["vertex_positions"], (-1, 3))
        parts = points[np.reshape(values["faces"], (-1, 3))]
    yield _primitive("front trans", name, [*colour, 0, 0, share, 1])
    for number, part in enumerate(parts):
        yield _primitive(f"{name} {kind}", f"{name}.{number}", part)


def _light(name: str, kind: str, values: Any) -> Iterator[str]:
    """Yield a light that is not a shape's."""
    if kind == "PointLight":
        yield _primitive("void illum", name, _rgb(values, "intensity") / (np.pi * POINT**2))
        yield _primitive(f"{name} sphere", f"{name}.0", [*np.ravel(values["position"]), POINT])
    elif kind == "DirectionalEmitter":
        solid_angle = 2 * np.pi * (1 - np.cos(np.radians(SUN / 2)))
        yield _primitive("void light", name, _rgb(values, "irradiance") / solid_angle)
        yield _primitive(f"{name} source", f"{name}.0", [*-_matrix(values)[:, 2], SUN])
    elif kind == "ConstantBackgroundEmitter":
        yield _primitive("void glow", name, [*_rgb(values, "radiance"), 0])
        yield _primitive(f"{name} source", f"{name}.0", [0, 0, 1, 360])


def _primitive(kind: str, name: str, numbers: Any) -> str:
    return f"{kind} {name} 0 0 {np.size(numbers)} {' '.join(map(str, np.ravel(numbers)))}"


def _rgb(values: Any, quantity: str) -> np.ndarray:
    key = next(key for key, _ in values if key.endswith(f"{quantity}.value"))
    return np.broadcast_to(np.ravel(values[key]), 3).astype(float)


def _matrix(values: Any) -> np.ndarray:
    matrix = values["to_world"].matrix if "to_world" in values else np.eye(4)  # of a mesh
    return np.reshape(matrix, (4, 4))[:3].astype(float)


def _rays(seen: dict, passes: int) -> bytes:
    """Return origins and directions (P, H, W, RAYS, 6)."""
    width, height, to_world = seen["width"], seen["height"], np.array(seen["to_world"])
    shifts = np.random.default_rng().random((2, passes, height, width, 1))
    steps = np.outer((1 / RAYS, (5**0.5 - 1) / 2), np.arange(RAYS))[:, None, None, None]
    u, v = (shifts + steps) % 1
    x = width - 2 * (np.arange(width)[:, None] + u)
    y = height - 2 * (np.arange(height)[:, None, None] + v)
    z = np.full_like(x, width / np.tan(np.radians(seen["x_fov_degrees"]) / 2))
    way = np.stack([x, y, z], axis=-1) @ to_world[:3, :3].T
    rays = np.concatenate([np.broadcast_to(to_world[:3, 3], way.shape), way], axis=-1)
    return rays.astype(np.float32).tobytes()


def _run(command: str, given: bytes) -> bytes:
    program, *words = command.split()
    words = [str(FOLDER / "bin" / program), *words]
    environment = {"RAYPATH": str(FOLDER / "lib")}
    return subprocess.run(words, input=given, stdout=-1, check=True, env=environment).stdout
