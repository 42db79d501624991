"""A scene as plain data: camera, triangles, paired materials and lights, and what pixels see.

Everything is in world space and in the heuristic half's display-linear units.
"""

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

from comparisons.options import Options
from heuristic.arrays import Scene
from heuristic.errors import InputError
from heuristic.scene_data import Triangles, camera, light_of, material_of, numbers, triangles_of
from reference.pairing.halves import pair
from reference.rendering.gbuffer import image_size
from reference.scene.source import Source


@dataclass(frozen=True)
class Exported:
    """A scene as plain data.

    Attributes
    ----------
    name
        The scene's.
    camera
        See :func:`heuristic.scene_data.camera`.
    shapes, materials, lights
        Materials and lights are JSON objects.
    ambient
        ``I_a``, three numbers.
    layers
        At the pixel centres: ``P`` and ``N`` (H, W, 3), and ``shape`` (H, W), the shape's number
        from 1; 0 for the background.
    """

    name: str
    camera: dict
    shapes: tuple[Triangles, ...]
    materials: tuple[dict, ...]
    lights: tuple[dict, ...]
    ambient: tuple[float, ...]
    layers: dict[str, np.ndarray]


def exported(source: Source, options: Options) -> Exported:
    """Return a scene as plain data, in the current variant, which is RGB.

    Raises
    ------
    InputError
        For another variant, a camera without a perspective matrix, a shape without triangles, or a
        scene that cannot be paired.
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
        triangles_of(shape, bsdfs.index(shape.bsdf()), options.tessellation)
        for shape in scene.shapes()
    )
    point = dr.zeros(mi.SurfaceInteraction3f)
    lights = [emitter for emitter in scene.emitters() if hasattr(emitter, "light")]
    return Exported(
        source.name,
        camera(scene),
        shapes,
        tuple(material_of(bsdf, number, scene) for number, bsdf in enumerate(bsdfs)),
        tuple(light_of(emitter, point) for emitter in lights),
        tuple(numbers(mi.Color3f(scene.integrator().ambient.eval(point)))),
        _layers(scene),
    )


def _layers(scene: Scene) -> dict[str, np.ndarray]:
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
