"""Scenes that serve many points: made once per structure, and edited through ``mitsuba.traverse``.

Two graphs have one structure if they differ at most in values that :data:`EDITABLE` names. The
scenes of the first are then edited into those of the second, which makes nothing again that does
not depend on the values, and leaks nothing.
"""

from dataclasses import dataclass
from numbers import Real

import mitsuba as mi
import numpy as np

from heuristic.errors import InputError
from reference.pairing import lights
from reference.scene.graph import Reference
from reference.scene.values import COLOURS

EDITABLE = {
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
} | {
    plugin: {key: (name, None) for key, name in names.items()}
    for kind in lights.KINDS
    for plugin, names in kind.edits.items()
}
"""Values that can be edited: for each plugin and property, the name that ``mitsuba.traverse`` has
for it, and how it is made out of the properties where it is not the property itself."""


@dataclass
class _Made:
    graph: object
    scene: object
    parameters: object


class Kept:
    """One Mitsuba scene for the graphs that come one after another, edited where that is possible.

    ``made`` counts the scenes that were made.
    """

    def __init__(self):
        self.made = 0
        self._kept = None

    def scene(self, graph):
        """Return a Mitsuba scene of a graph: the cached one, edited, or a new one."""
        if self._kept is not None:
            edits = self._edits_of(graph)
            if edits is not None:
                self._apply(edits, graph)
                return self._kept.scene
        scene = graph.instantiate()
        self._kept = _Made(graph, scene, mi.traverse(scene))
        self.made += 1
        # Editing moves values out of the kernels' code. Done at once, all points share kernels.
        self._apply(self._edits_of(graph, every=True), graph)
        return scene

    def _edits_of(self, graph, every=False):
        """Return the values to set, by Mitsuba's names, ``every`` one or those that differ.

        None where the graph has another structure, so that editing would not do.
        """
        old, places = self._kept.graph, _places(graph)
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
                known = name is not None and path in self._kept.parameters
                if known and type(before[key]) is type(value):
                    edits[path] = convert(after) if convert else value
                elif not same:
                    return None
        return edits

    def _apply(self, edits, graph):
        parameters = self._kept.parameters
        try:
            for key, value in edits.items():
                parameters[key] = value
            parameters.update()
        except Exception:
            self._kept = None  # half edited
            raise
        self._kept.graph = graph


def _editable(plugin, key):
    """Return what :data:`EDITABLE` says; parameters of a heuristic have names of their own."""
    if plugin == "heuristic":
        return key, None
    return EDITABLE.get(plugin, {}).get(key, (None, None))


def _transform(given):
    """Return a transform in the variant's own precision; the parser keeps doubles."""
    return mi.ScalarTransform4f(np.array(given.matrix, np.float32))


def _same(a, b):
    if isinstance(a, Reference) and isinstance(b, Reference):
        return a.index() == b.index()
    if hasattr(a, "matrix") and hasattr(b, "matrix"):
        return repr(a.matrix) == repr(b.matrix)
    return repr(a) == repr(b)


def _places(graph):
    """Return the name under which Mitsuba finds each node, by index, as far as it has one."""
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


def set_values(graph, values):
    """Put other values at some places of a user's scene.

    Parameters
    ----------
    graph : reference.scene.graph.Graph
        The scene.
    values
        Numbers by path, ``<id of the element>.<parameter>``, such as ``"red.reflectance"``. The
        scene must state the parameter, as a number or as RGB, which becomes a grey.

    Raises
    ------
    InputError
        When a path leads nowhere or to something that is not a number.
    """
    for path, value in values.items():
        _set(graph, path, value)


def _set(graph, path, value):
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
        raise InputError(f"{graph.name}: {path} is not a number, and cannot be varied yet.")
    is_colour = isinstance(props[key], COLOURS)
    props[key] = mi.ScalarColor3f(value) if is_colour else value


def _is_number(value):
    return isinstance(value, (Real, *COLOURS)) and not isinstance(value, bool)
