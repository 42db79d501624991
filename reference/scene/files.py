"""The files of a scene, checked before Mitsuba opens them, and the scenes of a folder.

Mitsuba's parser recurses and can crash, a pipe blocks whoever opens it, and includes can fan out
forever. So another parser of XML reads a scene's files first, and names files by Mitsuba's rules:
placeholders and their ``<default>``, and the folders of ``<path>``. Only faults that would end or
hang the process are rejected here, and text that is not XML, which the two parsers could read
differently; Mitsuba rejects the others.
"""

import ast
import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.parsers import expat

import mitsuba as mi

from heuristic.errors import InputError
from reference.scene.graph import FILENAME, Graph, find_file

DEEPEST = 100
"""Nested elements. Scenes need about ten; some thousands fill the parser's stack."""

MOST_INCLUDES = 1000
"""Files that a scene includes, each as often as it is included."""

LONGEST = 2**26
"""Bytes of a scene's text, with its includes. Meshes and images are separate files."""

SCRIPT = "scene"
"""Name of a Python file's dictionary, or of the function that returns it."""

PLACEHOLDER = re.compile(r"\$(\w+)")
COMMENT = re.compile(rb"<!\[CDATA\[.*?(?:\]\]>|\Z)|<\?.*?(?:\?>|\Z)|<!--(.*?)(?:-->|\Z)", re.DOTALL)
ROOT = re.compile(r"<scene\b")

Element = tuple[str, dict[str, str]]


@dataclass
class Files:
    """A scene file and those that it includes, and the names of the placeholders in them."""

    parameters: dict[str, str]
    paths: list[Path] = field(default_factory=list)
    placeholders: set[str] = field(default_factory=set)
    size: int = 0

    def read(self, path: Path, outer: tuple[Path, ...], resolver: mi.FileResolver) -> None:
        """Check a file, included by the ``outer`` ones, and everything that it includes."""
        if path.resolve() in outer:
            raise InputError(f"{path}: it includes itself. Remove the <include> that leads back.")
        if len(outer) >= DEEPEST:
            raise InputError(f"{path}: more than {DEEPEST} files include each other.")
        if len(self.paths) > MOST_INCLUDES:
            raise InputError(
                f"{path}: the scene includes files more than {MOST_INCLUDES} times. Join them."
            )
        content = _content(path, self.size)
        self.size += len(content)
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
                _require_file(str(path), place)
                if tag == "include":
                    self.read(place, (*outer, path.resolve()), resolver)

    def _filled(self, value: str) -> str:
        """Return a value with placeholders filled in, the longest names first, as Mitsuba does."""
        for name in sorted(self.parameters, key=len, reverse=True) if "$" in value else ():
            parts = re.split(rf"(?<!\\)\${re.escape(name)}", value)
            value = self.parameters[name].join(parts)
        return value.replace(r"\$", "$")


def included(path: Path, parameters: Mapping[str, str] | None = None) -> Files:
    """Return a scene's :class:`Files`, after ensuring that all can be read.

    ``parameters`` are values for placeholders. :class:`heuristic.errors.InputError` if a file is
    none or cannot be read, is not XML, includes itself, or is too deep, or if there are more than
    :data:`MOST_INCLUDES` or :data:`LONGEST` allow.
    """
    files = Files(dict(parameters or {}))
    files.read(path, (), mi.file_resolver())
    return files


def placeholders(path: Path) -> set[str]:
    """Return the names of the placeholders in a scene file and what it includes; none in others."""
    return included(path).placeholders if path.suffix == ".xml" and path.is_file() else set()


def _content(path: Path, before: int) -> bytes:
    """Return a file's bytes, if the scene's text stays short enough, with so many ``before``."""
    if not path.is_file():
        raise InputError(f"{path}: there is no such regular file. Give a Mitsuba scene (.xml).")
    try:
        size = before + path.stat().st_size
        if size > LONGEST:
            raise InputError(
                f"{path}: with it the scene has {size} bytes of text; at most {LONGEST} are"
                " allowed. Put meshes and images into separate files."
            )
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}. Ensure that it can be read.") from error
    if b"\0" in content:
        raise InputError(f"{path}: it holds a NUL byte. Save it as XML in UTF-8.")
    try:
        content.decode("utf-8")
    except UnicodeDecodeError as error:
        byte = error.object[error.start]
        raise InputError(
            f"{path}: it holds {byte:#04x}, which is not UTF-8. Save it in UTF-8."
        ) from error
    return content


