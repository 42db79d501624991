"""A scene as Mitsuba's parser reads it: a graph of nodes that can be edited before it is made.

Both halves of a pair are derived from one such graph. It comes from an XML file or from a Python
dictionary, and knows the file and line of each node for error messages.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from fotismos.heuristic import llvm
from fotismos.heuristic.errors import InputError
from fotismos.heuristic.plugins import PLUGINS
from fotismos.reference.scene.messages import plain_message

FILENAME = "filename"
"""The parameter with which every plugin names its file."""

SCRIPT = "scene"
"""Name of a Python file's dictionary, or of the function that returns it."""

KINDS = {
    "bsdf": mi.ObjectType.BSDF,
    "integrator": mi.ObjectType.Integrator,
    "emitter": mi.ObjectType.Emitter,
    "texture": mi.ObjectType.Texture,
}
"""Kinds of our own plugins."""

Parser = mi.parser
Reference = mi.Properties.ResolvedReference


def set_variant(variant: str) -> None:
    """Switch Mitsuba to one of the variants that fotismos supports."""
    if variant not in llvm.VARIANTS:
        raise llvm.unknown_variant("variant", variant)
    llvm.use_threads()
    mi.set_variant(variant)


class Graph:
    """The nodes of one scene, with the edits that pairing needs.

    An index identifies a node. Nodes are only added or replaced, so indices stay valid.
    """

    def __init__(self, name: str, config: Any, state: Any) -> None:
        self.name = name
        self.config = config
        self.state = state
        self.folders: list[Any] = []  # temporary, with files that nodes refer to
        self.kinds: dict[str, Any] = {}  # of plugins written in Python
        self.resolver = None  # finds files with relative names, if not Mitsuba's own

    def copy(self) -> "Graph":
        """Return a copy that can be edited independently."""
        return self._of(Parser.ParserState(self.state))

    def _of(self, state: Any) -> "Graph":
        graph = Graph(self.name, self.config, state)
        graph.folders = list(self.folders)
        graph.kinds = self.kinds
        graph.resolver = self.resolver
        return graph

    def part(self, index: int) -> "Graph":
        """Return a graph of a node, which comes first, and copies of everything it refers to."""
        part = self._of(Parser.ParserState())
        part.state.files = self.state.files
        indices = [index, *(inner for inner in self.nodes_in_use(index) if inner != index)]
        places = {inner: number for number, inner in enumerate(indices)}
        paths = list(self.state.node_paths)  # without files and added nodes
        if paths:
            part.state.node_paths = [
                paths[inner] if inner < len(paths) else "" for inner in indices
            ]
        for inner in indices:
            node = Parser.SceneNode(self.state.nodes[inner])
            node.props = mi.Properties(node.props)
            part.state.nodes.append(node)
        for node in part.state.nodes:
            for key, value in list(node.props.items()):
                if isinstance(value, Reference):
                    node.props[key] = Reference(places[value.index()])
        return part

    def instantiate(self, index: int = 0) -> Any:
        """Make the Mitsuba scene, without merging shapes; or only the object of another node.

        InputError has Mitsuba's own message if a plugin rejects its parameters.
        """
        if index:
            return self.part(index).instantiate()
        try:
            instance = self._made()
        except Exception as error:  # plugins may raise anything, in Python or in Mitsuba
            raise InputError(f"{self.name}: {plain_message(error)}") from error
        if isinstance(instance, mi.Scene):
            self._require_extents(instance)
        return instance

    def _made(self) -> Any:
        state = Parser.ParserState(self.state)
        for node in state.nodes:
            for key in node.props.keys():  # noqa: SIM118  Properties is not a mapping
                value = node.props[key]
                # Plugins empty a tensor, and turn a bitmap's colours into spectra in place.
                if isinstance(value, (mi.TensorXf, mi.Bitmap)):
                    node.props[key] = type(value)(value)
                # Reading a value marks it as used, and would hide it from Mitsuba's check.
                node.props.mark_queried(key, False)
        # A Python plugin that evaluates something while several threads make plugins would wait
        # forever for a thread that waits for Python.
        self.config.parallel = not any(
            node.type == mi.ObjectType.Unknown or node.props.plugin_name() in PLUGINS
            for node in state.nodes
        )
        with resolving(self.resolver):
            instance = Parser.instantiate(self.config, state)
        return instance[0] if isinstance(instance, list) else instance

    def _require_extents(self, scene: Any) -> None:
        for shape in scene.shapes():
            box = shape.bbox()
            ends = np.array([np.ravel(box.min), np.ravel(box.max)])
            is_empty = (ends[0] > ends[1]).any()
            if not (is_empty or np.isfinite(ends).all()):
                raise InputError(
                    f"{self.name}: {shape.id()}: the shape reaches from {ends[0]} to {ends[1]}."
                    " Give it a finite size and place; check its transforms and files."
                )

    def nodes(self, kind: Any, plugin: str = "") -> list[int]:
        """Return the indices of the nodes in use of a kind (``mitsuba.ObjectType``) or a plugin."""
        matching = [index for index in self.nodes_in_use() if self.kind(index) == kind]
        return [index for index in matching if plugin in ("", self.plugin(index))]

    def kind(self, index: int) -> Any:
        """Return the kind of a node; Mitsuba does not know it for Python plugins."""
        kind = self.state.nodes[index].type
        if kind != mi.ObjectType.Unknown:
            return kind
        plugin = self.plugin(index)
        if plugin not in self.kinds:
            if plugin in PLUGINS:
                kind = KINDS[PLUGINS[plugin][0]]
            else:  # a user's plugin has the kind of the object that it makes
                instance = self.instantiate(index)
                for name in ("BSDF", "Emitter", "Integrator", "Texture", "Shape", "Sensor", "Film"):
                    if isinstance(instance, getattr(mi, name)):
                        kind = getattr(mi.ObjectType, name)
                        break
            self.kinds[plugin] = kind
        return self.kinds[plugin]

    def plugin(self, index: int) -> str:
        """Return the name of a node's plugin."""
        return str(self.props(index).plugin_name())

    def props(self, index: int) -> Any:
        """Return a node's properties. Changing them changes the graph."""
        return self.state.nodes[index].props

    def label(self, index: int) -> str:
        """Return a short name of a node for records and messages: its id, or else its location."""
        if identifier := self.props(index).id():
            return str(identifier)
        location = Parser.file_location(self.state, self.state.nodes[index])
        return f"{self.plugin(index)} at {location}"

    def file(self, index: int) -> Path | None:
        """Return where Mitsuba finds the file that a node names, None if nothing is there."""
        name = self.props(index).get(FILENAME, None)
        return find_file(self.resolver, name) if isinstance(name, str) else None

    def children(self, index: int, kind: Any) -> list[tuple[str, int]]:
        """Return ``(key, index)`` of a node's children of a kind."""
        return [
            (key, value.index())
            for key, value in self.props(index).items()
            if isinstance(value, Reference) and self.kind(value.index()) == kind
        ]

    def shapes(self) -> list[int]:
        """Return the indices of the shapes in use."""
        return self.nodes(mi.ObjectType.Shape)

    def emitters(self) -> list[int]:
        """Return the indices of the lights in use."""
        return self.nodes(mi.ObjectType.Emitter)

    def emitters_of(self, index: int) -> list[tuple[str, int]]:
        """Return ``(key, index)`` of the lights of a shape, or of the scene, which is node 0."""
        return self.children(index, mi.ObjectType.Emitter)

    def bsdfs_of(self, index: int) -> list[tuple[str, int]]:
        """Return ``(key, index)`` of the materials of a shape, or within a material."""
        return self.children(index, mi.ObjectType.BSDF)

    def materials_of(self, shape: int) -> list[int]:
        """Return the indices of a shape's materials, and of all that are nested in them."""
        return [
            index
            for _, bsdf in self.bsdfs_of(shape)
            for index in self.nodes_in_use(bsdf)
            if self.kind(index) == mi.ObjectType.BSDF
        ]

    def add(self, kind: Any, props: Any) -> int:
        """Add a node, and return its index."""
        node = Parser.SceneNode()
        node.type = kind
        node.props = props
        self.state.nodes.append(node)
        return len(self.state.nodes) - 1

    def graft(self, other: "Graph", index: int) -> int:
        """Copy a node of another graph with all that it refers to, and return its index here."""
        props = mi.Properties(other.props(index))
        for key, value in list(props.items()):
            if isinstance(value, Reference):
                props[key] = Reference(self.graft(other, value.index()))
        return self.add(other.kind(index), props)

    def attach(self, parent: int, key: str, child: int) -> None:
        """Make a node the child of another, replacing any under that key."""
        self.props(parent)[key] = Reference(child)

    def detach(self, parent: int, key: str) -> None:
        """Remove a child."""
        del self.props(parent)[key]

    def remove(self, index: int) -> None:
        """Remove a node from its parent, the scene."""
        for key, value in list(self.props(0).items()):
            if isinstance(value, Reference) and value.index() == index:
                self.detach(0, key)

    def replace(self, index: int, props: Any) -> None:
        """Give a node other properties; its id stays."""
        props.set_id(self.props(index).id())
        node = Parser.SceneNode(self.state.nodes[index])
        node.type = self.kind(index)
        node.props = props
        self.state.nodes[index] = node

    def nodes_in_use(self, root: int = 0) -> list[int]:
        """Return the indices of the scene, or another node, and all nodes that it refers to."""
        seen = set()
        queue = [root]
        while queue:
            index = queue.pop()
            if index in seen:
                continue
            seen.add(index)
            for _, value in self.props(index).items():
                if isinstance(value, Reference):
                    queue.append(value.index())
        return sorted(seen)


def find_file(resolver: mi.FileResolver | None, name: str) -> Path | None:
    """Return the path where Mitsuba finds a name, None if nothing is there."""
    if not name or "\0" in name:
        return None
    path = Path(str((resolver or mi.file_resolver()).resolve(name)))
    try:
        return path if path.exists() else None
    except OSError:  # a name that is too long
        return None


def require_regular_file(scene: str, name: str, path: Path) -> None:
    """Raise `InputError` for a pipe or a device that a scene names: reading it may never end."""
    if not (path.is_file() or path.is_dir()):
        raise InputError(
            f"{scene}: {name} is not a regular file. Write its content to one, and name that."
        )


@contextmanager
def resolving(resolver: Any) -> Iterator[None]:
    """Let Mitsuba find files with a resolver, to which a ``<path>`` in a scene adds places."""
    if resolver is None:
        yield
        return
    before = mi.file_resolver()
    mi.set_file_resolver(resolver)
    try:
        yield
    finally:
        mi.set_file_resolver(before)


def properties(plugin: str, **values: Any) -> Any:
    """Make the properties of a node."""
    props = mi.Properties(plugin)
    for key, value in values.items():
        props[key] = mi.ScalarColor3f(value) if isinstance(value, tuple) else value
    return props
