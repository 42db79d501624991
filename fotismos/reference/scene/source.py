"""The source of a scene, read once: the file parsed, the script run, its files listed, a digest.

Mitsuba's logger writes to standard output, which is for results. Its messages are collected here,
so a record can state them.
"""

import ast
import hashlib
import re
import runpy
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from inspect import Parameter as Argument
from inspect import signature
from os import PathLike
from pathlib import Path
from typing import Any
from xml.parsers.expat import ExpatError, ParserCreate, errors

import mitsuba as mi
import numpy as np

from fotismos.heuristic.errors import InputError, suggestion
from fotismos.reference.scene.graph import (
    SCRIPT,
    Graph,
    Reference,
    find_file,
    require_regular_file,
    resolving,
)
from fotismos.reference.scene.messages import plain_message

Parser = mi.parser
Content = str | PathLike[str] | Mapping[str, Any] | Callable[[], Mapping[str, Any]]
Edit = Callable[[Graph], None]

UNUSED = re.compile(r"Found unused parameters:\s*- \$(\w+)=")
"""In Mitsuba's message on a value for which a file has no placeholder: its name."""


DEFAULT = re.compile(r"<default\s[^<>]*name=[\"'](\w+)")
UNDEFINED = "undefined parameter"
NOT_XML = "Parsing of XML file"
"""Words of Mitsuba's messages, and a placeholder's own value in a file."""


def text_of(path: Path) -> str:
    """Return the text of a scene file, without its includes."""
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: {error}. Give a file in UTF-8 that can be read.") from error


def placeholders(path: Path) -> set[str]:
    """Return the names of the placeholders ``$name`` in a scene file, and what a script takes."""
    if path.suffix not in (".xml", ".py") or not path.is_file():
        return set()
    text = text_of(path)
    if path.suffix == ".py":
        with suppress(SyntaxError):  # running it names the line
            made = [one for one in ast.parse(text).body if isinstance(one, ast.FunctionDef)]
            lists = [one.args for one in made if one.name == SCRIPT]
            return {arg.arg for args in lists for arg in (*args.args, *args.kwonlyargs)}
        return set()
    return set(re.findall(r"\$(\w+)", text))


@dataclass(frozen=True)
class Script:
    """A function that runs a Python file and returns its scene, a dictionary.

    It passes ``values`` to the file's function as keyword arguments: numbers where the default is a
    number, else text.
    """

    path: Path
    values: Mapping[str, str] = field(default_factory=dict)

    def __call__(self) -> Any:
        """Run the file; ``InputError`` if it raises, has no scene, or takes other values."""
        from fotismos.heuristic.user_code import contained  # loaded late: few scenes are scripts

        try:
            with contained(self.path):
                scene = runpy.run_path(str(self.path)).get(SCRIPT)
                arguments = self._arguments(scene)
                content = scene(**arguments) if callable(scene) else scene
        except InputError:
            raise
        except (Exception, SystemExit) as error:  # a user's code may raise anything
            raise InputError(f"{self.path}: {type(error).__name__}: {error}") from error
        if not isinstance(content, Mapping):
            raise InputError(
                f"{self.path}: `{SCRIPT}` is {type(content).__name__}. It must be a dictionary for"
                " mitsuba.load_dict, or a function that returns one."
            )
        return content

    def _arguments(self, scene: Any) -> dict[str, Any]:
        """Return the values for the function; InputError if it takes others, or needs more."""
        known = dict(signature(scene).parameters) if callable(scene) else {}
        defaults = {name: one.default for name, one in known.items()}
        typed = {
            name: self._number(name, text, defaults[name])
            if type(defaults.get(name)) in (int, float)
            else text
            for name, text in self.values.items()
        }
        if any(one.kind is Argument.VAR_KEYWORD for one in known.values()):
            return typed
        takes = ", ".join(known) or "none"
        for name in self.values:
            if name not in known:
                raise InputError(
                    f"-D {name}: `{SCRIPT}` of {self.path} does not take it"
                    f"{suggestion(name, known)}; it takes {takes}. Correct the name, or omit it."
                )
        needed = [name for name, one in known.items() if one.default is Argument.empty]
        if missing := ", ".join(name for name in needed if name not in self.values):
            raise InputError(
                f"`{SCRIPT}` of {self.path} needs {missing}. Give -D NAME=VALUE for each."
            )
        return typed

    def _number(self, name: str, text: str, default: float) -> float:
        """Return a value for an argument with a number as its default, whole as that is."""
        try:
            number = float(text)
        except ValueError as error:
            raise InputError(
                f"-D {name}={text}: `{SCRIPT}` of {self.path} takes a number, such as {default!r}."
            ) from error
        return int(number) if isinstance(default, int) and number.is_integer() else number


