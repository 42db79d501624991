"""Spheres under lamps, and what an integrator has at the centres of pixels."""

import mitsuba as mi
import numpy as np

from fotismos.comparisons.case import open_case
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.reference.rendering.gbuffer import pixel_rays
from tests.shared.misplanned import scene as described
from tests.shared.oracle import unit


def prepared(scene, **options):
    case = open_case(scene, Options.of({"spp": 4, **options}))
    return prepare(case.source, case.options), case.options


def centres(scene, integrator, size, columns, rows):
    """Return what an integrator has through the centres of pixels, (H, W, 3)."""
    ray = pixel_rays(scene, size, *np.meshgrid(columns, rows))
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(0, len(columns) * len(rows))
    colour, valid, _ = integrator.sample(scene, sampler, ray)
    image = np.array(mi.Color3f(colour) & valid, np.float64)
    return image.T.reshape(len(rows), len(columns), 3)


def seen_on_the_unit_sphere(x, y, side, viewer):
    """Return where the ray through a pixel's centre meets the figures' sphere, in float64."""
    forward = unit(-viewer)
    right = unit(np.cross(forward, (0, 0, 1)))
    across, down = (np.tan(np.radians(20)) * (2 * (place + 0.5) / side - 1) for place in (x, y))
    ray = unit(forward + across * right - down * np.cross(right, forward))
    half = ray @ viewer
    return viewer - ray * (half + np.sqrt(half**2 - viewer @ viewer + 1))


def sphere(material, *lights):
    parts = {"ball": {"type": "sphere", "bsdf": material}}
    parts |= {f"lamp {number}": light for number, light in enumerate(lights)}
    return described((0, -4, 1), size=16, **parts)


def lamp(x, strength=30.0):
    return {"type": "point", "position": [x, -4, 3], "intensity": strength}


PLASTIC = {"type": "roughplastic", "alpha": 0.2}
