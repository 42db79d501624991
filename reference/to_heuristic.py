"""Replacing physical lights by heuristic ones (table in :mod:`reference.pairing`)."""

import mitsuba as mi
import numpy as np

from heuristic.errors import InputError
from reference import emitters, pairing, spots, values
from reference.emitters import BSDF, EMITTER, FALLOFF_OF_MITSUBA, SHAPE, PairedEmitter
from reference.scene import properties

FLATNESS = 0.5
"""A light whose mean normal is longer is treated as flat; a closed one has a mean normal of 0."""


def replace_lights(graph, geometry, hide_emitters):
    """Replace physical lights by heuristic ones.

    ``geometry()`` returns the Mitsuba scene, for the size and place of area lights. The environment
    stays as a background. With ``hide_emitters`` the shapes of area lights are taken out, since
    Mitsuba's integrators look through them and the heuristic casts no shadows.

    Returns
    -------
    records : list of PairedEmitter
    ambient : object or None
        The radiance of a constant environment, as the parser keeps it, to become ``I_a``.
    """
    records, ambient = [], None
    for index in graph.nodes(EMITTER):
        plugin, props = graph.plugin(index), graph.props(index)
        if plugin == "point":
            record = _point_to_heuristic(graph, index)
        elif plugin == "spot":
            record = _spot_to_heuristic(graph, index)
        elif plugin == "directional":
            record = _directional_to_heuristic(graph, index)
        elif plugin == "constant":
            ambient = props.get("radiance", 1.0)
            record = PairedEmitter(graph.label(index), plugin, "ambient", 1.0, True)
        else:
            continue
        records.append(record)
    records += _area_to_heuristic(graph, geometry, hide_emitters)
    return records, ambient


def _point_to_heuristic(graph, index):
    derived = properties(
        "heuristic_point",
        position=emitters.position(graph, index),
        intensity=emitters.given(graph, index, "intensity", 1.0),
        scale=pairing.INTENSITY_FACTOR,
        **FALLOFF_OF_MITSUBA,
    )
    graph.replace(index, derived)
    return PairedEmitter(
        graph.label(index), "point", "heuristic_point", pairing.INTENSITY_FACTOR, True
    )


def _spot_to_heuristic(graph, index):
    if graph.children(index, mi.ObjectType.Texture):
        raise InputError(
            f"{graph.name}: {graph.label(index)}: a spot with a texture cannot be paired yet."
        )
    cutoff = values.number(graph, index, "cutoff_angle", 20.0)
    beam_width = values.number(graph, index, "beam_width", 0.75 * cutoff)
    to_world = emitters.given(graph, index, "to_world", mi.ScalarTransform4f())
    exponent = spots.exponent_for(cutoff, beam_width)
    derived = properties(
        "heuristic_spot",
        position=emitters.position(graph, index),
        direction=mi.ScalarVector3f(*emitters.column(to_world, 2)),
        cutoff=cutoff,
        exponent=exponent,
        intensity=emitters.given(graph, index, "intensity", 1.0),
        scale=pairing.INTENSITY_FACTOR,
        **FALLOFF_OF_MITSUBA,
    )
    graph.replace(index, derived)
    note = f"m = {exponent:.4g} fitted to the linear fall-off from {beam_width:g} to {cutoff:g} deg"
    return PairedEmitter(
        graph.label(index), "spot", "heuristic_spot", pairing.INTENSITY_FACTOR, False, note
    )


def _directional_to_heuristic(graph, index):
    props = graph.props(index)
    irradiance = props.get("irradiance", 1.0)
    if "to_world" in props:
        direction = emitters.column(props["to_world"], 2)
    else:
        direction = np.ravel(emitters.given(graph, index, "direction", (0, 0, 1)))
    derived = properties(
        "heuristic_directional",
        direction=mi.ScalarVector3f(*map(float, direction)),
        intensity=irradiance,
        scale=pairing.INTENSITY_FACTOR,
    )
    graph.replace(index, derived)
    return PairedEmitter(
        graph.label(index), "directional", "heuristic_directional", pairing.INTENSITY_FACTOR, True
    )


def _area_to_heuristic(graph, geometry, hide_emitters):
    """Replace each area light by emission of its shape and a spot or point at its centroid."""
    records = []
    for shape in graph.nodes(SHAPE):
        for key, index in graph.children(shape, EMITTER):
            graph.detach(shape, key)
            radiance = emitters.given(graph, index, "radiance", 1.0)
            if hide_emitters:
                graph.remove(shape)
            else:
                _glow(graph, shape, radiance)
            derived, record = _area_light(graph, shape, index, radiance, geometry())
            derived.set_id(f"light of {graph.label(shape)}")
            light = graph.add(EMITTER, derived)
            graph.attach(0, f"light_of_{shape}", light)
            records.append(record)
    return records


def _area_light(graph, shape, index, radiance, scene):
    centroid, area, normal = _extent(scene, graph.props(shape).id())
    common = {
        "position": mi.ScalarPoint3f(*centroid),
        "intensity": radiance,
        **FALLOFF_OF_MITSUBA,
    }
    name = graph.label(shape)
    flatness = float(np.linalg.norm(normal))
    if flatness > FLATNESS:
        factor = pairing.INTENSITY_FACTOR * area * flatness
        derived = properties(
            "heuristic_spot",
            direction=mi.ScalarVector3f(*normal),
            cutoff=90.0,
            exponent=1.0,
            scale=factor,
            **common,
        )
        note = f"area {area:.6g}, in the far field; the shape keeps its emission as k_i"
        return derived, PairedEmitter(name, "area", "heuristic_spot", factor, False, note)
    factor = pairing.CLOSED_LIGHT_FACTOR * area
    derived = properties("heuristic_point", scale=factor, **common)
    note = f"closed, area {area:.6g}, in the far field; the shape keeps its emission as k_i"
    return derived, PairedEmitter(name, "area", "heuristic_point", factor, False, note)


def _extent(scene, identifier):
    """Return centroid, area and mean normal of a shape, by its own sampling on a regular grid."""
    shape = next(shape for shape in scene.shapes() if shape.id() == identifier)
    cells = (np.arange(64) + 0.5) / 64
    x, y = (axis.ravel() for axis in np.meshgrid(cells, cells))
    sample = shape.sample_position(0.0, mi.Point2f(mi.Float(x), mi.Float(y)))
    centroid = np.array(sample.p).mean(axis=1)
    normal = np.array(sample.n).mean(axis=1)
    return centroid.tolist(), float(np.ravel(shape.surface_area())[0]), normal.tolist()


def _glow(graph, shape, radiance):
    """Give a shape its own copy of its phong, with ``k_i`` set to a radiance."""
    ((key, bsdf),) = graph.children(shape, BSDF)
    props = mi.Properties(graph.props(bsdf))
    props.set_id(f"{graph.label(shape)}_glowing")
    props["k_i"] = radiance
    graph.attach(shape, key, graph.add(BSDF, props))
