"""Users' code: run without side effects on the process, with errors by file and line."""

import inspect
import os
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from heuristic.errors import suggestion
from heuristic.opened import is_users, noted

CALLED = {"PairedMaterial": "material", "LightAtPoint": "light"}
"""What a user's code calls the objects of these classes."""


@contextmanager
def contained(path: Path) -> Iterator[set[Path]]:
    """Let a file's code run in the block, with its folder first in the search path.

    Its changes to the process are undone: folder, umask, environment, arguments and path. Yields a
    set that holds, after the block, the files that it read (:func:`heuristic.opened.noted`).
    """
    with _put_back(), noted() as read:
        sys.path.insert(0, str(path.resolve().parent))
        yield read


def told(error: BaseException) -> str:
    """Return what went wrong, after the user's file and line if known."""
    place = _place(error)
    where = f"{place[0]}, line {place[1]}: " if place else ""
    message = error.msg if isinstance(error, SyntaxError) else str(_first(error))
    first = _first(error)
    if isinstance(first, AttributeError) and first.name:
        names = [each for each in dir(first.obj) if each[0] != "_"]
        known = CALLED.get(type(first.obj).__name__)
        if known:
            message = f"a {known} has no {first.name!r}, but {', '.join(names)}"
        message += suggestion(first.name, names)
    return f"{where}{type(first).__name__}: {message}".strip().rstrip(":.")


def defined(function: Callable[..., Any]) -> str:
    """Return a function's file and line; its name if they are not known."""
    code = getattr(inspect.unwrap(function), "__code__", None)
    if code is None:
        return getattr(function, "__qualname__", repr(function))
    return f"{_shown(code.co_filename)}, line {code.co_firstlineno}"


def _place(error: BaseException) -> tuple[str, int] | None:
    """Return the innermost line of a user's code that led to an error."""
    if isinstance(error, SyntaxError) and error.filename:
        return _shown(error.filename), error.lineno or 1
    frames = traceback.extract_tb(_first(error).__traceback__)
    if not any(map(_is_users, frames)):
        frames = traceback.extract_tb(error.__traceback__)
    for frame in reversed(frames):
        if _is_users(frame):
            return _shown(frame.filename), frame.lineno or 1
    return None


def _is_users(frame: traceback.FrameSummary) -> bool:
    is_file = not frame.filename.startswith("<")
    return is_file and is_users(Path(frame.filename))


def _first(error: BaseException) -> BaseException:
    """Return the first error of a chain: Dr.Jit raises its own from a user's."""
    while error.__cause__ is not None:
        error = error.__cause__
    return error


def _shown(file: str) -> str:
    """Return a file's path, relative to the current folder if it lies below."""
    path = Path(file)
    return str(path.relative_to(Path.cwd())) if path.is_relative_to(Path.cwd()) else file


@contextmanager
def _put_back() -> Iterator[None]:
    """Undo a script's changes to its process: folder, umask, environment, arguments and path.

    A process that it forks ends here instead of continuing alongside its parent.
    """
    pid, folder, environment = os.getpid(), os.getcwd(), dict(os.environ)
    arguments, path = list(sys.argv), list(sys.path)
    umask = os.umask(0o022)
    os.umask(umask)
    try:
        yield
    finally:
        if os.getpid() != pid:
            os._exit(0)
        os.chdir(folder)
        os.umask(umask)
        os.environ.clear()
        os.environ.update(environment)
        sys.argv[:], sys.path[:] = arguments, path
