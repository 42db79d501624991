"""Replacing physical lights by heuristic ones (table in :mod:`reference.pairing.factors`).

What that table has no row for gets the nearest light that there is:

==================================  ===============================================================
Physical                            Nearest
==================================  ===============================================================
``envmap`` and other environments   ``I_a``, its mean radiance over the sphere
``sunsky``, ``timed_sunsky``        the same for the sky; the sun is a directional light of its
                                    irradiance and mean direction
``projector``, textured ``spot``    a spot: the even cone of the same solid angle and flux
textured ``area``                   as ``area``, of its mean radiance
any other                           none: it is left out
==================================  ===============================================================
"""

import mitsuba as mi
import numpy as np

from heuristic.plugins import emitters
from reference.pairing import factors
from reference.pairing.lights import measured, reading, spots
from reference.pairing.lights.reading import BSDF, EMITTER, FALLOFF_OF_MITSUBA, SHAPE, PairedEmitter
from reference.scene import values
from reference.scene.graph import Reference, properties

SUN_AND_SKY = ("sunsky", "timed_sunsky")
MEAN = "I_a is the mean radiance over the sphere"

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
    on_shapes = {
        index for shape in graph.nodes(SHAPE) for _, index in graph.children(shape, EMITTER)
    }
    for index in graph.nodes(EMITTER):
        plugin, props = graph.plugin(index), graph.props(index)
        if index in on_shapes or plugin in emitters.KINDS:
            continue
        if plugin == "point":
            record = _point_to_heuristic(graph, index)
        elif plugin == "projector" or _is_textured_spot(graph, index):
            record = _beam_to_heuristic(graph, index)
        elif plugin == "spot":
            record = _spot_to_heuristic(graph, index)
        elif plugin == "directional":
            record = _directional_to_heuristic(graph, index)
        elif plugin == "constant":
            ambient = props.get("radiance", 1.0)
            record = PairedEmitter(graph.label(index), plugin, "ambient", 1.0, True)
        elif plugin in SUN_AND_SKY:
            ambient, record = _sun_and_sky(graph, index)
        elif (emitter := graph.instantiate(index)).is_environment():
            ambient = measured.mean_radiance(graph, emitter)
            lost = "directions of the environment's light"
            record = PairedEmitter(graph.label(index), plugin, "ambient", 1.0, False, MEAN, lost)
        else:
            record = _dropped(graph, index)
            graph.remove(index)
        records.append(record)
    records += _area_to_heuristic(graph, geometry, hide_emitters)
    return records, ambient


def _point_to_heuristic(graph, index):
    derived = properties(
        "heuristic_point",
        position=reading.position(graph, index),
        intensity=reading.given(graph, index, "intensity", 1.0),
        scale=factors.INTENSITY_FACTOR,
        **FALLOFF_OF_MITSUBA,
    )
    graph.replace(index, derived)
    return PairedEmitter(
        graph.label(index), "point", "heuristic_point", factors.INTENSITY_FACTOR, True
    )


def _spot_to_heuristic(graph, index):
    cutoff = values.number(graph, index, "cutoff_angle", 20.0)
    beam_width = values.number(graph, index, "beam_width", 0.75 * cutoff)
    to_world = reading.given(graph, index, "to_world", mi.ScalarTransform4f())
    exponent = spots.exponent_for(cutoff, beam_width)
    derived = properties(
        "heuristic_spot",
        position=reading.position(graph, index),
        direction=mi.ScalarVector3f(*reading.column(to_world, 2)),
        cutoff=cutoff,
        exponent=exponent,
        intensity=reading.given(graph, index, "intensity", 1.0),
        scale=factors.INTENSITY_FACTOR,
        **FALLOFF_OF_MITSUBA,
    )
    graph.replace(index, derived)
    note = f"m = {exponent:.4g} fitted to the linear fall-off from {beam_width:g} to {cutoff:g} deg"
    return PairedEmitter(
        graph.label(index), "spot", "heuristic_spot", factors.INTENSITY_FACTOR, False, note
    )


def _is_textured_spot(graph, index):
    return graph.plugin(index) == "spot" and "texture" in graph.props(index)


