"""Reading and scaling the values of a scene's parameters, in the parser's form."""

from collections.abc import Iterable
from numbers import Real
from typing import Any

import mitsuba as mi
import numpy as np

from heuristic.arrays import Colour
from heuristic.errors import InputError
from reference.scene.graph import Graph

COLOURS = (mi.ScalarColor3f, mi.ScalarColor3d)


def colour(graph: Graph, index: int, key: str, default: Any) -> tuple[float, float, float]:
    """Return a parameter as three components.

    Raises
    ------
    InputError
        If it is a texture or a tabulated spectrum, negative, or not finite.
    """
    props = graph.props(index)
    value = props.get(key, default)
    if isinstance(value, Real):
        components = (float(value),) * 3
    elif isinstance(value, COLOURS):
        red, green, blue = map(float, value)
        components = red, green, blue
    elif hasattr(value, "is_uniform") and value.is_uniform():
        components = (float(value.values[0]),) * 3
    else:
        raise InputError(
            f"{graph.name}: {graph.label(index)}: {key} is a texture or a tabulated spectrum,"
            f" which {props.plugin_name()} does not support yet. Give a number or RGB."
        )
    if not all(np.isfinite(components)) or min(components) < 0:
        raise InputError(
            f"{graph.name}: {graph.label(index)}: {key} = {_shown(components)} is not allowed: give"
            " finite values of 0 or more."
        )
    return components


def check_colours(graph: Graph, index: int, keys: Iterable[str]) -> None:
    """Reject plain values that are negative or not finite; textures and spectra are not read.

    Raises
    ------
    InputError
        With the parameter, its value and its place.
    """
    props = graph.props(index)
    for key in keys:
        if key in props and isinstance(props[key], (Real, *COLOURS)):
            colour(graph, index, key, 0.0)


def number(graph: Graph, index: int, key: str, default: Any) -> float:
    """Return a parameter as a finite number.

    Raises
    ------
    InputError
        If it is not one; with Mitsuba's own message, if Mitsuba rejects it too.
    """
    props = graph.props(index)
    value = props.get(key, default)
    if not isinstance(value, Real):
        graph.instantiate(index)
    if not isinstance(value, Real) or not np.isfinite(float(value)):
        raise InputError(
            f"{graph.name}: {graph.label(index)}: {key} = {value!r} is not allowed: give a finite"
            " number."
        )
    return float(value)


def index_of_refraction(graph: Graph, index: int, key: str, default: Any) -> float:
    """Return an index of refraction, given as a number or a material's name."""
    return float(mi.lookup_ior(graph.props(index), key, default))


def may_be_nonzero(value: Any) -> bool:
    """Return whether a parameter can be non-zero; textures and spectra can."""
    if isinstance(value, Real):
        return value != 0
    if isinstance(value, COLOURS):
        return any(component != 0 for component in value)
    return True


def scaled(components: Colour, factor: Colour) -> tuple[float, ...]:
    """Return a colour times a factor, which is a number or one value per channel."""
    return tuple(float(value) for value in np.multiply(components, factor))


def _shown(components):
    if len(set(components)) == 1:
        return f"{components[0]:g}"
    return "(" + ", ".join(f"{component:g}" for component in components) + ")"
