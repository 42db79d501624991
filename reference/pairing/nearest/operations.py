"""Arithmetic on the values of a scene's parameters: numbers and colours at once, textures later.

A value is a number, three components, or the parser's form of a texture or tabulated spectrum. If
all operands are plain the result is plain; otherwise it is a reference to a new node of
:mod:`heuristic.plugins.mapped`, which computes the same at each point.
"""

from collections.abc import Callable
from numbers import Real
from typing import Any

import mitsuba as mi
import numpy as np

from reference.scene.graph import Graph, Reference, properties
from reference.scene.values import COLOURS

TEXTURE = mi.ObjectType.Texture


def plain(value: Any) -> float | tuple[float, ...] | None:
    """Return a value as a float or three floats, None if it is a texture or spectrum."""
    if isinstance(value, Real):
        return float(value)
    if isinstance(value, (tuple, *COLOURS)):
        return tuple(map(float, value))
    if hasattr(value, "is_uniform") and value.is_uniform():
        return float(value.values[0])
    return None


def is_zero(value: Any) -> bool:
    """Return whether a value is plain and 0."""
    known = plain(value)
    return known is not None and not np.any(known)


def product(graph: Graph, a: Any, b: Any) -> Any:
    """Return ``a b``."""
    if is_zero(a) or is_zero(b):
        return 0.0
    for one, other in ((a, b), (b, a)):
        if _same(one, 1.0):
            return other
    return _combined(graph, "heuristic_product", np.multiply, a=a, b=b)


def total(graph: Graph, a: Any, b: Any) -> Any:
    """Return ``a + b``."""
    if is_zero(a) or is_zero(b):
        return b if is_zero(a) else a
    return _combined(graph, "heuristic_sum", np.add, a=a, b=b)


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

    def mixed(a, b, w):
        w = np.clip(w, 0, 1)
        return np.multiply(a, 1 - w) + np.multiply(b, w)

    return _combined(graph, "heuristic_blend", mixed, a=a, b=b, weight=weight)


def sides(graph: Graph, front: Any, back: Any) -> Any:
    """Return ``front`` on the front of a surface, else ``back``."""
    if _same(front, back):
        return front
    return node(graph, "heuristic_sides", front=front, back=back)


def exponent(graph: Graph, alpha: Any) -> Reference:
    """Return the exponent of the lobe as wide as microfacets of a textured roughness."""
    return node(graph, "heuristic_exponent", alpha=alpha)


def node(graph: Graph, plugin: str, **values: Any) -> Reference:
    """Add a texture node, and return the reference to it."""
    return Reference(graph.add(TEXTURE, properties(plugin, **values)))


def _combined(graph: Graph, plugin: str, function: Callable, **operands: Any) -> Any:
    known = [plain(value) for value in operands.values()]
    if all(value is not None for value in known):
        found = np.asarray(function(*(np.asarray(value) for value in known)), float)
        return tuple(found.tolist()) if found.ndim else float(found)
    return node(graph, plugin, **operands)


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, Reference) and isinstance(b, Reference):
        return a.index() == b.index()
    one, other = plain(a), plain(b)
    return one is not None and other is not None and bool(np.all(np.equal(one, other)))
