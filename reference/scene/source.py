"""The source of a scene, read once: the file parsed, the script run, its files listed."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from os import PathLike
from pathlib import Path
from typing import Any

import mitsuba as mi

from heuristic.errors import InputError, suggestion
from reference.scene import messages
from reference.scene.graph import Graph, files_from, resolving
from reference.scene.reading import included, placeholders, require_named_files

Parser = mi.parser
Content = str | PathLike | Mapping[str, Any] | Callable[[], Mapping[str, Any]]
Edit = Callable[[Graph], None]


@dataclass(frozen=True)
class Source:
    """The source of a scene: a name, and an XML file or a dictionary.

    Parameters
    ----------
    name
        Name in reports and of the output folder.
    content
        Path of a Mitsuba XML file, a dictionary for ``mitsuba.load_dict``, or a function that
        returns one.
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
        """Return the same scene with one more edit of its graph; it is not read again."""
        other = replace(self, edits=(*self.edits, edit))
        object.__setattr__(other, "_read", self._read)
        return other

    def parse(self) -> Graph:
        """Return the scene's graph for the current variant, to be edited freely.

        A file is parsed once per variant; a function is called once.

        Raises
        ------
        InputError
            With Mitsuba's own message, which names file, line and column, if the file is missing,
            is not XML, or uses something unknown to Mitsuba.
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
        """Mitsuba's messages while it read the scene."""
        return self._read.setdefault("said", [])

    def files(self) -> tuple[Path, ...]:
        """Return the files that the scene reads, each where Mitsuba finds it, sorted.

        These are the scene's own file, its includes, every file that an element names, and files
        that a script read (:class:`reference.scene.script.Script`). The tables of a ``<spectrum
        filename=...>`` are in the graph as soon as it is parsed.
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

    def _require_placeholders(self, path: Path) -> None:
        """Ensure that the file has a placeholder for each given value."""
        known = placeholders(path) if self.parameters else set()
        for name in sorted(set(self.parameters) - known):
            raise InputError(
                f"{self.name}: it has no placeholder ${name}{suggestion(name, known)}. Write it"
                " into the file, or leave the option -D out."
            )

    def _parsed(self, variant: str) -> Graph:
        config = Parser.ParserConfig(variant)
        content, resolver = self._content(), None
        try:
            if isinstance(content, Mapping):
                require_named_files(content)
                state = Parser.parse_dict(config, dict(content))
            else:
                path = Path(content)
                included(path, self.parameters)
                self._require_placeholders(path)
                resolver = files_from(path.resolve().parent)
                with resolving(resolver):
                    state = Parser.parse_file(config, str(path), **self.parameters)
            Parser.transform_upgrade(config, state)
            Parser.transform_resolve_references(config, state)
        except (RuntimeError, ValueError) as error:  # the latter for bytes that are not UTF-8
            raise InputError(f"{self.name}: {error}") from error
        if state.root.type != mi.ObjectType.Scene:
            raise InputError(f"{self.name}: its outermost element must be <scene>.")
        graph = Graph(self.name, config, state)
        graph.resolver = resolver
        return graph


def _file(resolver: mi.FileResolver, value: str) -> Path | None:
    """Return the file that a text names, if any."""
    if not value or len(value) > 4096 or "\0" in value or "\n" in value:
        return None
    path = Path(str(resolver.resolve(value)))
    try:
        return path.resolve() if path.is_file() else None
    except OSError:
        return None