def _elements(path: Path, content: bytes) -> list[Element]:
    """Return the elements of a file's text with their attributes, in order."""
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

    def declared(version, encoding, standalone):
        if encoding and encoding.lower() not in ("utf-8", "utf8") and not content.isascii():
            raise InputError(f"{path}: it declares the encoding {encoding}. Save it in UTF-8.")

    def doctype(*_):
        raise InputError(f"{path}: it has a DOCTYPE, which scenes do not need. Remove it.")

    parser = expat.ParserCreate("utf-8")
    parser.StartElementHandler, parser.EndElementHandler = begin, end
    parser.XmlDeclHandler, parser.StartDoctypeDeclHandler = declared, doctype
    try:
        parser.Parse(COMMENT.sub(_without_hyphens, content), True)
    except expat.ExpatError as error:
        raise InputError(
            f"{path}: line {error.lineno}, column {error.offset + 1}: this is not XML:"
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


def require_files(graph: Graph) -> None:
    """Reject elements that name a folder, pipe, socket or device instead of a file."""
    for index in graph.nodes_in_use():
        if path := graph.file(index):
            _require_file(f"{graph.name}: {graph.label(index)}", path)


def require_named_files(description: Mapping[str, Any], depth: int = 1) -> None:
    """Reject the same in a dictionary, whose spectra are read during parsing."""
    if depth > DEEPEST:
        raise InputError(f"the scene is nested more than {DEEPEST} deep. Write it flatter.")
    for key, value in description.items():
        if isinstance(value, Mapping):
            require_named_files(value, depth + 1)
        elif key == FILENAME and isinstance(value, str) and "\0" not in value:
            path = Path(value)
            try:
                if path.exists():
                    _require_file("the scene", path)
            except OSError as error:  # a name that is too long
                raise InputError(f"{value[:60]!r}: {error.strerror}. Give a file.") from error


def _require_file(where: str, path: Path) -> None:
    if path.is_file():
        return
    kinds = {
        "a folder": path.is_dir,
        "a pipe": path.is_fifo,
        "a socket": path.is_socket,
        "a device": lambda: path.is_char_device() or path.is_block_device(),
    }
    kind = next((kind for kind, holds in kinds.items() if holds()), "not a file")
    raise InputError(f"{where}: {path} is {kind}, which cannot be read as a file. Give a file.")


def scenes_in(folder: Path) -> tuple[list[Path], list[Path]]:
    """Return the scenes in a folder and its subfolders: Mitsuba's files, and Python's, sorted.

    Hidden files and links are skipped. Scenes are the files ``*.xml`` that have a scene element,
    but not those that others include, and the files ``*.py`` that define ``scene``. Nothing is run.
    """
    files = list(_files(folder))
    texts = [path for path in files if path.suffix == ".xml"]
    parts = {
        inner
        for path in texts
        for name in _includes(path)
        if (inner := (path.parent / name).resolve()) != path.resolve()
    }
    written = [path for path in texts if path.resolve() not in parts and _may_be_scene(path)]
    scripts = [path for path in files if path.suffix == ".py" and _defines_scene(path)]
    if not (written or scripts):
        raise InputError(
            f"{folder}: there is no scene in this folder: no .xml file that has a <scene>, and no"
            f" .py file that defines `{SCRIPT}`."
        )
    return written, scripts


def _files(folder: Path) -> Iterator[Path]:
    for place, inner, names in os.walk(folder):
        inner[:] = sorted(name for name in inner if not name.startswith("."))
        yield from (path for name in sorted(names) if (path := Path(place, name)).is_file())


def _includes(path: Path) -> list[str]:
    """Return the files that a scene file includes; none of one that cannot be read."""
    try:
        elements = _elements(path, _content(path, 0))
    except InputError:
        return []
    return [given.get(FILENAME, "") for tag, given in elements if tag == "include"]


def _may_be_scene(path: Path) -> bool:
    """Return whether a file has a scene; an unreadable one counts, and fails later."""
    return not os.access(path, os.R_OK) or ROOT.search(_text(path)) is not None


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""


def _defines_scene(path: Path) -> bool:
    """Return whether a Python file defines the name, without running it."""
    try:
        body = ast.parse(_text(path)).body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return False
    names = set()
    for node in body:
        names |= {node.name} if isinstance(node, ast.FunctionDef) else set()
        names |= {t.id for t in getattr(node, "targets", ()) if isinstance(t, ast.Name)}
    return SCRIPT in names
