"""Samplers on long paths: inside a bright sphere, whose radiance is known in closed form.

Inside a sphere of radius 1 and diffuse reflectance ρ, with a point light of intensity I at its
centre, the radiance is the same everywhere ::

    L = ρ I / (π (1 − ρ))

because each reflection sends the same irradiance to all of the sphere. A path takes about
1 / (1 − ρ) reflections, and as many pairs of random numbers. If those depend on each other, the
mean of an image is wrong, however many passes are taken: no standard error shows it.

Naively the sampler is Mitsuba's; ours is :mod:`reference.scene.sampler`, with the same number of
samples. Both are measured with the installed Mitsuba.
"""

from functools import cache

import mitsuba as mi
import numpy as np

from comparisons.hard.cases import HardCase
from reference.rendering.renderer import Renderer
from reference.scene.sampler import SAMPLER, register

REFLECTANCE = 0.9
RADIANCE = REFLECTANCE / (np.pi * (1 - REFLECTANCE))
"""Closed form for an intensity of 1."""

BOUND = 0.005
"""On the relative error: about four standard errors of :data:`SAMPLES`."""

SAMPLES, WIDTH = 256, 32
STOCK = (("multijitter", 4), ("multijitter", 16), ("ldsampler", 16))


def sphere(reflectance: float, width: int, sampler: dict | None = None) -> dict:
    """Return the scene as a dictionary, seen from inside, off its centre."""
    view = mi.ScalarTransform4f().look_at((0.3, 0.1, 0.2), (1, 0.2, 0), (0, 1, 0))
    film = {"type": "hdrfilm", "width": width, "height": width, "rfilter": {"type": "box"}}
    sensor = {"type": "perspective", "fov": 60, "to_world": view, "film": film}
    if sampler:
        sensor["sampler"] = sampler
    inside = {"type": "diffuse", "reflectance": reflectance}
    return {
        "type": "scene",
        "integrator": {"type": "path"},
        "sphere": {"type": "sphere", "flip_normals": True, "bsdf": inside},
        "light": {"type": "point", "position": (0, 0, 0), "intensity": 1.0},
        "sensor": sensor,
    }


@cache
def mean(sampler: str, count: int) -> float:
    """Return the mean radiance that a sampler gives, with ``count`` samples per pixel and pass."""
    register()
    scene = mi.load_dict(sphere(REFLECTANCE, WIDTH, {"type": sampler, "sample_count": count}))
    renderer = Renderer(scene, None, count, "image of the sphere")
    images = (renderer.render(7919 * number) for number in range(SAMPLES // count))
    return float(np.mean([np.array(image).mean() for image in images]))


def _case(sampler: str, count: int) -> HardCase:
    return HardCase(
        f"{sampler} at {count} samples per pass",
        "reference",
        f"Inside a sphere of ρ = {REFLECTANCE} a path takes about ten reflections, and its random"
        " numbers depend on each other.",
        BOUND,
        lambda: np.array([mean(sampler, count)]),
        lambda: np.array([mean(SAMPLER, count)]),
        lambda: np.array([RADIANCE]),
    )


CASES = tuple(_case(sampler, count) for sampler, count in STOCK)
