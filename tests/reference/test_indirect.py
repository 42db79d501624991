"""Indirect light by itself: paths in a bright closed sphere, whose light is a geometric series."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from fotismos.reference.rendering.indirect import indirect_light
from fotismos.reference.rendering.transport import LightGroups, Transport

ALBEDO = 0.6
COUNT = 400_000

ROUNDING = 3e-3
"""Of the mean: a ray that leaves a sphere at a grazing angle starts a little off it, so the
densities of its two samples do not quite agree."""


def estimate(max_depth, rr_depth=1000, **transport):
    """The mean of the light that reaches points of a sphere's inside after a reflection."""
    ball = {
        "type": "sphere",
        "flip_normals": True,
        "bsdf": {"type": "diffuse", "reflectance": ALBEDO},
        "light": {"type": "area", "radiance": 1.0},
    }
    scene = mi.load_dict({"type": "scene", "ball": ball})
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(7, COUNT)
    towards = mi.warp.square_to_uniform_sphere(sampler.next_2d())
    si = scene.ray_intersect(mi.Ray3f(mi.Point3f(0), towards))
    (light,) = indirect_light(
        scene,
        sampler,
        si=si,
        bsdf=si.bsdf(),
        max_depth=max_depth,
        rr_depth=rr_depth,
        active=mi.Bool(True),
        groups=LightGroups(scene, [0]),
        transports=[Transport(**transport)],
    )
    values = np.array(mi.Color3f(light) + dr.zeros(mi.Color3f, COUNT))[0]
    return float(values.mean(dtype=float)), float(values.std(dtype=float)) / COUNT**0.5


@pytest.mark.parametrize("max_depth", [2, 4, -1])
def test_each_further_reflection_adds_a_power_of_the_albedo(rgb, max_depth):
    """Light of depth d has been reflected d - 1 times; depth 2 is direct."""
    powers = range(2, max_depth if max_depth > 0 else 200)
    found, error = estimate(max_depth)
    expected = sum(ALBEDO**power for power in powers)
    assert found == pytest.approx(expected, abs=4 * error + ROUNDING * expected)


def test_russian_roulette_keeps_the_mean(rgb):
    found, error = estimate(-1, rr_depth=3)
    expected = ALBEDO**2 / (1 - ALBEDO)
    assert found == pytest.approx(expected, abs=4 * error + ROUNDING * expected)


def test_without_samples_of_the_bsdf_the_mean_stays(rgb):
    found, error = estimate(4, bsdf_samples=0)
    assert found == pytest.approx(ALBEDO**2 + ALBEDO**3, abs=4 * error + 1e-6)
