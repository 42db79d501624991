"""Where a scene comes from, read once: the file parsed, the script run, its files named."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from os import PathLike
from pathlib import Path
from typing import Any

import mitsuba as mi

from heuristic.errors import InputError
from reference.scene import messages
from reference.scene.graph import Graph, files_from, resolving

Parser = mi.parser
Content = str | PathLike | Mapping[str, Any] | Callable[[], Mapping[str, Any]]
Edit = Callable[[Graph], None]


@dataclass(frozen=True)
class Source:
    """Where a scene comes from: a name, and an XML file or a dictionary.

    Parameters
    ----------
    name
        Name in reports and of the output folder.
    content
        Path of a Mitsuba XML file, a dictionary as ``mitsuba.load_dict`` takes it, or a function
        that returns one.
    parameters
        Values for the ``$name`` placeholders of an XML file.
    edits
        Functions that change the graph, in order.
    """

    name: str
    content: Content
    parameters: Mapping[str, str] = field(default_factory=dict)
    edits: tuple[Edit, ...] = ()
    _read: dict[str, Any] = field(default_factory=dict, init=False, repr=False, compare=False)

    def edited(self, edit: Edit) -> "Source":
        """Return the same scene with one more change to its graph; it is not read again."""
        other = replace(self, edits=(*self.edits, edit))
        object.__setattr__(other, "_read", self._read)
        return other

    def parse(self) -> Graph:
        """Return the scene's graph for the current variant, to be edited freely.

        A file is parsed once for each variant; a function is called once.

        Raises
        ------
        InputError
            With Mitsuba's own message, which names file, line and column, when the file is missing,
            is not XML, or uses something that Mitsuba does not know.
        """
        variant = mi.variant()
        if variant not in self._read:
            with messages.collected(self.said):
                self._read[variant] = self._parsed(variant)
        graph = self._read[variant].copy()
        for edit in self.edits:
            edit(graph)
        return graph

    @property
    def said(self) -> list[str]:
        """What Mitsuba said when it read the scene."""
        return self._read.setdefault("said", [])

    def files(self) -> tuple[Path, ...]:
        """Return the files that the scene reads, each where Mitsuba finds it, sorted.

        These are the scene's own file, what it includes, every file that an element names, and what
        a script read as it ran (:class:`reference.scene.script.Script`). The
        tables of a ``<spectrum filename=...>`` are in the graph as soon as it is parsed.
        """
        graph = self.parse()
        found = set(getattr(self.content, "files", ()))
        if isinstance(self.content, (str, PathLike)):
            found |= {Path(str(file)).resolve() for file in graph.state.files}
        with resolving(graph.resolver):
            resolver = mi.file_resolver()
            for index in graph.nodes_in_use():
                for _, value in graph.props(index).items():
                    if isinstance(value, str) and (path := _file(resolver, value)):
                        found.add(path)
        return tuple(sorted(found))

    def _content(self) -> str | PathLike | Mapping[str, Any]:
        if not callable(self.content):
            return self.content
        if "content" not in self._read:
            self._read["content"] = self.content()
        return self._read["content"]

    def _parsed(self, variant: str) -> Graph:
        config = Parser.ParserConfig(variant)
        content, resolver = self._content(), None
        try:
            if isinstance(content, Mapping):
                state = Parser.parse_dict(config, dict(content))
            else:
                path = Path(content)
                included(path)
                resolver = files_from(path.resolve().parent)
                with resolving(resolver):
                    state = Parser.parse_file(config, str(path), **self.parameters)
            Parser.transform_upgrade(config, state)
            Parser.transform_resolve_references(config, state)
        except RuntimeError as error:
            raise InputError(f"{self.name}: {error}") from error
        if state.root.type != mi.ObjectType.Scene:
            raise InputError(
                f"{self.name}: this is not a scene. Its outermost element must be a scene."
            )
        graph = Graph(self.name, config, state)
        graph.resolver = resolver
        return graph


def _file(resolver: mi.FileResolver, value: str) -> Path | None:
    """Return the file that a text names, if it names one."""
    if not value or len(value) > 4096 or "\0" in value or "\n" in value:
        return None
    path = Path(str(resolver.resolve(value)))
    try:
        return path.resolve() if path.is_file() else None
    except OSError:
        return None


DEEPEST = 100
"""Elements within elements. Scenes need about ten; the parser's stack is full at some thousands."""

TAG = re.compile(r"""<(/?)[A-Za-z_](?:"[^"]*"|'[^']*'|[^"'<>])*?(/?)>""")
INCLUDE = re.compile(r"""<include\b[^<>]*?\bfilename\s*=\s*["']([^"']*)["']""")
PLACEHOLDER = re.compile(r"\$(\w+)")
COMMENT = re.compile(r"<!--.*?(?:-->|\Z)", re.DOTALL)


def included(path: Path) -> list[Path]:
    """Return a scene file and those that it includes, after ensuring that all can be read.

    Mitsuba's parser recurses, and can be made to crash. No more is checked than what would end the
    process or never end; all else is Mitsuba's to refuse.

    Raises
    ------
    InputError
        When one is not a file or cannot be read, has a NUL, includes itself, or is too deep.
    """
    found: list[Path] = []
    _check(path, (), found)
    return found


def placeholders(path: Path) -> set[str]:
    """Return the names of the placeholders in a scene file and what it includes; none in others."""
    if path.suffix != ".xml" or not path.is_file():
        return set()
    return {name for each in included(path) for name in PLACEHOLDER.findall(_text(each))}


def _check(path: Path, outer: tuple[Path, ...], found: list[Path]) -> None:
    if path.resolve() in outer:
        raise InputError(f"{path}: it includes itself. Take the <include> out that leads back.")
    if len(outer) >= DEEPEST:
        raise InputError(f"{path}: more than {DEEPEST} files include each other.")
    text = _text(path)
    found.append(path.resolve())
    depth = 0
    for end, empty in TAG.findall(text):
        depth += -1 if end else 0 if empty else 1
        if depth > DEEPEST:
            raise InputError(
                f"{path}: elements lie more than {DEEPEST} deep in each other. Write it flatter."
            )
    for name in INCLUDE.findall(text):
        inner = path.parent / name
        if inner.is_file():  # else Mitsuba looks elsewhere, or says what is missing
            _check(inner, (*outer, path.resolve()), found)


def _text(path: Path) -> str:
    """Return a file's text without its comments."""
    if not path.is_file():
        raise InputError(
            f"{path}: there is no such file, or it is no regular one. Give a Mitsuba scene (.xml)."
        )
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}. Ensure that it can be read.") from error
    if b"\0" in content:
        raise InputError(f"{path}: it holds a NUL byte, which no XML file in UTF-8 has.")
    return COMMENT.sub("", content.decode("utf-8", errors="replace"))
