"""A room with a tiled floor, a painted wall, a table and two balls, under a lamp on the ceiling."""

import mitsuba as mi
import numpy as np

T = mi.ScalarTransform4f


def wall(*turns, bsdf):
    """A square wall of the room, whose sides are 4 long."""
    to_world = T()
    for axis, angle in turns:
        to_world = to_world.rotate(axis, angle)
    return {"type": "rectangle", "to_world": to_world.translate((0, 0, -2)).scale(2), "bsdf": bsdf}


def painted():
    """Stripes of a few colours, with grain."""
    rng = np.random.default_rng(3)
    colours = rng.uniform(0.2, 0.8, (16, 3))[np.arange(128) // 8]
    grain = rng.uniform(0.85, 1, (128, 128, 1))
    return {
        "type": "diffuse",
        "reflectance": {
            "type": "bitmap",
            "bitmap": mi.Bitmap((colours * grain).astype(np.float32)),
            "raw": True,
        },
    }


def even(*colour):
    """One colour."""
    return {"type": "diffuse", "reflectance": {"type": "rgb", "value": colour}}


TILES = {
    "type": "diffuse",
    "reflectance": {
        "type": "checkerboard",
        "color0": {"type": "rgb", "value": (0.15, 0.1, 0.08)},
        "color1": {"type": "rgb", "value": (0.6, 0.55, 0.5)},
        "to_uv": T().scale((8, 8, 1)),
    },
}

scene = {
    "type": "scene",
    "integrator": {"type": "path", "max_depth": 8},
    "sensor": {
        "type": "perspective",
        "fov": 55,
        "to_world": T().look_at((0, -5.5, 0.2), (0, 0, -0.3), (0, 0, 1)),
        "film": {"type": "hdrfilm", "width": 640, "height": 480, "rfilter": {"type": "box"}},
    },
    "floor": wall(bsdf=TILES),
    "ceiling": wall(((1, 0, 0), 180), bsdf=even(0.7, 0.7, 0.7)),
    "back": wall(((1, 0, 0), 90), bsdf=painted()),
    "left": wall(((0, 1, 0), 90), bsdf=even(0.6, 0.2, 0.15)),
    "right": wall(((0, 1, 0), -90), bsdf=even(0.2, 0.35, 0.6)),
    "table": {
        "type": "cube",
        "to_world": T().translate((0.5, 0.3, -1.3)).rotate((0, 0, 1), 20).scale((0.9, 0.6, 0.06)),
        "bsdf": {
            "type": "roughplastic",
            "alpha": 0.2,
            "diffuse_reflectance": {"type": "rgb", "value": (0.35, 0.2, 0.1)},
        },
    },
    "ball": {"type": "sphere", "center": (0.5, 0.2, -0.84), "radius": 0.4}
    | {"bsdf": even(0.7, 0.6, 0.2)},
    "far ball": {"type": "sphere", "center": (-1.1, 0.9, -1.4), "radius": 0.6}
    | {"bsdf": even(0.3, 0.6, 0.35)},
    "lamp": {
        "type": "rectangle",
        "to_world": T().translate((0, 0, 1.99)).rotate((1, 0, 0), 180).scale(0.5),
        "emitter": {"type": "area", "radiance": 18.0},
    },
}
