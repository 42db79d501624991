"""Spheres from smooth to rough, plastic above and gold below, under a map or two lamps."""

import mitsuba as mi
import numpy as np

T = mi.ScalarTransform4f
ALPHAS = (0.01, 0.05, 0.1, 0.25, 0.5)


def scene(light="map"):
    """Return the spheres under `light`: a "map" of a studio, or "lamps"."""
    plastic = {"type": "roughplastic", "distribution": "ggx"}
    plastic |= {"diffuse_reflectance": {"type": "rgb", "value": (0.1, 0.25, 0.4)}}
    gold = {"type": "roughconductor", "distribution": "ggx", "material": "Au"}
    balls = {
        f"{name} {x}": {"type": "sphere", "center": (3 * x - 6, 0, z)}
        | {"bsdf": bsdf | {"alpha": alpha}}
        for name, z, bsdf in (("plastic", 1.5, plastic), ("gold", -1.5, gold))
        for x, alpha in enumerate(ALPHAS)
    }
    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 6, "hide_emitters": True},
        "sensor": {
            "type": "perspective",
            "fov": 22,
            "to_world": T().look_at((0, -40, 4), (0, 0, 0), (0, 0, 1)),
            "film": {"type": "hdrfilm", "width": 500, "height": 200, "rfilter": {"type": "box"}},
        },
        **({"studio": studio()} if light == "map" else lamps()),
        **balls,
    }


def studio():
    """Return a map: a grey room, brighter above, with two windows and a warm lamp."""
    up, turn = np.mgrid[90:-90:256j, 0:360:512j]
    room = 0.15 + 0.25 * np.clip(np.sin(np.radians(up)), -0.3, 1)[..., None] * np.ones(3)
    for height, side, tall, wide, colour in (
        (30, 60, 20, 25, (6, 7, 8)), (20, 240, 15, 40, (3, 3, 3)), (60, 150, 6, 12, (30, 20, 8)),
    ):  # fmt: skip
        inside = (abs(up - height) < tall) & (abs(turn - side) < wide)
        room[inside] = colour
    upright = T().rotate((1, 0, 0), 90)
    return {"type": "envmap", "bitmap": mi.Bitmap(room.astype(np.float32)), "to_world": upright}


def lamps():
    """Return two rectangular lamps: one above, one at the left."""
    places = {"above": ((2, -6, 8), (4, 2)), "left": ((-12, -5, 1), (1, 4))}
    return {
        name: {
            "type": "rectangle",
            "to_world": T().look_at(place, (0, 0, 0), (0, 0, 1)).scale((*half, 1)),
            "emitter": {"type": "area", "radiance": 8.0},
        }
        for name, (place, half) in places.items()
    }