@dataclass(eq=False)
class Source:
    """The source of a scene: a name, and an XML file or a dictionary.

    ``content`` is the path of a Mitsuba XML file, a dictionary for ``mitsuba.load_dict``, or a
    function that returns one, ``parameters`` are values for the ``$name`` placeholders of a file,
    and ``edits`` change the graph. ``graphs`` by variant, the dictionary ``made`` by the function,
    and Mitsuba's ``messages`` are shared by all that are edited from one.
    """

    name: str
    content: Content
    parameters: Mapping[str, str] = field(default_factory=dict)
    edits: tuple[Edit, ...] = ()
    messages: list[str] = field(default_factory=list, repr=False)
    graphs: dict[str, Graph] = field(default_factory=dict, repr=False)
    made: list[Mapping[str, Any]] = field(default_factory=list, repr=False)

    def edited(self, edit: Edit) -> "Source":
        """Return the same scene with one more edit of its graph; it is not read again."""
        return replace(self, edits=(*self.edits, edit))

    def parse(self) -> Graph:
        """Return the scene's graph for the current variant, to be edited freely.

        A file is parsed once per variant; a function is called once. InputError has Mitsuba's own
        message, which names file, line and column.
        """
        variant = mi.variant()
        if variant not in self.graphs:
            with collect_messages(self.messages):
                self.graphs[variant] = self._parsed(variant)
        graph = self.graphs[variant].copy()
        for edit in self.edits:
            edit(graph)
        return graph

    def files(self) -> tuple[Path, ...]:
        """Return the files that the scene reads: its own, its includes, and those it names.

        The tables of a ``<spectrum filename=...>`` are in the graph as soon as it is parsed.
        """
        graph = self.parse()
        paths = {self.content.path.resolve()} if isinstance(self.content, Script) else set()
        if isinstance(self.content, (str, PathLike)):
            paths |= {Path(str(file)).resolve() for file in graph.state.files}
        for index in graph.nodes_in_use():
            for _, value in graph.props(index).items():
                path = find_file(graph.resolver, value) if isinstance(value, str) else None
                if path is not None and path.is_file():
                    paths.add(path.resolve())
        return tuple(sorted(paths))

    def _parsed(self, variant: str) -> Graph:
        config = Parser.ParserConfig(variant)
        content = self.content
        resolver = None
        files: set[Path] = set()  # the scene's, with its includes
        if callable(content):
            self.made[:] = self.made or [content()]
            content = self.made[0]
        try:
            if isinstance(content, Mapping):
                state = Parser.parse_dict(config, dict(content))
            else:
                path = Path(content)
                resolver = mi.FileResolver(mi.file_resolver())
                resolver.prepend(str(path.resolve().parent))  # first, as for Mitsuba's command
                _require_regular(path, resolver, parameters=self.parameters, seen=files)
                with resolving(resolver):
                    state = Parser.parse_file(config, str(path), **self.parameters)
                _require_text(self.name, state)
            Parser.transform_upgrade(config, state)
            Parser.transform_resolve_references(config, state)
        except (RuntimeError, ValueError) as error:
            if unused := UNUSED.search(str(error)):
                known = set().union(*map(placeholders, files))
                raise InputError(
                    f"-D {unused[1]}: {self.name} has no such placeholder"
                    f"{suggestion(unused[1], known)}; it has {', '.join(sorted(known)) or 'none'}."
                    " Correct the name, or omit it."
                ) from error
            if UNDEFINED in str(error):
                raise self._without_values(files) from error
            if NOT_XML in str(error) and (cut := _cut_off(files)):
                raise InputError(
                    f"{self.name}: {cut} ends before its last element is closed. Save the scene"
                    " again, or write what is missing."
                ) from error
            raise InputError(f"{self.name}: {plain_message(error)}") from error
        if state.root.type != mi.ObjectType.Scene:
            raise InputError(f"{self.name}: its outermost element must be <scene>.")
        graph = Graph(self.name, config, state)
        graph.resolver = resolver
        _require_dictionaries(graph)
        return graph

    def _without_values(self, files: Iterable[Path]) -> InputError:
        """Return the error for placeholders that get a value nowhere."""
        texts = [text_of(path) for path in files]
        given = {*self.parameters, *(name for text in texts for name in DEFAULT.findall(text))}
        missing = sorted(set().union(*map(placeholders, files)) - given)
        shown = ", ".join(f"${name}" for name in missing)
        options = " ".join(f"-D {name}=VALUE" for name in missing)
        return InputError(f"{self.name}: {shown} without a value: give {options}.")


ENDS_EARLY = {
    errors.codes[errors.XML_ERROR_NO_ELEMENTS],
    errors.codes[errors.XML_ERROR_UNCLOSED_TOKEN],
    errors.codes[errors.XML_ERROR_UNCLOSED_CDATA_SECTION],
}
"""Codes of Expat where a text ends within an element, a tag, a comment or a section."""


def _cut_off(files: Iterable[Path]) -> Path | None:
    """Return the first file that ends before its outermost element does."""
    for path in files:
        try:
            ParserCreate().Parse(text_of(path), True)
        except ExpatError as error:
            if error.code in ENDS_EARLY:
                return path
    return None


