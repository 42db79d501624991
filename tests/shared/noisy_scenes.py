"""Scenes whose light is hard to sample: caustics, gaps, near lamps, panes, deep rooms, many lamps.

Each is a dictionary for Mitsuba, with a film of 32 by 32 pixels. None of them serves another test.
"""

import math

from tests.shared.parts import camera, look_at, moved, rgb_of

UP = (0, 1, 0)


def scene(sensor, max_depth=8, **objects):
    """Return a scene that ``path`` renders, with named shapes and lights."""
    integrator = {"type": "path", "max_depth": max_depth}
    return {"type": "scene", "integrator": integrator, "sensor": sensor, **objects}


def matte(*reflectance):
    """Return a diffuse material."""
    return {"type": "diffuse", "reflectance": rgb_of(*reflectance)}


def plate(centre, toward, half_width, half_height, bsdf=None, up=UP, **rest):
    """Return a rectangle at ``centre`` that faces ``toward``."""
    to_world = look_at(centre, toward, up).scale((half_width, half_height, 1))
    return {"type": "rectangle", "to_world": to_world, "bsdf": bsdf or matte(0.6, 0.6, 0.6), **rest}


def lamp(centre, toward, half, radiance, up=UP):
    """Return a square lamp that faces ``toward``."""
    emitter = {"type": "area", "radiance": radiance}
    return plate(centre, toward, half, half, matte(0, 0, 0), up, emitter=emitter)


def floor(half=4.0, grey=0.5):
    """Return a square in the plane z = 0, facing up."""
    return {"type": "rectangle", "to_world": moved(0, half), "bsdf": matte(grey, grey, grey)}


def ball(centre, radius, bsdf):
    """Return a sphere."""
    return {"type": "sphere", "center": centre, "radius": radius, "bsdf": bsdf}


def room(depth=1.0):
    """Return five walls about the origin, 2 wide and high, open towards z = 1.

    ``depth`` is how far the back wall is behind the origin.
    """
    middle = (1 - depth) / 2
    long = (1 + depth) / 2
    white = matte(0.7, 0.7, 0.7)
    along = (0, 0, 1)
    return {
        "ground": plate((0, -1, middle), (0, 0, middle), 1, long, white, along),
        "ceiling": plate((0, 1, middle), (0, 0, middle), 1, long, white, along),
        "left": plate((-1, 0, middle), (0, 0, middle), long, 1, matte(0.6, 0.1, 0.1)),
        "right": plate((1, 0, middle), (0, 0, middle), long, 1, matte(0.1, 0.5, 0.1)),
        "back": plate((0, 0, -depth), (0, 0, 1), 1, 1, white),
    }


def into_room():
    """Return a camera that looks into a room through its open side."""
    return camera((0, 0, 3.8), (0, 0, 0), UP)


def over_floor():
    """Return a camera that looks down at the origin from the side."""
    return camera((0, -6, 4), (0, 0, 0.4))


def small_lamp():
    """Return a small bright lamp above the floor, to the left."""
    return lamp((-1.5, -1, 4), (0, 0, 0), 0.2, 150.0)


def glass_ball():
    """A ball of smooth glass on a floor, whose caustic only paths from the floor find."""
    glass = {"type": "dielectric"}
    return scene(over_floor(), floor=floor(), lamp=small_lamp(), ball=ball((0, 0, 0.8), 0.8, glass))


def rough_glass():
    """A ball of rough glass on a floor."""
    glass = {"type": "roughdielectric", "alpha": 0.15}
    return scene(over_floor(), floor=floor(), lamp=small_lamp(), ball=ball((0, 0, 0.8), 0.8, glass))


def metal_caustic():
    """A ball of smooth metal on a floor, which throws a reflection of the lamp onto it."""
    metal = {"type": "conductor", "material": "none"}
    return scene(over_floor(), floor=floor(), lamp=small_lamp(), ball=ball((0, 0, 0.8), 0.8, metal))


def plastic_ring():
    """Glossy plastic balls in a ring, in which each sees reflections of the lamp in the others."""
    plastic = {
        "type": "roughplastic",
        "alpha": 0.1,
        "diffuse_reflectance": rgb_of(0.2, 0.3, 0.6),
    }
    angles = [2 * math.pi * number / 6 for number in range(6)]
    balls = {
        f"ball-{number}": ball((1.3 * math.cos(angle), 1.3 * math.sin(angle), 0.5), 0.5, plastic)
        for number, angle in enumerate(angles)
    }
    return scene(over_floor(), floor=floor(), lamp=small_lamp(), **balls)


def near_ceiling():
    """A room with a point light close below its ceiling."""
    light = {"type": "point", "position": (0, 0.97, 0), "intensity": 0.8}
    return scene(into_room(), **room(), light=light)


def near_corner():
    """A room with a small lamp close to a corner."""
    shining = lamp((0.9, 0.9, -0.9), (1, 1, -1), 0.05, 150.0)
    return scene(into_room(), **room(), lamp=shining)


