"""A ball of glass and one of metal beside a matte one, before a coloured wall, under a lamp."""

import mitsuba as mi

T = mi.ScalarTransform4f


def even(*colour):
    """A diffuse surface of one colour."""
    return {"type": "diffuse", "reflectance": {"type": "rgb", "value": colour}}


def ball(x, y, bsdf):
    """A ball of radius 0.8 on the floor."""
    return {"type": "sphere", "center": (x, y, 0.8), "radius": 0.8, "bsdf": bsdf}


scene = {
    "type": "scene",
    "integrator": {"type": "path", "max_depth": 8},
    "sensor": {
        "type": "perspective",
        "fov": 38,
        "to_world": T().look_at((0, -8, 2.4), (0, 0, 0.8), (0, 0, 1)),
        "film": {"type": "hdrfilm", "width": 640, "height": 480, "rfilter": {"type": "box"}},
    },
    "floor": {"type": "rectangle", "to_world": T().scale(12), "bsdf": even(0.5, 0.5, 0.5)},
    "wall": {
        "type": "rectangle",
        "to_world": T().translate((0, 4, 0)).rotate((1, 0, 0), 90).scale(12),
        "bsdf": even(0.5, 0.35, 0.2),
    },
    "glass": ball(-1.9, -0.4, {"type": "dielectric", "int_ior": 1.5}),
    "matte": ball(0.0, 0.6, even(0.15, 0.3, 0.6)),
    "metal": ball(1.9, -0.4, {"type": "roughconductor", "material": "Au", "alpha": 0.15}),
    "lamp": {
        "type": "rectangle",
        "to_world": T().look_at((-3, -4, 7), (0, 0, 0), (0, 0, 1)).scale(1.0),
        "emitter": {"type": "area", "radiance": 60.0},
    },
}