def _require_dictionaries(graph: Graph) -> None:
    """Refuse objects whose parts pairing has to read, and all that another variant made."""
    whole = mi.Texture, mi.Volume, mi.PhaseFunction, mi.ReconstructionFilter
    usable = (*whole, mi.VolumeGrid, mi.Bitmap)
    for index in graph.nodes_in_use():
        for key, value in graph.props(index).items():
            if isinstance(value, mi.Object) and not isinstance(value, usable):
                raise InputError(
                    f"{graph.name}: {graph.label(index)}: {key} is an object that Mitsuba has"
                    f" already made ({type(value).__name__}). Give the dictionary that it was made"
                    " from."
                )


def _require_regular(
    path: Path, resolver: mi.FileResolver, parameters: Mapping[str, str], seen: set[Path]
) -> None:
    """Require that what a file and its includes name are regular files: a pipe waits for ever.

    The text must be UTF-8: Mitsuba takes any bytes, which later cannot be names.
    """
    seen.add(path)
    text = text_of(path)
    for key, value in parameters.items():
        text = text.replace(f"${key}", value)
    for name in set(re.findall(r"[\"']([^\"'\n]+)[\"']", text)):
        file = find_file(resolver, name)
        if file is None or file.is_dir() or file in seen:
            continue
        require_regular_file(str(path), name, file)
        if file.suffix == ".xml":
            _require_regular(file, resolver, parameters=parameters, seen=seen)


def _require_text(name: str, state: Any) -> None:
    """Require characters that Python can read: an XML file may hold half a one, ``&#xD800;``."""
    for node in state.nodes:
        try:
            _ = node.props.id(), node.props.plugin_name(), list(node.props.items())
        except UnicodeDecodeError as error:
            shown = error.object[:80].decode(errors="backslashreplace")
            raise InputError(
                f"{name}: '{shown}' is not text in UTF-8. Correct the id, name or value: a"
                " reference such as &#xD800; is no character."
            ) from error


class _Listener(mi.Appender):
    """Mitsuba's messages, one call each; progress is shown by commands themselves."""

    def __init__(self, hear: Callable[[str], Any]) -> None:
        super().__init__()
        self._hear = hear

    def append(self, level: mi.LogLevel, text: str) -> None:
        self._hear(text)

    def log_progress(self, *progress: Any) -> None:
        pass


class _Plain(mi.Formatter):
    """Only the words of a message, without time, thread and line of code."""

    def format(self, *parts: Any) -> str:
        return str(parts[-1])


def divert_messages(hear: Callable[[str], Any]) -> None:
    """Send Mitsuba's messages from now on to ``hear``, one or more lines at a time."""
    logger = mi.logger()
    logger.clear_appenders()
    logger.set_formatter(_Plain())
    logger.add_appender(_Listener(hear))


@contextmanager
def collect_messages(into: list[str]) -> Iterator[None]:
    """Collect Mitsuba's messages while the block runs, and keep them from their former target."""
    logger = mi.logger()
    appenders = [logger.appender(number) for number in range(logger.appender_count())]
    formatter = logger.formatter()
    divert_messages(into.append)
    try:
        yield
    finally:
        logger.clear_appenders()
        logger.set_formatter(formatter)
        for appender in appenders:
            logger.add_appender(appender)


def count_messages(messages: Iterable[str]) -> tuple[str, ...]:
    """Return each message once, in order, with its count if it was repeated.

    Each line is a message here.
    """
    lines = Counter(" ".join(message.split()) for message in messages)
    return tuple(
        f"Mitsuba: {line}" + (f" ({count} times)" if count > 1 else "")
        for line, count in lines.items()
    )


def digest(source: Source) -> str:
    """Return a digest of a scene's graph in the current variant, and of every file it reads."""
    whole = hashlib.sha256()
    graph = source.parse()
    for index in graph.nodes_in_use():
        props = graph.props(index)
        whole.update(f"{index} {props.plugin_name()} {props.id()}\0".encode())
        for key, value in props.items():
            for part in _parts(value):
                whole.update(f"{key} {len(part)} ".encode() + part)
    for path in source.files():
        try:
            with path.open("rb") as file:
                whole.update(hashlib.file_digest(file, "sha256").digest())
        except OSError as error:
            raise InputError(
                f"{source.name}: {path}: {error.strerror or error}. The scene names this file:"
                " ensure that it can be read."
            ) from error
    return whole.hexdigest()


def _parts(value: Any) -> Iterator[bytes]:
    """Yield a property's value as bytes; printed, floats are rounded and arrays shortened."""
    if value is None or isinstance(value, (bool, int, float, str)):
        yield repr(value).encode("utf-8", "surrogateescape")
    elif isinstance(value, Reference):
        yield f"node {value.index()}".encode()
    elif hasattr(value, "wavelengths"):
        yield repr((list(value.wavelengths), list(value.values))).encode()
    elif hasattr(value, "matrix"):
        yield np.array(value.matrix).tobytes()
    elif hasattr(value, "__array__") or hasattr(value, "__array_interface__"):
        array = np.array(value)
        yield f"{array.dtype} {array.shape}".encode()
        yield array.tobytes()
    else:
        yield str(value).encode()
        if isinstance(value, mi.Object):
            for name, inner in mi.traverse(value).items():
                yield name.encode()
                yield from _parts(inner)
