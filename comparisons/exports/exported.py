"""A scene as plain data: camera, triangles, materials and lights as paired, and what pixels see.

Everything is in world space and in display-linear units, those of the heuristic half.
"""

from dataclasses import dataclass, fields
from math import radians, tan

import drjit as dr
import mitsuba as mi
import numpy as np

from comparisons.options import Options
from heuristic import meshes
from heuristic.errors import InputError
from heuristic.light import PLUGINS
from heuristic.materials import COEFFICIENTS, PHYSICAL
from reference.pairing.halves import pair
from reference.rendering.gbuffer import image_size
from reference.scene.source import Source

KINDS = {kind: plugin.removeprefix("heuristic_") for plugin, kind in PLUGINS.items()}


@dataclass(frozen=True)
class Triangles:
    """A shape: positions and normals (V, 3), texture coordinates (V, 2), faces (F, 3).

    ``normals`` is None where faces are flat; ``material`` is a number in :class:`Exported`.
    """

    name: str
    positions: np.ndarray
    normals: np.ndarray | None
    texcoords: np.ndarray | None
    faces: np.ndarray
    material: int


@dataclass(frozen=True)
class Exported:
    """A scene as plain data.

    Attributes
    ----------
    name
        The scene's.
    camera
        See :func:`camera`.
    shapes, materials, lights
        Materials and lights as JSON has them, by :func:`exported`.
    ambient
        I_a, three numbers.
    layers
        Of the pixel centres: ``P`` and ``N`` (H, W, 3), and ``shape`` (H, W), the number of the
        shape from 1, 0 where there is none.
    """

    name: str
    camera: dict
    shapes: tuple[Triangles, ...]
    materials: tuple[dict, ...]
    lights: tuple[dict, ...]
    ambient: tuple[float, ...]
    layers: dict[str, np.ndarray]


def exported(source: Source, options: Options) -> Exported:
    """Return a scene as plain data, for the current variant, which is RGB.

    Raises
    ------
    InputError
        For a camera without a perspective matrix, a shape that has no triangles, and what pairing
        refuses.
    """
    if not mi.is_rgb:
        raise InputError(f"variant {mi.variant()}: scenes are exported in RGB. Give llvm_ad_rgb.")
    found = pair(
        source,
        options.convention,
        options.resolution,
        prune=False,
        sensor=options.sensor,
        with_partners=True,
    )
    scene = found.heuristic.instantiate()
    bsdfs = list(dict.fromkeys(shape.bsdf() for shape in scene.shapes()))
    shapes = tuple(
        _triangles(shape, bsdfs.index(shape.bsdf()), options.tessellation)
        for shape in scene.shapes()
    )
    point = dr.zeros(mi.SurfaceInteraction3f)
    lights = [emitter for emitter in scene.emitters() if hasattr(emitter, "light")]
    return Exported(
        source.name,
        camera(scene),
        shapes,
        tuple(_material(bsdf, number, scene) for number, bsdf in enumerate(bsdfs)),
        tuple(_light(emitter, point) for emitter in lights),
        tuple(_numbers(mi.Color3f(scene.integrator().ambient.eval(point)))),
        _layers(scene),
    )


def camera(scene: mi.Scene) -> dict:
    """Return the camera as matrices, rows of numbers.

    ``to_world`` is Mitsuba's: the camera looks along +z, +y is up, +x to the left. ``view`` and
    ``projection`` are OpenGL's: the camera looks along -z, +y is up, +x to the right, and what is
    seen has -1 to 1 in each coordinate of ``projection view p / w``.
    """
    sensor = scene.sensors()[0]
    values = mi.traverse(sensor)
    if "Perspective" not in sensor.class_name():
        raise InputError(
            f"sensor {sensor.id()!r} is a {sensor.class_name()}: perspective cameras are exported."
        )
    offsets = [_numbers(values[f"principal_point_offset_{axis}"])[0] for axis in ("x", "y")]
    if any(offsets):
        raise InputError(f"sensor {sensor.id()!r}: its principal point is not in the middle.")
    width, height = image_size(scene)
    to_world = np.array(values["to_world"].matrix, float).reshape(4, 4, -1)[..., 0]
    x_fov = _numbers(values["x_fov"])[0]
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