def room_with_a_pane():
    """A room with a pane of glass upright in its middle, lit from the ceiling."""
    glass = {"type": "thindielectric"}
    pane = plate((0, -0.2, 0.1), (0, -0.2, 1), 0.5, 0.6, glass)
    shining = lamp((0, 0.99, 0), (0, 0, 0), 0.25, 12.0, up=(0, 0, 1))
    return scene(into_room(), **room(), lamp=shining, pane=pane)


def lamp_behind_glass():
    """A room whose lamp hangs above a pane of glass, so that no direct ray reaches it."""
    glass = {"type": "thindielectric"}
    pane = plate((0, 0.8, 0), (0, 0, 0), 0.9, 0.9, glass, up=(0, 0, 1))
    shining = lamp((0, 0.99, 0), (0, 0, 0), 0.25, 12.0, up=(0, 0, 1))
    return scene(into_room(), **room(), lamp=shining, pane=pane)


def gap():
    """A nook that is lit through a gap between two walls."""
    high = 1.2
    shining = lamp((-2.5, 0, 1.2), (0, 0, 0.5), 0.4, 60.0, up=(0, 0, 1))
    wall = {"up": (0, 0, 1)}
    return scene(
        camera((3.2, -3.2, 3.2), (0.4, 0, 0.2)),
        floor=floor(3.0),
        near=plate((-1, -1.56, high / 2), (2, -1.56, high / 2), 1.5, high, **wall),
        far=plate((-1, 1.56, high / 2), (2, 1.56, high / 2), 1.5, high, **wall),
        lamp=shining,
    )


def mirror_room():
    """A room whose left wall is a mirror."""
    walls = room()
    walls["left"]["bsdf"] = {"type": "conductor", "material": "none"}
    shining = lamp((0, 0.99, 0), (0, 0, 0), 0.25, 12.0, up=(0, 0, 1))
    return scene(into_room(), **walls, lamp=shining)


def deep_room():
    """A long room that is lit at its far end, with many reflections."""
    shining = lamp((0, 0.99, -4.5), (0, 0, -4.5), 0.3, 60.0, up=(0, 0, 1))
    return scene(into_room(), 32, **room(depth=5.0), lamp=shining)


def small_sun_in_the_sky():
    """A dim sky, and a very bright ball, far away and small, as its sun."""
    sky = {"type": "constant", "radiance": rgb_of(0.3, 0.4, 0.6)}
    sun = {"type": "area", "radiance": 4000.0}
    plastic = {
        "type": "roughplastic",
        "alpha": 0.2,
        "diffuse_reflectance": rgb_of(0.6, 0.3, 0.2),
    }
    return scene(
        over_floor(),
        floor=floor(),
        sky=sky,
        sun=ball((-8, -6, 14), 0.25, matte(0, 0, 0)) | {"emitter": sun},
        ball=ball((0, 0, 0.8), 0.8, plastic),
    )


def sun_and_sky():
    """Sun and sky of a clear day."""
    sky = {
        "type": "sunsky",
        "sun_direction": (0.4, -0.5, 0.6),
        "turbidity": 3.0,
        "sun_scale": 0.2,
        "sky_scale": 0.2,
    }
    box = {"type": "cube", "to_world": moved((0, 0, 0.6), 0.6), "bsdf": matte(0.6, 0.6, 0.5)}
    return scene(over_floor(), floor=floor(), sky=sky, box=box)


def many_lamps():
    """A floor under 72 small lamps of two colours."""
    lamps = {}
    for number in range(72):
        row, column = divmod(number, 9)
        centre = (column - 4.0, row - 3.5, 2.0)
        below = (centre[0], centre[1], 0)
        lamps[f"lamp-{number}"] = lamp(centre, below, 0.05, 4.0 + 4.0 * (number % 2))
    chalk = ball((0, 0, 0.7), 0.7, matte(0.6, 0.5, 0.4))
    return scene(over_floor(), floor=floor(), ball=chalk, **lamps)


def fog():
    """A matte ball in a cube of thin fog, under a small lamp."""
    medium = {"type": "homogeneous", "albedo": 0.8, "sigma_t": 0.3}
    box = {"type": "cube", "to_world": moved((0, 0, 1.5), 1.5), "bsdf": {"type": "null"}}
    chalk = ball((0, 0, 0.8), 0.8, matte(0.6, 0.4, 0.3))
    content = scene(
        over_floor(), floor=floor(), lamp=small_lamp(), ball=chalk, fog=box | {"interior": medium}
    )
    return content | {"integrator": {"type": "volpath", "max_depth": 8}}


SCENES = (
    glass_ball,
    rough_glass,
    metal_caustic,
    plastic_ring,
    near_ceiling,
    near_corner,
    room_with_a_pane,
    lamp_behind_glass,
    gap,
    mirror_room,
    deep_room,
    small_sun_in_the_sky,
    sun_and_sky,
    many_lamps,
    fog,
)
