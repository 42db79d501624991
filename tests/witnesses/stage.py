"""What the scenes of the witnesses are made of: a camera without perspective, plates and lamps."""

from tests.shared import parts

GREY = 0.5
"""Reflectance of what is looked at, unless a case says otherwise."""

BLACK = {"type": "diffuse", "reflectance": 0.0}


def scene(camera, max_depth=-1, **parts):
    """Return a scene that is rendered by ``path``, from a camera and named parts."""
    integrator = {"type": "path", "max_depth": max_depth}
    return {"type": "scene", "integrator": integrator, "sensor": camera, **parts}


def above(half=1.0, height=0.5, centre=(0.0, 0.0)):
    """Return a camera that looks down at a square of the floor, x rightwards and y upwards."""
    x, y = centre
    return camera((x, y, height), (x, y, 0), (0, 1, 0), half)


def camera(origin, target, up, half):
    """Return an orthographic camera, whose film is as wide as twice ``half``."""
    to_world = parts.look_at(origin, target, up).scale((half, half, 1))
    return parts.camera(origin, target, up, type="orthographic", to_world=to_world)


def diffuse(reflectance=GREY):
    """Return a diffuse material."""
    return {"type": "diffuse", "reflectance": reflectance}


def floor(half=2.0, reflectance=GREY):
    """Return a square about the origin in the plane z = 0, facing up."""
    return {"type": "rectangle", "to_world": parts.moved(0, half), "bsdf": diffuse(reflectance)}


def plate(centre, toward, up, half_width, half_height, **rest):
    """Return a rectangle that faces a point; its height is along ``up``, black unless told."""
    to_world = parts.look_at(centre, toward, up).scale((half_width, half_height, 1))
    return {"type": "rectangle", "to_world": to_world, "bsdf": BLACK, **rest}


def shining(radiance=1.0):
    """Return what makes a shape a lamp."""
    return {"type": "area", "radiance": radiance}
