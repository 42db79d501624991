"""Replacing the lights of a scene by their counterparts (table in :mod:`reference.pairing`)."""

from dataclasses import dataclass

import mitsuba as mi
import numpy as np

from heuristic.convention import IRRADIANCE_PER_INTENSITY
from heuristic.errors import InputError
from heuristic.lights import INVERSE_SQUARE
from reference import pairing, values
from reference.scene import properties

EMITTER = mi.ObjectType.Emitter
SHAPE = mi.ObjectType.Shape
BSDF = mi.ObjectType.BSDF
COLOURS = {
    "point": "intensity",
    "directional": "irradiance",
    "area": "radiance",
    "constant": "radiance",
    "heuristic_point": "intensity",
    "heuristic_directional": "intensity",
}
"""The emitters that can be paired, and their colour."""

FLATNESS = 0.5
"""A light whose mean normal is longer is treated as flat; a closed one has a mean normal of 0."""


@dataclass(frozen=True)
class PairedEmitter:
    """What a light was replaced by, and the factor between the two intensities."""

    name: str
    given: str
    derived: str
    factor: float
    exact: bool
    note: str = ""


def check(graph):
    """Refuse emitters that are not in the pairing table.

    Raises
    ------
    InputError
        Naming the plugin and its place.
    """
    for index in graph.nodes(EMITTER):
        if graph.plugin(index) not in COLOURS:
            raise InputError(
                f"{graph.name}: {graph.label(index)}: the emitter {graph.plugin(index)!r} cannot be"
                f" paired yet. Known are {', '.join(COLOURS)}."
            )
        values.check_colours(graph, index, (COLOURS[graph.plugin(index)],))


def to_heuristic(graph, geometry, hide_emitters):
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


def glowing_to_physical(graph):
    """Give each shape whose ``phong`` has a ``k_i`` an area light of that radiance.

    To be called while the shapes still have their ``phong``.
    """
    records = []
    for shape in graph.nodes(SHAPE):
        for _, bsdf in graph.children(shape, BSDF):
            radiance = _given(graph, bsdf, "k_i", 0.0)
            if graph.plugin(bsdf) == "phong" and values.may_be_nonzero(radiance):
                light = graph.add(EMITTER, properties("area", radiance=radiance))
                graph.attach(shape, "emitter", light)
                records.append(PairedEmitter(graph.label(shape), "k_i", "area", 1.0, True))
    return records


def to_physical(graph, surface):
    """Replace heuristic lights by physical ones; returns a :class:`PairedEmitter` each.

    ``surface()`` returns the :class:`reference.gbuffer.GBuffer` that the mean irradiance is
    taken over where the attenuation is not the inverse square.
    """
    convert = {
        "heuristic_point": _point_to_physical,
        "heuristic_directional": _directional_to_physical,
    }
    return [
        convert[graph.plugin(index)](graph, index, surface)
        for index in graph.nodes(EMITTER)
        if graph.plugin(index) in convert
    ]


def _point_to_heuristic(graph, index):
    props = graph.props(index)
    intensity = props.get("intensity", 1.0)
    k0, k1, k2 = map(float, INVERSE_SQUARE)
    derived = properties(
        "heuristic_point",
        position=_position(graph, index),
        intensity=intensity,
        scale=pairing.INTENSITY_FACTOR,
        k0=k0,
        k1=k1,
        k2=k2,
    )
    graph.replace(index, derived)
    return PairedEmitter(
        graph.label(index), "point", "heuristic_point", pairing.INTENSITY_FACTOR, True
    )


def _directional_to_heuristic(graph, index):
    props = graph.props(index)
    irradiance = props.get("irradiance", 1.0)
    if "to_world" in props:
        direction = np.array(props["to_world"].matrix)[:3, 2]
    else:
        direction = np.array(props["direction"]).ravel() if "direction" in props else (0, 0, 1)
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
            radiance = _given(graph, index, "radiance", 1.0)
            if hide_emitters:
                graph.remove(shape)
            else:
                _glow(graph, shape, radiance)
            derived, record = _area_light(graph, shape, index, radiance, geometry())
            light = graph.add(EMITTER, derived)
            graph.attach(0, f"light_of_{shape}", light)
            records.append(record)
    return records


def _area_light(graph, shape, index, radiance, scene):
    centroid, area, normal = _extent(scene, graph.props(shape).id())
    k0, k1, k2 = map(float, INVERSE_SQUARE)
    common = {"position": mi.ScalarPoint3f(*centroid), "intensity": radiance}
    common |= {"k0": k0, "k1": k1, "k2": k2}
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


def _point_to_physical(graph, index, surface):
    """The intensity of the same mean irradiance over the visible surface (exact for 1/d^2)."""
    position = _position(graph, index)
    coefficients = tuple(
        values.number(graph, index, key, default)
        for key, default in (("k0", 1.0), ("k1", 0.0), ("k2", 0.0))
    )
    factor, exact, note = IRRADIANCE_PER_INTENSITY, True, ""
    if coefficients != INVERSE_SQUARE:
        factor *= _level(coefficients, position, surface(), graph, index)
        exact = False
        note = "same mean irradiance over the visible surface; only the fall-off's shape differs"
    intensity = _scaled_intensity(graph, index, factor)
    graph.replace(index, properties("point", position=position, intensity=intensity))
    return PairedEmitter(graph.label(index), "heuristic_point", "point", factor, exact, note)


def _level(coefficients, position, surface, graph, index):
    """Return the ratio of mean irradiances under ``f_att`` and under the inverse square."""
    k0, k1, k2 = coefficients
    clamped = _given(graph, index, "clamped", False)

    def falloff(distance):
        factor = 1 / np.maximum(k0 + k1 * distance + k2 * distance**2, np.finfo(float).tiny)
        return np.minimum(factor, 1) if clamped else factor

    heuristic = surface.mean_irradiance(position, falloff)
    physical = surface.mean_irradiance(position, lambda distance: 1 / distance**2)
    return heuristic / physical if physical > 0 else 1.0


def _directional_to_physical(graph, index, surface):
    direction = _given(graph, index, "direction", mi.ScalarVector3f(0, 0, 1))
    irradiance = _scaled_intensity(graph, index, IRRADIANCE_PER_INTENSITY)
    graph.replace(index, properties("directional", direction=direction, irradiance=irradiance))
    return PairedEmitter(
        graph.label(index), "heuristic_directional", "directional", IRRADIANCE_PER_INTENSITY, True
    )


def _scaled_intensity(graph, index, factor):
    scale = values.number(graph, index, "scale", 1.0)
    return values.scaled(values.colour(graph, index, "intensity", 1.0), factor * scale)


def _position(graph, index):
    props = graph.props(index)
    if "to_world" in props:
        return mi.ScalarPoint3f(*map(float, np.array(props["to_world"].matrix)[:3, 3]))
    return props["position"] if "position" in props else mi.ScalarPoint3f(0)


def _given(graph, index, key, default):
    props = graph.props(index)
    return props.get(key, default)
