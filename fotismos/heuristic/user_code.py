"""Users' code: run without side effects on the process, with errors by file and line."""

import inspect
import os
import site
import sys
import sysconfig
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from fotismos.heuristic.errors import suggestion
from fotismos.heuristic.program import PACKAGE

CALLED = {"PairedMaterial": "material", "LightAtPoint": "light"}
"""What a user's code calls the objects of these classes."""


@contextmanager
def contained(path: Path) -> Iterator[set[Path]]:
    """Let a file's code run in the block, with its folder first in the search path.

    Its changes to the process are undone: folder, umask, environment, arguments, path, NumPy's
    handling of errors, and imported modules, since other code may mean another file by the same
    name. Yields a set that holds, after the block, the files of those modules. A process that the
    code forks ends here instead of continuing alongside its parent.
    """
    pid = os.getpid()
    folder = os.getcwd()
    environment = dict(os.environ)
    arguments = list(sys.argv)
    places = list(sys.path)
    modules = set(sys.modules)
    umask = os.umask(0o022)
    os.umask(umask)
    numpy_errors = np.geterr()
    files: set[Path] = set()
    try:
        sys.path.insert(0, os.path.dirname(os.path.realpath(path)))
        yield files
    finally:
        if os.getpid() != pid:
            os._exit(0)
        os.chdir(folder)
        os.umask(umask)
        np.seterr(**numpy_errors)
        os.environ.clear()
        os.environ.update(environment)
        sys.argv[:] = arguments
        sys.path[:] = places
        for name in set(sys.modules) - modules:
            module = sys.modules[name]
            file = getattr(module, "__file__", None)
            sources = [file] if isinstance(file, str) else list(getattr(module, "__path__", ()))
            if sources and all(is_users(Path(source)) for source in sources):
                files |= {Path(source).resolve() for source in sources if Path(source).is_file()}
                del sys.modules[name]


@contextmanager
def same_variant() -> Iterator[None]:
    """Let code run that may switch Mitsuba's variant, and switch it back after the block."""
    variant = mi.variant()
    try:
        yield
    finally:
        if variant is not None and mi.variant() != variant:
            mi.set_variant(variant)


def is_users(path: Path) -> bool:
    """Return whether a file is outside Python, installed packages and the project."""
    return not any(path.is_relative_to(folder) for folder in _left_out())


@cache
def _left_out() -> tuple[str, ...]:
    installed = sysconfig.get_paths()
    names = ("stdlib", "platstdlib", "purelib", "platlib")
    places = [*(installed[name] for name in names), *site.getsitepackages(), str(PACKAGE)]
    return (*places, *map(os.path.realpath, places), site.getusersitepackages())


def error_text(error: BaseException) -> str:
    """Return what went wrong, after the user's file and line if known."""
    message = error.msg if isinstance(error, SyntaxError) else str(first_error(error))
    first = first_error(error)
    if isinstance(first, AttributeError) and first.name:
        names = [name for name in dir(first.obj) if name[0] != "_"]
        if kind := CALLED.get(type(first.obj).__name__):
            message = f"a {kind} has no {first.name!r}, but {', '.join(names)}"
        message += suggestion(first.name, names)
    return f"{_place(error)}{type(first).__name__}: {message}".strip().rstrip(":.")


def place_of(function: Callable[..., Any]) -> str:
    """Return a function's file and line; its name if they are not known."""
    code = getattr(inspect.unwrap(function), "__code__", None)
    if code is None:
        return getattr(function, "__qualname__", repr(function))
    return f"{_shown(code.co_filename)}, line {code.co_firstlineno}"


def _place(error: BaseException) -> str:
    """Return the innermost line of a user's code that led to an error; empty if there is none."""
    if isinstance(error, SyntaxError) and error.filename:
        return f"{_shown(error.filename)}, line {error.lineno or 1}: "
    for raised in (first_error(error), error):
        for frame in reversed(traceback.extract_tb(raised.__traceback__)):
            if not frame.filename.startswith("<") and is_users(Path(frame.filename)):
                return f"{_shown(frame.filename)}, line {frame.lineno or 1}: "
    return ""


def first_error(error: BaseException) -> BaseException:
    """Return the first error of a chain: Dr.Jit raises its own from a user's."""
    while error.__cause__ is not None:
        error = error.__cause__
    return error


def _shown(file: str) -> str:
    """Return a file's path, relative to the current folder if it lies below."""
    path = Path(file)
    return str(path.relative_to(Path.cwd())) if path.is_relative_to(Path.cwd()) else file
