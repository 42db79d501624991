"""Values of a scene's parameters: read, scaled, and combined.

A value is a number, three components, or the parser's form of a texture or tabulated spectrum.
:func:`product` and the functions after it combine any: if all operands are plain the result is
plain; otherwise it is a reference to a new node of :mod:`fotismos.heuristic.plugins.textures`,
which computes the same at each point.
"""

from collections.abc import Callable, Iterable
from numbers import Real
from typing import Any

import mitsuba as mi
import numpy as np

from fotismos.heuristic.errors import InputError
from fotismos.reference.scene.graph import Graph, Reference, properties

COLOURS = (mi.ScalarColor3f, mi.ScalarColor3d)


def plain(value: Any) -> float | tuple[float, ...] | None:
    """Return a value as a float or three floats, None if it is a texture or spectrum."""
    if isinstance(value, Real):
        return float(value)
    if isinstance(value, (tuple, *COLOURS)):
        return tuple(map(float, value))
    if hasattr(value, "is_uniform") and value.is_uniform():
        return float(value.values[0])
    return None


def colour(graph: Graph, index: int, key: str, default: Any) -> tuple[float, float, float]:
    """Return a parameter as three components; InputError if it has none, or they are not allowed.

    Textures and tabulated spectra have none; negative and infinite ones are not allowed.
    """
    props = graph.props(index)
    value = plain(props.get(key, default))
    if value is None:
        raise InputError(
            f"{graph.name}: {graph.label(index)}: {key} is a texture or a tabulated spectrum,"
            f" which {props.plugin_name()} does not support yet. Give a number or RGB."
        )
    red, green, blue = value if isinstance(value, tuple) else (value,) * 3
    components = red, green, blue
    if not all(np.isfinite(components)) or min(components) < 0:
        shown = f"{components[0]:g}" if len(set(components)) == 1 else str(components)
        raise InputError(
            f"{graph.name}: {graph.label(index)}: {key} = {shown} is not allowed: give finite"
            " values of 0 or more."
        )
    return components


def check_colours(graph: Graph, index: int, keys: Iterable[str]) -> None:
    """Reject plain values that are negative or not finite; textures and spectra are not read."""
    props = graph.props(index)
    for key in keys:
        if key in props and isinstance(props[key], (Real, *COLOURS)):
            colour(graph, index, key, 0.0)


def number(graph: Graph, index: int, key: str, default: Any) -> float:
    """Return a parameter as a finite number; with Mitsuba's message, if Mitsuba rejects it too."""
    value = graph.props(index).get(key, default)
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


def is_zero(value: Any) -> bool:
    """Return whether a value is plain and 0."""
    number = plain(value)
    return number is not None and not np.any(number)


def may_be_nonzero(value: Any) -> bool:
    """Return whether a parameter can be non-zero; textures and spectra can."""
    return not (isinstance(value, (Real, *COLOURS)) and is_zero(value))


def product(graph: Graph, a: Any, b: Any) -> Any:
    """Return ``a b``."""
    if is_zero(a) or is_zero(b):
        return 0.0
    for factor, other in ((a, b), (b, a)):
        if _same(factor, 1.0):
            return other
    return _combined(graph, "heuristic_product", np.multiply, a=a, b=b)


def total(graph: Graph, a: Any, b: Any) -> Any:
    """Return ``a + b``."""
    if is_zero(a) or is_zero(b):
        return b if is_zero(a) else a
    return _combined(graph, "heuristic_sum", np.add, a=a, b=b)


def total_emission(graph: Graph, a: Any, b: Any) -> Any:
    """Return ``a + b`` of emitted light: beside a spectrum, a plain value is daylight too."""
    if mi.is_spectral and not is_zero(a) and not is_zero(b):
        terms = [plain(a), plain(b)]
        if None in terms and terms != [None, None]:
            return total(graph, *(_daylight(graph, value) for value in (a, b)))
    return total(graph, a, b)


def _daylight(graph: Graph, value: Any) -> Any:
    level = plain(value)
    if level is None:
        return value
    if isinstance(level, tuple):
        return node(graph, "d65", color=mi.ScalarColor3f(level))
    return node(graph, "d65", scale=level)


def share(graph: Graph, a: Any, weight: Any) -> Any:
    """Return ``a weight``; the weight is a scalar, clipped to [0, 1]."""
    if is_zero(a) or is_zero(weight):
        return 0.0
    return _combined(
        graph, "heuristic_share", lambda a, w: a * np.clip(w, 0, 1), a=a, weight=weight
    )


def rest(graph: Graph, a: Any, weight: Any) -> Any:
    """Return ``a (1 - weight)``; the weight is a scalar, clipped to [0, 1]."""
    if is_zero(a) or is_zero(weight):
        return a
    return _combined(
        graph, "heuristic_rest", lambda a, w: a * (1 - np.clip(w, 0, 1)), a=a, weight=weight
    )


def blend(graph: Graph, a: Any, b: Any, weight: Any) -> Any:
    """Return ``a (1 - weight) + b weight``; the weight is a scalar, clipped to [0, 1]."""
    if _same(a, b):
        return a

    def mixed(a: Any, b: Any, w: Any) -> Any:
        w = np.clip(w, 0, 1)
        return np.multiply(a, 1 - w) + np.multiply(b, w)

    return _combined(graph, "heuristic_blend", mixed, a=a, b=b, weight=weight)


def sides(graph: Graph, front: Any, back: Any) -> Any:
    """Return ``front`` on the front of a surface, else ``back``."""
    return front if _same(front, back) else node(graph, "heuristic_sides", front=front, back=back)


def node(graph: Graph, plugin: str, **values: Any) -> Reference:
    """Add a texture node, and return the reference to it."""
    return Reference(graph.add(mi.ObjectType.Texture, properties(plugin, **values)))


def _combined(graph: Graph, plugin: str, function: Callable[..., Any], **operands: Any) -> Any:
    numbers = [plain(value) for value in operands.values()]
    if all(value is not None for value in numbers):
        result = np.asarray(function(*(np.asarray(value) for value in numbers)), float)
        return tuple(result.tolist()) if result.ndim else float(result)
    return node(graph, plugin, **operands)


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, Reference) and isinstance(b, Reference):
        return bool(a.index() == b.index())
    first = plain(a)
    other = plain(b)
    return first is not None and other is not None and bool(np.all(np.equal(first, other)))
