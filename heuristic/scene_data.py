"""The heuristic half of a scene as plain data: camera, triangles, materials, lights.

Everything is in world space and in the kernel's display-linear units.
"""

from dataclasses import dataclass, fields
from math import radians, tan
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from heuristic import mesh_arrays, meshes
from heuristic.errors import InputError
from heuristic.light import PLUGINS
from heuristic.materials import COEFFICIENTS, PHYSICAL

KINDS = {kind: plugin.removeprefix("heuristic_") for plugin, kind in PLUGINS.items()}


@dataclass(frozen=True)
class Triangles:
    """A shape: positions and normals (V, 3), texture coordinates (V, 2), faces (F, 3).

    ``normals`` is None where faces are flat; ``material`` is a number in ``Exported``.
    """

    name: str
    positions: np.ndarray
    normals: np.ndarray | None
    texcoords: np.ndarray | None
    faces: np.ndarray
    material: int


def camera(scene: mi.Scene) -> dict:
    """Return the camera as matrices, rows of numbers.

    ``to_world`` is Mitsuba's: the camera looks along +z, +y is up, +x to the left. ``view`` and
    ``projection`` are OpenGL's: the camera looks along -z, +y is up, +x to the right, and visible
    points have -1 to 1 in each coordinate of ``projection view p / w``.
    """
    sensor = scene.sensors()[0]
    values = mi.traverse(sensor)
    if "Perspective" not in sensor.class_name():
        raise InputError(
            f"sensor {sensor.id()!r} is a {sensor.class_name()}, but only perspective cameras can"
            " be exported."
        )
    offsets = [numbers(values[f"principal_point_offset_{axis}"])[0] for axis in ("x", "y")]
    if any(offsets):
        raise InputError(f"sensor {sensor.id()!r}: its principal point must be in the middle.")
    width, height = (int(side) for side in sensor.film().crop_size())
    to_world = np.array(values["to_world"].matrix, float).reshape(4, 4, -1)[..., 0]
    x_fov = numbers(values["x_fov"])[0]
    near, far = float(sensor.near_clip()), float(sensor.far_clip())
    scale = 1 / tan(radians(x_fov) / 2)
    depth = far - near
    projection = [
        [scale, 0.0, 0.0, 0.0],
        [0.0, scale * width / height, 0.0, 0.0],
        [0.0, 0.0, -(far + near) / depth, -2 * far * near / depth],
        [0.0, 0.0, -1.0, 0.0],
    ]
    view = np.diag([-1.0, 1.0, -1.0, 1.0]) @ np.linalg.inv(to_world)
    return {
        "width": width,
        "height": height,
        "x_fov_degrees": x_fov,
        "near": near,
        "far": far,
        "to_world": to_world.tolist(),
        "view": view.tolist(),
        "projection": projection,
    }


def triangles_of(shape: mi.Shape, material: int, tessellation: int | None) -> Triangles:
    """Return a shape as the triangles of :func:`heuristic.meshes.to_mesh`."""
    mesh = meshes.to_mesh(shape, tessellation or meshes.RESOLUTION)

    def own(part: mesh_arrays.Part) -> np.ndarray | None:
        return mesh_arrays.rows(mesh, part) if mesh_arrays.has(mesh, part) else None

    return Triangles(
        shape.id(),
        mesh_arrays.rows(mesh, mesh_arrays.POSITIONS),
        None if mesh.has_face_normals() else own(mesh_arrays.NORMALS),
        own(mesh_arrays.TEXCOORDS),
        mesh_arrays.rows(mesh, mesh_arrays.FACES),
        material,
    )


def material_of(bsdf: mi.BSDF, number: int, scene: mi.Scene) -> dict:
    """Return a material; a texture gives the value in its middle."""
    point = dr.zeros(mi.SurfaceInteraction3f)
    point.uv = mi.Point2f(0.5)
    found = bsdf.material(point, True, False, None, True)
    textures = {name: getattr(bsdf, name) for name in (*COEFFICIENTS, "n", "base_color")}
    textures |= bsdf.partner
    varies = [
        name
        for name, value in textures.items()
        if isinstance(value, mi.Texture) and value.is_spatially_varying()
    ]
    values: dict[str, Any]
    values = {name: numbers(mi.Color3f(getattr(found, name))) for name in COEFFICIENTS}
    values |= {"n": numbers(found.n)[0], "base_color": numbers(mi.Color3f(found.base_color))}
    values |= {name: numbers(getattr(found, name))[0] for name in PHYSICAL[1:]}
    shapes = [shape.id() for shape in scene.shapes() if shape.bsdf() == bsdf]
    name = bsdf.id() or f"material {number + 1}"
    form = {"form": found.form, "normalised": found.normalised, "twosided": bool(bsdf.twosided)}
    return {"name": name, **values, **form, "varies": varies, "shapes": shapes}


def light_of(emitter: mi.Emitter, point: mi.SurfaceInteraction3f) -> dict:
    """Return a light as paired; ``intensity`` is I_p, and ``attenuation`` k0, k1, k2 of 6.1."""
    light = emitter.light(point, True)
    found = {"name": emitter.id(), "type": KINDS[type(light)]}
    for field in fields(light):
        value = getattr(light, field.name)
        if field.name == "intensity":
            found[field.name] = numbers(mi.Color3f(value))
        elif field.name == "clamped":
            found[field.name] = bool(value)
        elif isinstance(value, tuple):
            found[field.name] = [numbers(each)[0] for each in value]
        else:
            several = numbers(value)
            found[field.name] = several if len(several) > 1 else several[0]
    return found


def numbers(value: object) -> list[float]:
    """Return a Dr.Jit value of one entry as numbers, in the decimals of single precision."""
    return [float(str(np.float32(each))) for each in np.ravel(np.array(value))]
