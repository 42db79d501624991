"""The files of a scene, checked before Mitsuba opens them.

Mitsuba's parser recurses and can crash, a pipe blocks whoever opens it, and includes can fan out
forever. So another parser of XML reads a scene's files first, and names files by Mitsuba's rules:
placeholders and their ``<default>``, and the folders of ``<path>``. Only faults that would end or
hang the process are rejected here, and text that is not XML; Mitsuba rejects the others.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from xml.parsers import expat

import mitsuba as mi
import numpy as np

from heuristic import meshes
from heuristic.errors import InputError
from reference.scene.graph import DEEPEST, FILENAME, Graph, find_file, require_file

PLACEHOLDER = re.compile(r"\$(\w+)")
COMMENT = re.compile(rb"<!\[CDATA\[.*?(?:\]\]>|\Z)|<\?.*?(?:\?>|\Z)|<!--(.*?)(?:-->|\Z)", re.DOTALL)

Element = tuple[str, dict[str, str]]


@dataclass
class Files:
    """A scene file and those that it includes, and the names of the placeholders in them."""

    parameters: dict[str, str]
    paths: list[Path] = field(default_factory=list)
    placeholders: set[str] = field(default_factory=set)

    def read(self, path: Path, outer: tuple[Path, ...], resolver: mi.FileResolver) -> None:
        """Check a file, included by the ``outer`` ones, and everything that it includes."""
        if path.resolve() in outer:
            raise InputError(f"{path}: it includes itself. Remove the <include> that leads back.")
        if len(outer) >= DEEPEST:
            raise InputError(f"{path}: more than {DEEPEST} files include each other.")
        if not path.is_file():
            raise InputError(f"{path}: there is no such regular file. Give a Mitsuba scene (.xml).")
        try:
            content = path.read_bytes()
        except OSError as error:
            raise InputError(f"{path}: {error.strerror}. Ensure that it can be read.") from error
        self.paths.append(path.resolve())
        resolver = mi.FileResolver(resolver)
        resolver.prepend(str(path.parent))
        for tag, given in _elements(path, content):
            self.placeholders.update(*(PLACEHOLDER.findall(value) for value in given.values()))
            values = {name: self._filled(value) for name, value in given.items()}
            if tag == "default" and {"name", "value"} <= values.keys():
                self.parameters.setdefault(values["name"], values["value"])
            elif tag == "path" and (place := find_file(resolver, values.get("value", ""))):
                resolver.prepend(str(place))
            elif place := find_file(resolver, values.get(FILENAME, "")):
                require_file(str(path), place)
                if tag == "include":
                    self.read(place, (*outer, path.resolve()), resolver)

    def _filled(self, value: str) -> str:
        for name in sorted(self.parameters, key=len, reverse=True) if "$" in value else ():
            parts = re.split(rf"(?<!\\)\${re.escape(name)}", value)
            value = self.parameters[name].join(parts)
        return value.replace(r"\$", "$")


def included(path: Path, parameters: Mapping[str, str] | None = None) -> Files:
    """Return a scene's :class:`Files`, after ensuring that all can be read.

    ``parameters`` are values for placeholders.
    """
    files = Files(dict(parameters or {}))
    files.read(path, (), mi.file_resolver())
    return files


def placeholders(path: Path) -> set[str]:
    """Return the names of the placeholders in a scene file and what it includes; none in others."""
    return included(path).placeholders if path.suffix == ".xml" and path.is_file() else set()


def _elements(path: Path, content: bytes) -> list[Element]:
    elements: list[Element] = []
    depth = 0

    def begin(tag, attributes):
        nonlocal depth
        depth += 1
        if depth > DEEPEST:
            raise InputError(
                f"{path}: elements are nested more than {DEEPEST} deep. Write it flatter."
            )
        elements.append((tag, attributes))

    def end(tag):
        nonlocal depth
        depth -= 1

    parser = expat.ParserCreate("utf-8")
    parser.StartElementHandler, parser.EndElementHandler = begin, end
    try:
        parser.Parse(COMMENT.sub(_without_hyphens, content), True)
    except expat.ExpatError as error:
        raise InputError(
            f"{path}: line {error.lineno}, column {error.offset + 1}: this is not XML in UTF-8:"
            f" {expat.ErrorString(error.code)}."
        ) from error
    return elements


def _without_hyphens(comment: re.Match[bytes]) -> bytes:
    """Make a comment strict XML: with ``--`` inside it is none, but Mitsuba takes it."""
    text, begin, end = comment[0], *comment.span(1)
    if begin < 0:
        return text
    begin, end = begin - comment.start(), end - comment.start()
    return text[:begin] + text[begin:end].replace(b"-", b"=") + text[end:]


def damage(graph: Graph, index: int) -> str:
    """Return what is wrong with the file of a mesh; empty if nothing is.

    Mitsuba does not check whether the faces of PLY and serialized meshes name vertices that exist:
    it reads memory beyond them.
    """
    plugin, path = graph.plugin(index), graph.file(index)
    if path is None:
        return ""
    state, number = path.stat(), graph.props(index).get("shape_index", 0)
    stamp = state.st_mtime_ns, state.st_size, mi.variant()
    fault = _wrong_mesh(plugin, str(path), number, stamp)
    return f"{path}: {fault} Write the file again." if fault else ""


@lru_cache(maxsize=1024)
def _wrong_mesh(plugin: str, path: str, number: int, stamp: tuple) -> str:
    # With face normals nothing is computed at vertices, which may not exist.
    description = {"type": plugin, "filename": path, "face_normals": True}
    if plugin == "serialized":
        description["shape_index"] = number
    try:
        mesh = mi.load_dict(description)
    except Exception:  # making the scene raises it again
        return ""
    faces, count = meshes.rows(mesh, meshes.FACES), mesh.vertex_count()
    if len(faces) and faces.max() >= count:
        return f"a face names vertex {faces.max()}, and there are {count}, numbered from 0."
    lost = ~np.isfinite(meshes.rows(mesh, meshes.POSITIONS)).all(axis=1)
    if lost.any():
        return (
            f"the position of vertex {lost.argmax()} is not finite, and that of"
            f" {np.count_nonzero(lost)} vertices in all."
        )
    return ""
