"""Blocks and a ball on the ground, under a sky with the sun in it."""

import mitsuba as mi

T = mi.ScalarTransform4f


def even(*colour):
    """A diffuse surface of one colour."""
    return {"type": "diffuse", "reflectance": {"type": "rgb", "value": colour}}


BLOCKS = {
    f"block {number}": {
        "type": "cube",
        "to_world": T().translate((x, y, height)).rotate((0, 0, 1), turn).scale((0.7, 0.7, height)),
        "bsdf": even(0.55, 0.5, 0.42),
    }
    for number, (x, y, height, turn) in enumerate(
        [(-2.6, 1.0, 1.6, 10), (-0.6, 2.2, 2.4, -15), (1.8, 1.4, 1.1, 30), (3.4, 2.6, 2.0, 5)]
    )
}

scene = {
    "type": "scene",
    "integrator": {"type": "path", "max_depth": 6},
    "sensor": {
        "type": "perspective",
        "fov": 45,
        "to_world": T().look_at((0, -9, 2.2), (0.2, 0, 1.2), (0, 0, 1)),
        "film": {"type": "hdrfilm", "width": 640, "height": 480, "rfilter": {"type": "box"}},
    },
    "ground": {"type": "rectangle", "to_world": T().scale(40), "bsdf": even(0.25, 0.3, 0.15)},
    "ball": {"type": "sphere", "center": (0.3, -1.2, 0.8), "radius": 0.8}
    | {"bsdf": even(0.7, 0.2, 0.1)},
    "sky": {
        "type": "sunsky",
        "sun_direction": (-0.5, -0.6, 0.6),
        "turbidity": 4.0,
        "sun_scale": 0.2,
        "sky_scale": 0.2,
    },
    **BLOCKS,
}
