"""Scenes that serve many points: made once per structure, and edited through ``mitsuba.traverse``.

Two graphs have the same structure if they differ only in values that :data:`EDITABLE` names. The
first one's scenes are then edited into the second one's, which leaks nothing and rebuilds only what
depends on the values.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from numbers import Real
from typing import Any, TypeAlias

import mitsuba as mi
import numpy as np

from heuristic.arrays import Scene
from heuristic.errors import InputError
from reference.pairing import lights
from reference.scene.graph import Graph, Reference
from reference.scene.values import COLOURS

Convert: TypeAlias = Callable[[Mapping[str, Any]], Any]

EDITABLE: dict[str, dict[str, tuple[str, Convert | None]]] = {
    "phong": {
        "k_a": ("k_a.value", None),
        "k_d": ("k_d.value", None),
        "k_s": ("k_s.value", None),
        "n": ("n", None),
        "base_color": ("base_color.value", None),
        **{name: (name, None) for name in ("alpha", "ior", "metallic")},
    },
    "roughplastic": {
        "diffuse_reflectance": ("diffuse_reflectance.value", None),
        "specular_reflectance": ("specular_reflectance.value", None),
        "alpha": ("alpha", None),
        # Exposed as the ratio of both indices.
        "int_ior": ("eta", lambda props: float(props["int_ior"]) / float(props["ext_ior"])),
    },
    "diffuse": {"reflectance": ("reflectance.value", None)},
    "disk": {"to_world": ("to_world", lambda props: _transform(props["to_world"]))},
    **{
        plugin: {key: (name, None) for key, name in names.items()}
        for kind in lights.KINDS
        for plugin, names in kind.edits.items()
    },
}
"""Editable values: for each plugin and property, its name in ``mitsuba.traverse``, and a function
that makes the value from the properties if it is not the property itself."""


@dataclass
class _Made:
    graph: Graph
    scene: Scene
    parameters: Any


class Kept:
    """One Mitsuba scene for successive graphs, edited if possible.

    ``made`` counts the scenes that were made.
    """

    def __init__(self) -> None:
        self.made = 0
        self._kept: _Made | None = None

    def scene(self, graph: Graph) -> Scene:
        """Return a Mitsuba scene of a graph: the cached one, edited, or a new one."""
        if self._kept is not None:
            edits = _edits(self._kept, graph)
            if edits is not None:
                self._apply(self._kept, edits, graph)
                return self._kept.scene
        scene = graph.instantiate()
        self._kept = _Made(graph, scene, mi.traverse(scene))
        self.made += 1
        # Editing moves values out of the kernels' code. Done at once, all points share kernels.
        self._apply(self._kept, _edits(self._kept, graph, every=True) or {}, graph)
        return scene

    def _apply(self, kept: _Made, edits: dict[str, Any], graph: Graph) -> None:
        try:
            for key, value in edits.items():
                kept.parameters[key] = value
            kept.parameters.update()
        except Exception:
            self._kept = None  # half edited
            raise
        kept.graph = graph


def _edits(kept: _Made, graph: Graph, every: bool = False) -> dict[str, Any] | None:
    """Return the values to set, by Mitsuba's names: all editable ones, or those that differ.

    None if the graph has another structure, which editing cannot give.
    """
    old, places = kept.graph, _places(graph)
    if places != _places(old):
        return None
    edits = {}
    for index, place in places.items():
        if old.plugin(index) != graph.plugin(index):
            return None
        before, after = dict(old.props(index).items()), dict(graph.props(index).items())
        if before.keys() != after.keys():
            return None
        for key, value in after.items():
            same = _same(before[key], value)
            if same and not every:
                continue
            name, convert = _editable(graph.plugin(index), key)
            path = f"{place}.{name}"
            known = name is not None and path in kept.parameters
            if known and type(before[key]) is type(value):
                edits[path] = convert(after) if convert else value
            elif not same:
                return None
    return edits


def _editable(plugin: str, key: str) -> tuple[str | None, Convert | None]:
    """Return the entry of :data:`EDITABLE`; parameters of a heuristic keep their names."""
    if plugin == "heuristic":
        return key, None
    return EDITABLE.get(plugin, {}).get(key, (None, None))


def _transform(given: Any) -> Any:
    """Return a transform in the variant's precision; the parser keeps doubles."""
    return mi.ScalarTransform4f(np.array(given.matrix, np.float32))


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, Reference) and isinstance(b, Reference):
        return a.index() == b.index()
    if hasattr(a, "matrix") and hasattr(b, "matrix"):
        return repr(a.matrix) == repr(b.matrix)
    return repr(a) == repr(b)


def _places(graph: Graph) -> dict[int, str]:
    """Return Mitsuba's names of the nodes, by index."""
    places, queue = {0: ""}, [0]
    while queue:
        parent = queue.pop(0)
        for key, value in graph.props(parent).items():
            if isinstance(value, Reference) and value.index() not in places:
                child = value.index()
                identifier = graph.props(child).id()
                inner = f"{places[parent]}.{key}" if places[parent] else identifier or key
                places[child] = inner
                queue.append(child)
    return places


def set_values(graph: Graph, values: dict[str, float]) -> None:
    """Set values in a user's scene.

    Parameters
    ----------
    graph
        The scene.
    values
        Numbers by path, ``<id of the element>.<parameter>``, such as ``"red.reflectance"``. The
        scene must state the parameter as a number, or as RGB, which becomes grey.

    Raises
    ------
    InputError
        When a path does not lead to a number or a colour.
    """
    for path, value in values.items():
        _set(graph, path, value)


def _set(graph: Graph, path: str, value: float) -> None:
    identifier, _, key = path.rpartition(".")
    found = [i for i in graph.nodes_in_use() if graph.props(i).id() == identifier]
    if not found or key not in graph.props(found[0]):
        named = sorted(
            f"{graph.props(i).id()}.{name}"
            for i in graph.nodes_in_use()
            for name, present in graph.props(i).items()
            if graph.props(i).id() and _is_number(present)
        )
        raise InputError(
            f"{graph.name} has no parameter {path!r}. Write <id>.<parameter>, such as one of:"
            f" {', '.join(named)}."
        )
    props = graph.props(found[0])
    if not _is_number(props[key]):
        raise InputError(f"{graph.name}: {path} is not a number or RGB. Vary one that is.")
    is_colour = isinstance(props[key], COLOURS)
    props[key] = mi.ScalarColor3f(value) if is_colour else value


def _is_number(value: object) -> bool:
    return isinstance(value, (Real, *COLOURS)) and not isinstance(value, bool)