def _triangles(shape: mi.Shape, material: int, tessellation: int | None) -> Triangles:
    mesh = meshes.to_mesh(shape, tessellation or meshes.RESOLUTION)
    values = mi.traverse(mesh)
    normals = not mesh.has_face_normals() and mesh.has_vertex_normals()

    def rows(name: str, width: int) -> np.ndarray:
        return np.array(values[name]).reshape(-1, width)

    return Triangles(
        shape.id(),
        rows("vertex_positions", 3),
        rows("vertex_normals", 3) if normals else None,
        rows("vertex_texcoords", 2) if mesh.has_vertex_texcoords() else None,
        rows("faces", 3),
        material,
    )


def _material(bsdf: mi.BSDF, number: int, scene: mi.Scene) -> dict:
    """Return a material; of what varies over the surface, the value in the middle of its map."""
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
    values = {name: _numbers(mi.Color3f(getattr(found, name))) for name in COEFFICIENTS}
    values |= {"n": _numbers(found.n)[0], "base_color": _numbers(mi.Color3f(found.base_color))}
    values |= {name: _numbers(getattr(found, name))[0] for name in PHYSICAL[1:]}
    shapes = [shape.id() for shape in scene.shapes() if shape.bsdf() == bsdf]
    name = bsdf.id() or f"material {number + 1}"
    form = {"form": found.form, "normalised": found.normalised, "twosided": bool(bsdf.twosided)}
    return {"name": name, **values, **form, "varies": varies, "shapes": shapes}


def _light(emitter: mi.Emitter, point: mi.SurfaceInteraction3f) -> dict:
    """Return a light as paired; ``intensity`` is I_p, and ``attenuation`` k0, k1, k2 of 6.1."""
    light = emitter.light(point, True)
    found = {"name": emitter.id(), "type": KINDS[type(light)]}
    for field in fields(light):
        value = getattr(light, field.name)
        if field.name == "intensity":
            found[field.name] = _numbers(mi.Color3f(value))
        elif field.name == "clamped":
            found[field.name] = bool(value)
        elif isinstance(value, tuple):
            found[field.name] = [_numbers(each)[0] for each in value]
        else:
            numbers = _numbers(value)
            found[field.name] = numbers if len(numbers) > 1 else numbers[0]
    return found


def _layers(scene: mi.Scene) -> dict[str, np.ndarray]:
    """Trace the rays through the pixel centres."""
    width, height = image_size(scene)
    x, y = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    place = mi.Point2f(mi.Float(x.ravel()), mi.Float(y.ravel()))
    ray, _ = scene.sensors()[0].sample_ray_differential(0.0, 0.5, place, mi.Point2f(0.5))
    si = scene.ray_intersect(ray)
    hit = np.array(si.is_valid()).reshape(height, width)
    pointers = np.array(dr.reinterpret_array(mi.UInt32, si.shape)).reshape(height, width)
    number = np.zeros((height, width), np.float32)
    for place_, shape in enumerate(scene.shapes(), start=1):
        own = int(dr.reinterpret_array(mi.UInt32, mi.ShapePtr(shape))[0])
        number[hit & (pointers == own)] = place_
    normal = dr.mulsign(mi.Vector3f(si.sh_frame.n), si.wi.z)
    vectors = {
        name: np.where(hit[..., None], np.array(value).T.reshape(height, width, 3), 0)
        for name, value in (("P", mi.Vector3f(si.p)), ("N", normal))
    }
    return vectors | {"shape": number}


def _numbers(value: object) -> list[float]:
    """Return a Dr.Jit value of one entry as numbers, in the decimals of single precision."""
    return [float(str(np.float32(each))) for each in np.ravel(np.array(value))]
