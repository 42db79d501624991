"""Shapes that shine: ``area``. In the far field a point or an even spot; nearby a glow ``k_i``."""

from typing import Any

import mitsuba as mi
import numpy as np

from reference.pairing import probe
from reference.pairing.factors import CLOSED_LIGHT_FACTOR, INTENSITY_FACTOR, Replacements
from reference.pairing.lights.kind import LightKind, LightNode, heuristic
from reference.scene import values
from reference.scene.graph import Graph, Reference, properties

EMITTER, SHAPE, BSDF = (getattr(mi.ObjectType, kind) for kind in ("Emitter", "Shape", "BSDF"))

FLATNESS = 0.5
"""A light with a longer mean normal shines to one side; a closed one has a mean normal of 0."""

FLAT = 1 - 1e-4
"""A light with a mean normal longer than this is flat."""


def _to_heuristic(light: LightNode) -> None:
    """Replace the light by emission of its shape and a spot or point at its centroid."""
    graph, shape, radiance = light.graph, light.shape, light.value("radiance", 1.0)
    if light.hide_emitters:
        # Mitsuba's integrators look through it, and the heuristic casts no shadows.
        graph.remove(shape)
    else:
        _glow(graph, shape, radiance)
    identifier = graph.props(shape).id()
    made = next(found for found in light.geometry().shapes() if found.id() == identifier)
    centroid, area, normal, radius = _extent(made)
    if _varies(graph, radiance):
        radiance = probe.surface_mean(graph, made)
    flatness = float(np.linalg.norm(normal))
    if flatness > FLATNESS:
        # On its axis L times the projected area, and pi L A in all: I_0 2 pi / (m + 1) of 6.4.
        flatness = 1.0 if flatness > FLAT else flatness
        plugin, factor, form = "heuristic_spot", INTENSITY_FACTOR * area * flatness, ""
        exponent = 2 * flatness - 1
        cone = {"direction": mi.ScalarVector3f(*normal), "cutoff": 90.0, "exponent": exponent}
    else:
        plugin, factor, form, cone = "heuristic_point", CLOSED_LIGHT_FACTOR * area, "closed, ", {}
    if flatness < 1:  # its light leaves through the shape
        cone["shell"] = radius
    position = mi.ScalarPoint3f(*centroid)
    derived = heuristic(plugin, factor, **cone, position=position, intensity=radiance)
    derived.set_id(f"light of {graph.label(shape)}")
    graph.attach(0, f"light_of_{shape}", graph.add(EMITTER, derived))
    note = f"{form}area {area:.6g}, in the far field; the shape keeps its emission as k_i"
    light.replaced.emitter(graph.label(shape), "area", plugin, factor, False, note)


def _varies(graph: Graph, value: Any) -> bool:
    """Return whether a value is a texture that differs from point to point."""
    if not isinstance(value, Reference):
        return False
    return graph.instantiate(value.index()).is_spatially_varying()


ROOM = 1.02
"""Factor on the radius of a lamp: the grid's places lie up to a 64th inside its edges."""


def _extent(shape: mi.Shape) -> tuple[list[float], float, list[float], float]:
    """Return centroid, area, mean normal and radius of a shape, by its sampling on a grid."""
    cells = (np.arange(64) + 0.5) / 64
    x, y = (axis.ravel() for axis in np.meshgrid(cells, cells))
    sample = shape.sample_position(0.0, mi.Point2f(mi.Float(x), mi.Float(y)))
    places = np.array(sample.p, float)
    centroid = places.mean(axis=1)
    normal = np.array(sample.n).mean(axis=1)
    radius = ROOM * np.linalg.norm(places - centroid[:, None], axis=0).max()
    area = float(np.ravel(shape.surface_area())[0])
    return centroid.tolist(), area, normal.tolist(), float(radius)


def _glow(graph: Graph, shape: int, radiance: Any) -> None:
    """Give a shape its own copy of its phong, with ``k_i`` set to a radiance."""
    ((key, bsdf),) = graph.children(shape, BSDF)
    props = mi.Properties(graph.props(bsdf))
    props.set_id(f"{graph.label(shape)}_glowing")
    props["k_i"] = radiance
    graph.attach(shape, key, graph.add(BSDF, props))


def add_glowing_shapes(graph: Graph, replaced: Replacements) -> None:
    """Give each shape whose ``phong`` has a ``k_i`` an area light of that radiance.

    Call it while the shapes still have their ``phong``.
    """
    for shape in graph.nodes(SHAPE):
        for _, bsdf in graph.children(shape, BSDF):
            radiance = graph.props(bsdf).get("k_i", 0.0)
            if graph.plugin(bsdf) == "phong" and values.may_be_nonzero(radiance):
                light = graph.add(EMITTER, properties("area", radiance=radiance))
                graph.attach(shape, "emitter", light)
                replaced.emitter(graph.label(shape), "k_i", "area", 1.0)


AREA = LightKind(
    plugins=("area",),
    to_heuristic=_to_heuristic,
    colour="radiance",
    on_shapes=True,
)