def _beam_to_heuristic(graph, index):
    plugin, label = graph.plugin(index), graph.label(index)
    to_world = reading.given(graph, index, "to_world", mi.ScalarTransform4f())
    place, axis = reading.column(to_world, 3), reading.column(to_world, 2)
    beam = measured.beam(graph, graph.instantiate(index), place, axis)
    if beam is None:
        record = _dropped(graph, index)
        graph.remove(index)
        return record
    derived = properties(
        "heuristic_spot",
        position=mi.ScalarPoint3f(*place),
        direction=mi.ScalarVector3f(*axis),
        cutoff=beam.cutoff,
        exponent=0.0,
        intensity=beam.intensity,
        scale=factors.INTENSITY_FACTOR,
        **FALLOFF_OF_MITSUBA,
    )
    graph.replace(index, derived)
    note = f"an even cone of {beam.cutoff:.4g} deg, of the same solid angle and flux"
    factor = factors.INTENSITY_FACTOR
    return PairedEmitter(label, plugin, "heuristic_spot", factor, False, note, "its picture")


def _sun_and_sky(graph, index):
    """Return the mean radiance of the sky; the sun becomes a light of its own."""
    label, plugin = graph.label(index), graph.plugin(index)
    sky, sun = (
        measured.mean_radiance(graph, _only(graph, index, "sun_scale")),
        measured.irradiance(graph, _only(graph, index, "sky_scale")),
    )
    note = MEAN
    if sun is not None:
        intensity, direction = sun
        light = properties(
            "heuristic_directional",
            direction=mi.ScalarVector3f(*direction),
            intensity=intensity,
        )
        light.set_id(f"sun of {label}")
        graph.attach(0, f"sun_of_{index}", graph.add(EMITTER, light))
        note += "; the sun a directional light of its irradiance"
    lost = "directions of the sky's light, and the sun's extent"
    return sky, PairedEmitter(label, plugin, "ambient", 1.0, False, note, lost)


def _only(graph, index, off):
    """Return a sunsky with one of its two parts switched off."""
    copy = graph.copy()
    copy.props(index)[off] = 0.0
    return copy.instantiate(index)


def _dropped(graph, index):
    note = "left out: it has no nearest form"
    label, plugin = graph.label(index), graph.plugin(index)
    return PairedEmitter(label, plugin, "none", 0.0, False, note, "this kind of light")


def _directional_to_heuristic(graph, index):
    props = graph.props(index)
    irradiance = props.get("irradiance", 1.0)
    if "to_world" in props:
        direction = reading.column(props["to_world"], 2)
    else:
        direction = np.ravel(reading.given(graph, index, "direction", (0, 0, 1)))
    derived = properties(
        "heuristic_directional",
        direction=mi.ScalarVector3f(*map(float, direction)),
        intensity=irradiance,
        scale=factors.INTENSITY_FACTOR,
    )
    graph.replace(index, derived)
    return PairedEmitter(
        graph.label(index), "directional", "heuristic_directional", factors.INTENSITY_FACTOR, True
    )


def _area_to_heuristic(graph, geometry, hide_emitters):
    """Replace each area light by emission of its shape and a spot or point at its centroid."""
    records = []
    made = None
    for shape in graph.nodes(SHAPE):
        for key, index in graph.children(shape, EMITTER):
            if graph.plugin(index) == "heuristic_glow":
                continue
            graph.detach(shape, key)
            if graph.plugin(index) != "area":
                records.append(_dropped(graph, index))
                continue
            radiance = reading.given(graph, index, "radiance", 1.0)
            if hide_emitters:
                graph.remove(shape)
            else:
                _glow(graph, shape, radiance)
            made = made or {found.id(): found for found in geometry().shapes()}
            emitting = made[graph.props(shape).id()]
            derived, record = _area_light(graph, shape, radiance, emitting)
            derived.set_id(f"light of {graph.label(shape)}")
            light = graph.add(EMITTER, derived)
            graph.attach(0, f"light_of_{shape}", light)
            records.append(record)
    return records


def _area_light(graph, shape, radiance, emitting):
    centroid, area, normal = _extent(emitting)
    if _varies(graph, radiance):
        radiance = measured.surface_mean(graph, emitting)
    common = {
        "position": mi.ScalarPoint3f(*centroid),
        "intensity": radiance,
        **FALLOFF_OF_MITSUBA,
    }
    name = graph.label(shape)
    flatness = float(np.linalg.norm(normal))
    if flatness > FLATNESS:
        factor = factors.INTENSITY_FACTOR * area * flatness
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
    factor = factors.CLOSED_LIGHT_FACTOR * area
    derived = properties("heuristic_point", scale=factor, **common)
    note = f"closed, area {area:.6g}, in the far field; the shape keeps its emission as k_i"
    return derived, PairedEmitter(name, "area", "heuristic_point", factor, False, note)


def _varies(graph, value):
    """Tell whether a value is a texture that differs from point to point."""
    if not isinstance(value, Reference):
        return False
    return graph.instantiate(value.index()).is_spatially_varying()


def _extent(shape):
    """Return centroid, area and mean normal of a shape, by its own sampling on a regular grid."""
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
