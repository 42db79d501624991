"""A coarse mesh with smooth normals under a light: where its two normals disagree.

No face of the mesh hides another, so the light at each point is known: ``max(N.L, 0) / d²`` of the
shading normal, as in the heuristic.
"""

from functools import cache

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from comparisons.departure.limits import find, of_scene
from heuristic.meshes import to_mesh

SIDE = 48
LIGHT, CAMERA = (4.0, -3.0, 1.0), (0.0, -4.0, 0.5)


def lit() -> tuple[NDArray, NDArray, NDArray]:
    """Return exact value, Mitsuba's and the mask, of pixels whose normals agree on the viewer."""
    return _of_pixels(lambda viewed, light: viewed)


def seen() -> tuple[NDArray, NDArray, NDArray]:
    """Return the same, of pixels whose normals agree on the light."""
    return _of_pixels(lambda viewed, light: light)


def _of_pixels(agreeing):
    exact, radiance, mask, viewed, light = _picture()
    chosen = agreeing(viewed, light) & (exact > 1e-3 * exact.max())
    return exact[chosen], radiance[chosen], mask[chosen]


@cache
def _picture():
    smooth = mi.load_dict({"type": "sphere", "bsdf": {"type": "diffuse", "reflectance": 1.0}})
    scene = mi.load_dict(
        {
            "type": "scene",
            "sensor": {
                "type": "perspective", "fov": 32.0,
                "to_world": mi.ScalarTransform4f().look_at(CAMERA, (0, 0, 0), (0, 0, 1)),
            },
            "shape": to_mesh(smooth, 4),
            "light": {"type": "point", "position": LIGHT, "intensity": np.pi},
        },
        optimize=False,
    )  # fmt: skip
    surfaces = of_scene(scene, SIDE, SIDE)
    radiance = _radiance(scene)
    offset = np.array(LIGHT) - surfaces.position
    square = (offset**2).sum(axis=-1)
    toward = offset / np.sqrt(square)[..., None]
    sides = {
        name: [
            (normal * direction).sum(axis=-1) for normal in (surfaces.shading, surfaces.geometric)
        ]
        for name, direction in (("light", toward), ("view", surfaces.view))
    }
    exact = np.where(surfaces.hit, np.maximum(sides["light"][0], 0) / square, 0)
    nothing = np.zeros((SIDE, SIDE, 3))
    mask = find(surfaces, nothing, nothing).terminator
    agree = {name: (a > 0) == (b > 0) for name, (a, b) in sides.items()}
    return exact, radiance, mask, agree["view"], agree["light"]


def _radiance(scene):
    """Return the radiance that Mitsuba's ``direct`` finds through the centres of pixels."""
    x, y = (axis.ravel() for axis in np.meshgrid(*[(np.arange(SIDE) + 0.5) / SIDE] * 2))
    place = mi.Point2f(mi.Float(x), mi.Float(y))
    ray, _ = scene.sensors()[0].sample_ray_differential(0.0, 0.5, place, mi.Point2f(0.5))
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(0, SIDE * SIDE)
    value, *_ = mi.load_dict({"type": "direct"}).sample(scene, sampler, ray)
    return np.array(value[0], float).reshape(SIDE, SIDE)
