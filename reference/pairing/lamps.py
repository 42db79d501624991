"""Lights with an extent, and those that must be measured, to their nearest heuristic forms.

``area``: in the far field a point or an even spot, nearby a glow ``k_i``. ``constant``, ``envmap``
and any other plugin whose light surrounds the scene: ``I_a``, the mean radiance; the sun of
``sunsky`` and ``timed_sunsky`` is a directional light. ``projector`` and textured ``spot``: an even
cone. Any other light is left out: it has no nearest form.
"""

from typing import Any

import mitsuba as mi
import numpy as np

from reference.pairing import probe
from reference.pairing.factors import CLOSED_LIGHT_FACTOR, INTENSITY_FACTOR
from reference.pairing.lights import LightNode, heuristic
from reference.scene.graph import Reference, properties

BSDF, EMITTER = mi.ObjectType.BSDF, mi.ObjectType.Emitter


def to_heuristic(light: LightNode) -> Any:
    """Replace a light by its nearest form, and return the radiance that becomes ``I_a``, if any."""
    match light.plugin:
        case "area" if light.shape is not None:
            _area(light)
        case "projector" | "spot" if light.shape is None:
            _even_cone(light)
        case "constant" if light.shape is None:
            light.becomes_ambient()
            return light.value("radiance", 1.0)
        case "sunsky" | "timed_sunsky" if light.shape is None:
            return _daylight(light)
        case _ if light.shape is None and light.emitter.is_environment():
            ambient = probe.mean_radiance(light.graph, light.emitter)
            light.becomes_ambient(probe.MEAN, "directions of the environment's light")
            return ambient
        case _:
            light.leave_out()
    return None


FLATNESS = 0.5
"""A light with a longer mean normal shines to one side; a closed one has a mean normal of 0."""

FLAT = 1 - 1e-4
"""A light with a mean normal longer than this is flat."""


def _area(light: LightNode) -> None:
    graph, shape, radiance = light.graph, light.shape, light.value("radiance", 1.0)
    if light.hide_emitters:
        # Mitsuba's integrators look through it, and the heuristic casts no shadows.
        graph.remove(shape)
    else:  # its own copy of its phong shines
        ((key, bsdf),) = graph.children(shape, BSDF)
        props = mi.Properties(graph.props(bsdf))
        props.set_id(f"{graph.label(shape)}_glowing")
        props["k_i"] = radiance
        graph.attach(shape, key, graph.add(BSDF, props))
    identifier = graph.props(shape).id()
    made = next(found for found in light.geometry().shapes() if found.id() == identifier)
    centroid, area, normal, radius = _extent(made)
    is_texture = isinstance(radiance, Reference)
    if is_texture and graph.instantiate(radiance.index()).is_spatially_varying():
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


ROOM = 1.02
"""Factor on the radius of a lamp: the grid's places lie up to a 64th inside its edges."""


def _extent(shape: mi.Shape) -> tuple[list[float], float, list[float], float]:
    cells = (np.arange(64) + 0.5) / 64
    x, y = (axis.ravel() for axis in np.meshgrid(cells, cells))
    sample = shape.sample_position(0.0, mi.Point2f(mi.Float(x), mi.Float(y)))
    places = np.array(sample.p, float)
    centroid = places.mean(axis=1)
    normal = np.array(sample.n).mean(axis=1)
    radius = ROOM * np.linalg.norm(places - centroid[:, None], axis=0).max()
    area = float(np.ravel(shape.surface_area())[0])
    return centroid.tolist(), area, normal.tolist(), float(radius)


def _even_cone(light: LightNode) -> None:
    origin, axis = light.column(3), light.column(2)
    beam = probe.beam(light.graph, light.emitter, origin, axis)
    if beam is None:
        light.leave_out()
        return
    cutoff, intensity = beam
    props = heuristic(
        "heuristic_spot",
        position=mi.ScalarPoint3f(*origin),
        direction=mi.ScalarVector3f(*axis),
        cutoff=cutoff,
        exponent=0.0,
        intensity=intensity,
    )
    note = f"an even cone of {cutoff:.4g} deg, of the same solid angle and flux"
    light.replace(props, INTENSITY_FACTOR, exact=False, note=note, lost="its picture")


def _daylight(light: LightNode) -> Any:
    sun = probe.irradiance(light.graph, _only(light, "sky_scale"))
    note = probe.MEAN
    if sun is not None:
        intensity, direction = sun
        props = properties(
            "heuristic_directional", direction=mi.ScalarVector3f(*direction), intensity=intensity
        )
        props.set_id(f"sun of {light.label}")
        node = light.graph.add(mi.ObjectType.Emitter, props)
        light.graph.attach(0, f"sun_of_{light.index}", node)
        note += "; the sun a directional light of its irradiance"
    ambient = probe.mean_radiance(light.graph, _only(light, "sun_scale"))
    light.becomes_ambient(note, "directions of the sky's light, and the sun's extent")
    return ambient


def _only(light: LightNode, off: str) -> mi.Emitter:
    copy = light.graph.copy()
    copy.props(light.index)[off] = 0.0
    return copy.instantiate(light.index)
