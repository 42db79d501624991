"""A scene as plain data: camera, triangles, paired materials and lights, and what pixels see.

Everything is in world space and in the textbook half's display-linear units.
"""

from dataclasses import dataclass
from math import radians, tan
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from fotismos.comparisons.options import Options
from fotismos.heuristic import meshes
from fotismos.heuristic.convention import Scene
from fotismos.heuristic.errors import InputError
from fotismos.heuristic.lights import INTENSITIES, lamps
from fotismos.heuristic.materials import COEFFICIENTS, PHYSICAL
from fotismos.heuristic.tessellation import RESOLUTION, to_mesh
from fotismos.reference.pairing.factors import Convention
from fotismos.reference.pairing.halves import PairOptions, pair
from fotismos.reference.rendering.gbuffer import gbuffer, image_size
from fotismos.reference.scene.source import Source


@dataclass(frozen=True)
class Triangles:
    """A shape: positions and normals (V, 3), texture coordinates (V, 2), faces (F, 3).

    ``normals`` is None where faces are flat; ``material`` is a number in ``PlainScene``.
    """

    name: str
    positions: np.ndarray
    normals: np.ndarray | None
    texcoords: np.ndarray | None
    faces: np.ndarray
    material: int


@dataclass(frozen=True)
class PlainScene:
    """A scene as plain data; the camera, materials and lights are JSON objects.

    ``layers`` are of the surfaces at the pixel centres: ``P`` and ``N`` (H, W, 3), and ``shape``
    (H, W), the shape's number from 1; 0 is the background.
    """

    name: str
    camera: dict[str, Any]
    shapes: tuple[Triangles, ...]
    materials: tuple[dict[str, Any], ...]
    lights: tuple[dict[str, Any], ...]
    ambient: tuple[float, ...]
    layers: dict[str, np.ndarray]


def plain_scene(source: Source, options: Options) -> PlainScene:
    """Return a scene as plain data, in the current variant, which must be RGB."""
    if not mi.is_rgb:
        raise InputError(f"variant {mi.variant()}: scenes are exported in RGB. Give llvm_ad_rgb.")
    chosen = PairOptions(
        convention=Convention(options.pairing),
        resolution=options.resolution,
        prune=False,
        sensor=options.sensor,
        with_partners=True,
    )
    halves = pair(source, chosen)
    scene = halves.heuristic.instantiate()
    bsdfs = list(dict.fromkeys(shape.bsdf() for shape in scene.shapes()))
    point = dr.zeros(mi.SurfaceInteraction3f)
    return PlainScene(
        name=source.name,
        camera=camera(scene),
        shapes=tuple(
            triangles_of(shape, bsdfs.index(shape.bsdf()), options.tessellation)
            for shape in scene.shapes()
        ),
        materials=tuple(material_of(bsdf, number, scene) for number, bsdf in enumerate(bsdfs)),
        lights=tuple(light_of(lamp, point) for lamp in lamps(scene)),
        ambient=tuple(numbers(mi.Color3f(scene.integrator().ambient.eval(point)))),
        layers=_layers(scene),
    )


def _layers(scene: Scene) -> dict[str, np.ndarray]:
    """Trace the rays through the pixel centres."""
    seen = gbuffer(scene, image_size(scene))
    ids = [shape.id() for shape in scene.shapes()]
    # The background's place, −1, is that of the 0 at the end.
    numbers = [ids.index(name) + 1 if name in ids else 0 for name in seen.shape.names]
    shape = np.array([*numbers, 0], np.float32)[seen.shape.places]
    return {"P": seen.position, "N": seen.normal, "shape": shape}


def camera(scene: mi.Scene) -> dict[str, Any]:
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
    width, height = map(int, sensor.film().crop_size())
    to_world = np.array(values["to_world"].matrix, float).reshape(4, 4, -1)[..., 0]
    x_fov = numbers(values["x_fov"])[0]
    near = float(sensor.near_clip())
    far = float(sensor.far_clip())
    scale = 1 / tan(radians(x_fov) / 2)
    depth = far - near
    projection = [
        [scale, 0.0, 0.0, 0.0],
        [0.0, scale * width / height, 0.0, 0.0],
        [0.0, 0.0, -(far + near) / depth, -2 * far * near / depth],
        [0.0, 0.0, -1.0, 0.0],
    ]
    # Half a turn about y leads from Mitsuba's axes to OpenGL's.
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


def triangles_of(shape: mi.Shape, material: int, resolution: int | None) -> Triangles:
    """Return a shape as the triangles of :func:`fotismos.heuristic.tessellation.to_mesh`."""
    mesh = to_mesh(shape, resolution or RESOLUTION)
    positions = meshes.rows(mesh, meshes.POSITIONS)
    faces = meshes.rows(mesh, meshes.FACES)
    assert positions is not None
    assert faces is not None
    return Triangles(
        name=shape.id(),
        positions=positions,
        normals=None if mesh.has_face_normals() else meshes.rows(mesh, meshes.NORMALS),
        texcoords=meshes.rows(mesh, meshes.TEXCOORDS),
        faces=faces,
        material=material,
    )


def material_of(bsdf: mi.BSDF, number: int, scene: mi.Scene) -> dict[str, Any]:
    """Return a material; a texture gives the value in its middle."""
    point = dr.zeros(mi.SurfaceInteraction3f)
    point.uv = mi.Point2f(0.5)
    material = bsdf.material(point, True, False, None, True)
    textures = {name: getattr(bsdf, name) for name in (*COEFFICIENTS, "n", "base_color")}
    colours = {name: textures[name].eval(point) for name in (*COEFFICIENTS, "base_color")}
    # The `k_s` of a mirror is no lobe's: it shows none of these lights (8.7).
    if bsdf.is_mirror:
        colours["k_s"] = 0
    return {
        "name": bsdf.id() or f"material {number + 1}",
        **{name: numbers(mi.Color3f(colour)) for name, colour in colours.items()},
        **{name: numbers(getattr(material, name))[0] for name in ("n", *PHYSICAL[1:])},
        "form": material.form,
        "normalised": bsdf.normalised,
        "twosided": bool(bsdf.twosided),
        "varies": [
            name
            for name, value in (textures | bsdf.partner).items()
            if isinstance(value, mi.Texture) and value.is_spatially_varying()
        ],
        "shapes": [shape.id() for shape in scene.shapes() if shape.bsdf() == bsdf],
    }


def light_of(emitter: mi.Emitter, point: mi.SurfaceInteraction3f) -> dict[str, Any]:
    """Return a light as paired; ``intensity`` is I_p, and ``attenuation`` k0, k1, k2 of 6.1.

    A light of two intensities has them too.
    """
    light = emitter.light(point, True)
    kind = light.plugin.removeprefix("heuristic_")
    numbered: dict[str, Any] = {"name": emitter.id(), "type": kind}
    for name, value in light.given().items():
        if isinstance(value, tuple):
            numbered[name] = [numbers(component)[0] for component in value]
        elif name == "clamped":
            numbered[name] = bool(value)
        else:
            several = numbers(mi.Color3f(value) if name in INTENSITIES else value)
            numbered[name] = several if len(several) > 1 else several[0]
    return numbered


def numbers(value: object) -> list[float]:
    """Return a Dr.Jit value of one entry as numbers, in the decimals of single precision."""
    return [float(str(np.float32(number))) for number in np.ravel(np.array(value))]
