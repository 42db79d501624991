"""Light of the environment by nine numbers for each colour: spherical harmonics up to order two.

After Ramamoorthi and Hanrahan, "An efficient representation for irradiance environment maps"
(2001). The cosine keeps 1, 2/3 and 1/4 of the orders 0, 1 and 2, and nearly nothing of the others.
Around a small bright lamp the sum rings, and falls below 0: a Hann window lowers its orders.
"""

from math import sqrt

import fotismos  # isort: skip  it finds LLVM before Dr.Jit is imported

import drjit as dr
import mitsuba as mi
import numpy as np
from cook_torrance import lit, reflectance

from fotismos import Range

SAMPLES = 2**18
ORDERS = (0, 1, 1, 1, 2, 2, 2, 2, 2)
SHARES = (1, 2 / 3, 1 / 4)


def prepare(scene):
    """Return the nine coefficients of the environment without its sun, which is one of the lights.

    They are means of light times function, over directions that are even on the sphere.
    """
    number = np.arange(SAMPLES)
    z = 1 - 2 * (number + 0.5) / SAMPLES
    side = np.sqrt(1 - z * z)
    turn = np.pi * (3 - np.sqrt(5)) * number  # the golden angle
    toward = mi.Vector3f(side * np.cos(turn), side * np.sin(turn), z)
    light = fotismos.environment(scene, toward, sun=False)
    coefficients = [dr.mean(light * one, axis=1) for one in functions(toward)]
    dr.make_opaque(coefficients)  # so that other scenes need no other kernel
    return coefficients


def shade(point, window: Range(2.5, 100) = 8):
    """A base's light about the normal, a metal's about the mirrored ray; lights one by one."""
    material, normal, view = point.material, point.normal, point.view
    mirrored = 2 * dr.dot(normal, view) * normal - view
    toward = dr.normalize(dr.lerp(normal, mirrored, material.metallic))
    light = 0
    for number, function in enumerate(functions(toward)):
        order = ORDERS[number]
        kept = SHARES[order] * (0.5 + 0.5 * dr.cos(dr.pi * order / window))
        light += kept * point.prepared[number] * function
    facing = dr.clip(dr.dot(normal, view), 0, 1)
    f0 = reflectance(material)
    color = dr.lerp(material.base_color, f0 + (1 - f0) * (1 - facing) ** 5, material.metallic)
    return color * dr.maximum(light, 0) + sum(lit(point, one) for one in point.lights)


def functions(d):
    """Return the nine functions, each with a mean square of 1 over the sphere."""
    x, y, z = d
    root3 = sqrt(3)
    root5 = sqrt(5)
    return (
        mi.Float(1),
        *(root3 * one for one in (x, y, z)),
        *(root5 * root3 * one for one in (x * y, y * z, x * z)),
        root5 * (1.5 * z * z - 0.5),
        root5 * root3 / 2 * (x * x - y * y),
    )
