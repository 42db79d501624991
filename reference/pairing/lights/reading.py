"""The lights of a scene as pairing reads them, and what it records of them."""

from dataclasses import dataclass

import mitsuba as mi
import numpy as np

from heuristic.lights import INVERSE_SQUARE
from reference.scene import values

EMITTER = mi.ObjectType.Emitter
SHAPE = mi.ObjectType.Shape
BSDF = mi.ObjectType.BSDF
COLOURS = {
    "point": "intensity",
    "directional": "irradiance",
    "spot": "intensity",
    "area": "radiance",
    "constant": "radiance",
    "heuristic_point": "intensity",
    "heuristic_spot": "intensity",
    "heuristic_directional": "intensity",
}
"""The emitters that are paired by their parameters, and their colour."""

FALLOFF_OF_MITSUBA = dict(zip(("k0", "k1", "k2"), map(float, INVERSE_SQUARE), strict=True))


@dataclass(frozen=True)
class PairedEmitter:
    """What a light was replaced by, the factor between the intensities, and what has no form."""

    name: str
    given: str
    derived: str
    factor: float
    exact: bool
    note: str = ""
    lost: str = ""


def check(graph):
    """Refuse intensities that are negative or not finite.

    Raises
    ------
    InputError
        Naming the parameter, its value and its place.
    """
    for index in graph.nodes(EMITTER):
        if graph.plugin(index) in COLOURS:
            values.check_colours(graph, index, (COLOURS[graph.plugin(index)],))


def position(graph, index):
    """Return the position of a point or spot, however it was given."""
    props = graph.props(index)
    if "to_world" in props:
        return mi.ScalarPoint3f(*column(props["to_world"], 3))
    return props["position"] if "position" in props else mi.ScalarPoint3f(0)


def axis(graph, index):
    """Return the unit vector in which a heuristic light travels."""
    direction = np.ravel(given(graph, index, "direction", (0, 0, 1))).astype(float)
    return direction / np.linalg.norm(direction)


def column(transform, number):
    """Return the first three components of a column of a transform: an axis, or the origin."""
    return [float(component) for component in np.array(transform.matrix)[:3, number]]


def given(graph, index, key, default):
    """Return a parameter as the parser keeps it."""
    props = graph.props(index)
    return props.get(key, default)
