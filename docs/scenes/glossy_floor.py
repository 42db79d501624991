"""Balls on a polished floor, which mirrors them dimly, under two lamps."""

import mitsuba as mi

T = mi.ScalarTransform4f


def lamp(place, size, radiance):
    """A square lamp that faces the middle of the floor."""
    to_world = T().look_at(place, (0, 0, 0), (0, 0, 1)).scale(size)
    return {
        "type": "rectangle",
        "to_world": to_world,
        "emitter": {"type": "area", "radiance": radiance},
    }


def plastic(alpha, *colour):
    """Rough plastic of a colour."""
    reflectance = {"type": "rgb", "value": colour}
    return {"type": "roughplastic", "alpha": alpha, "diffuse_reflectance": reflectance}


scene = {
    "type": "scene",
    "integrator": {"type": "path", "max_depth": 8},
    "sensor": {
        "type": "perspective",
        "fov": 40,
        "to_world": T().look_at((0, -8, 2.5), (0, 0, 0.6), (0, 0, 1)),
        "film": {"type": "hdrfilm", "width": 640, "height": 480, "rfilter": {"type": "box"}},
    },
    "floor": {
        "type": "rectangle",
        "to_world": T().scale(14),
        "bsdf": plastic(0.08, 0.08, 0.07, 0.06),
    },
    "key": lamp((-4, -4, 6), 0.8, 60.0),
    "fill": lamp((6, -2, 4), 1.5, 6.0),
} | {
    f"ball {number}": {
        "type": "sphere",
        "center": (1.5 * number - 3, (number % 2) * 1.2, 0.7),
        "radius": 0.7,
        "bsdf": plastic(0.05 * 1.7**number, *colour),
    }
    for number, colour in enumerate(
        [(0.6, 0.1, 0.1), (0.1, 0.4, 0.15), (0.1, 0.2, 0.6), (0.6, 0.5, 0.1), (0.5, 0.5, 0.5)]
    )
}
