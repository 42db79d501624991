"""Parts of small scenes, as Mitsuba takes them in a dictionary."""

import mitsuba as mi
import numpy as np

from fotismos.comparisons.gallery.builtin import SCENES


def look_at(origin, target=(0, 0, 0), up=(0, 0, 1)):
    return mi.ScalarTransform4f().look_at(origin, target, up)


def moved(place, scale=1):
    return mi.ScalarTransform4f().translate(place).scale(scale)


def camera(origin, target=(0, 0, 0), up=(0, 0, 1), size=32, fov=40.0, **more):
    """A camera, perspective if no other type is given; ``size`` is a side or width and height."""
    width, height = size if isinstance(size, tuple) else (size, size)
    film = {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"}}
    sensor = {"type": "perspective", "to_world": look_at(origin, target, up), "film": film} | more
    return {"fov": fov} | sensor if sensor["type"] in ("perspective", "thinlens") else sensor


def rgb_of(*value):
    return {"type": "rgb", "value": list(value)}


def shown_by(model, bsdf, **integrator):
    """The sphere of figure 8.9 under two lights, whose order their colours tell, by a heuristic."""
    figure = SCENES["fig-8-9"].make()
    point = {"type": "heuristic_point", "position": [-4, -2, 3]}
    parallel = {"type": "heuristic_directional", "direction": [-1, 2, -1]}
    return {
        "type": "scene",
        "sensor": figure["sensor"],
        "light1": point | {"intensity": rgb_of(1, 0.5, 0.25)},
        "light2": parallel | {"intensity": rgb_of(0.2, 0.4, 0.6)},
        "sphere": figure["sphere"] | {"bsdf": bsdf},
        "integrator": {"type": "heuristic", "model": str(model), **integrator},
    }


def mesh_of(points, normals=None, faces=((0, 1, 2),), name="few", **properties):
    """A mesh of a few triangles, as a user would build it."""
    props = mi.Properties()
    for key, value in properties.items():
        props[key] = value
    mesh = mi.Mesh(name, len(points), len(faces), props, has_vertex_normals=normals is not None)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = mi.Float(np.ravel(points).astype(np.float32))
    parameters["faces"] = mi.UInt32(np.ravel(faces).astype(np.uint32))
    if normals is not None:
        parameters["vertex_normals"] = mi.Float(np.ravel(normals).astype(np.float32))
    parameters.update()
    mesh.set_id(name)
    return mesh


RADIUS, CENTRE = 0.7, np.array((0, 0, 1.6))


def shadowed(size=24):
    """A diffuse sphere above a floor, by direct light: the sphere is exact, its shadow is not."""
    chalk, slate = (
        {"type": "diffuse", "id": name, "reflectance": grey}
        for name, grey in (("chalk", 0.6), ("slate", 0.3))
    )
    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 2},
        "sensor": camera((0, -6, 4), size=size, fov=45.0),
        "sphere": {"type": "sphere", "to_world": moved(CENTRE, RADIUS), "bsdf": chalk},
        "floor": {"type": "rectangle", "to_world": moved(0, 2), "bsdf": slate},
        "light": {"type": "point", "position": (1, -1, 5), "intensity": 30.0},
    }
