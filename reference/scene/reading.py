"""The files of a scene, checked before Mitsuba opens them.

Mitsuba's parser recurses and can crash, a pipe blocks whoever opens it, and includes can fan out
forever. Only faults that would end or hang the process are checked; Mitsuba rejects the others.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from heuristic.errors import InputError
from reference.scene.graph import FILENAME, Graph

DEEPEST = 100
"""Nested elements. Scenes need about ten; some thousands fill the parser's stack."""

MOST_INCLUDES = 1000
"""Files that a scene includes, each as often as it is included."""

LONGEST = 2**26
"""Bytes of a scene's text, with its includes. Meshes and images are separate files."""

TAG = re.compile(r"""<(/?)[A-Za-z_](?:"[^"]*"|'[^']*'|[^"'<>])*?(/?)>""")
INCLUDE = re.compile(r"""<include\b[^<>]*?\bfilename\s*=\s*["']([^"']*)["']""")
NAMED = re.compile(r"""\bfilename\s*=\s*["']([^"']*)["']""")
DEFAULT = re.compile(
    r"""<default\b[^<>]*?\bname\s*=\s*["']([^"']*)["'][^<>]*?\bvalue\s*=\s*["']([^"']*)["']"""
)
PLACEHOLDER = re.compile(r"\$(\w+)")
COMMENT = re.compile(rb"<!--.*?(?:-->|\Z)", re.DOTALL)


def included(path: Path, parameters: Mapping[str, str] | None = None) -> list[Path]:
    """Return a scene file and those that it includes, after ensuring that all can be read.

    ``parameters`` are values for placeholders, which names of files may contain.

    Raises
    ------
    InputError
        If one is not a file or cannot be read, has a NUL, includes itself, or is too deep, or there
        are more of them than :data:`MOST_INCLUDES` or :data:`LONGEST` allow.
    """
    reading = _Reading(dict(parameters or {}))
    reading.read(path, ())
    return reading.found


def placeholders(path: Path) -> set[str]:
    """Return the names of the placeholders in a scene file and what it includes; none in others."""
    if path.suffix != ".xml" or not path.is_file():
        return set()
    reading = _Reading({})
    reading.read(path, ())
    return reading.placeholders


def require_files(graph: Graph) -> None:
    """Reject elements that name a folder, pipe, socket or device instead of a file.

    Raises
    ------
    InputError
        Naming the element and the file.
    """
    for index in graph.nodes_in_use():
        path = graph.file(index)
        if path is not None and not path.is_file():
            raise InputError(
                f"{graph.name}: {graph.label(index)}: {_not_regular(path)} Give a file."
            )


def require_named_files(description: Mapping[str, Any]) -> None:
    """Reject the same in a dictionary, whose spectra are read during parsing.

    Raises
    ------
    InputError
        Naming the file.
    """
    for key, value in description.items():
        if isinstance(value, Mapping):
            require_named_files(value)
        elif key == FILENAME and isinstance(value, str) and "\0" not in value:
            path = Path(value)
            try:
                is_special = path.exists() and not path.is_file()
            except OSError as error:  # a name that is too long
                raise InputError(f"{value[:60]!r}: {error.strerror}. Give a file.") from error
            if is_special:
                raise InputError(f"{_not_regular(path)} Give a file.")


@dataclass
class _Reading:
    """The state of reading one scene file and its includes."""

    parameters: dict[str, str]
    found: list[Path] = field(default_factory=list)
    placeholders: set[str] = field(default_factory=set)
    size: int = 0

    def read(self, path: Path, outer: tuple[Path, ...]) -> None:
        """Check a file, included by the ``outer`` ones, and everything that it includes."""
        if path.resolve() in outer:
            raise InputError(f"{path}: it includes itself. Remove the <include> that leads back.")
        if len(outer) >= DEEPEST:
            raise InputError(f"{path}: more than {DEEPEST} files include each other.")
        if len(self.found) > MOST_INCLUDES:
            raise InputError(
                f"{path}: the scene includes files more than {MOST_INCLUDES} times. Join them."
            )
        text = self._text(path)
        self.found.append(path.resolve())
        _require_flat(path, text)
        self.placeholders.update(PLACEHOLDER.findall(text))
        for name, value in DEFAULT.findall(text):
            self.parameters.setdefault(name, value)
        for place in self._places(path, NAMED.findall(text)):
            if not place.is_file():
                raise InputError(f"{path}: {_not_regular(place)} Give a file.")
        for inner in self._places(path, INCLUDE.findall(text)):
            self.read(inner, (*outer, path.resolve()))

    def _places(self, path: Path, names: list[str]) -> Iterator[Path]:
        """Yield the paths of named files that exist: next to the file, or in the current folder."""
        for name in names:
            given = self._filled(name)
            if "\0" in given or not given:
                continue
            for place in (path.parent / given, Path(given)):
                try:
                    is_there = place.exists()
                except OSError:  # a name that is too long
                    continue
                if is_there:
                    yield place
                    break

    def _filled(self, name: str) -> str:
        """Return a name with placeholders filled in, the longest names first, as Mitsuba does."""
        for word in sorted(self.parameters, key=len, reverse=True):
            name = name.replace(f"${word}", self.parameters[word])
        return name

    def _text(self, path: Path) -> str:
        """Return a file's text without its comments."""
        if not path.is_file():
            raise InputError(f"{path}: there is no such regular file. Give a Mitsuba scene (.xml).")
        try:
            self.size += path.stat().st_size
            if self.size > LONGEST:
                raise InputError(
                    f"{path}: with it the scene has {self.size} bytes of text; at most {LONGEST}"
                    " are allowed. Put meshes and images into separate files."
                )
            content = path.read_bytes()
        except OSError as error:
            raise InputError(f"{path}: {error.strerror}. Ensure that it can be read.") from error
        if b"\0" in content:
            raise InputError(f"{path}: it holds a NUL byte. Save it as XML in UTF-8.")
        try:
            return COMMENT.sub(b"", content).decode("utf-8")
        except UnicodeDecodeError as error:
            raise InputError(
                f"{path}: it holds {error.object[error.start]:#04x}, which is not UTF-8. Save it"
                " in UTF-8."
            ) from error


def _require_flat(path: Path, text: str) -> None:
    depth = 0
    for end, empty in TAG.findall(text):
        depth += -1 if end else 0 if empty else 1
        if depth > DEEPEST:
            raise InputError(
                f"{path}: elements are nested more than {DEEPEST} deep. Write it flatter."
            )


def _not_regular(path: Path) -> str:
    kinds = {
        "a folder": path.is_dir,
        "a pipe": path.is_fifo,
        "a socket": path.is_socket,
        "a device": lambda: path.is_char_device() or path.is_block_device(),
    }
    kind = next((kind for kind, holds in kinds.items() if holds()), "not a file")
    return f"{path} is {kind}, which cannot be read as a file."
