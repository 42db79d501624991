"""Heuristics in users' files, which a command names as ``FILE.py`` or ``FILE.py:function``.

A heuristic there is a function of a :class:`heuristic.points.Point`, called ``shade`` unless the
command names another, or a :class:`heuristic.heuristics.Heuristic`. Every process finds the same
heuristic by the same words, and reads a changed file again.
"""

import runpy
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import mitsuba as mi

from heuristic.errors import InputError, suggestion
from heuristic.functions import heuristic_of
from heuristic.heuristics import Heuristic, in_file
from heuristic.user_code import contained, told

FUNCTION = "shade"
"""Name of the function, if omitted."""

MODULE = "_shading_of_a_user"
"""Module of a file's functions: a name that does not hide another."""

_opened: dict[tuple[str, Path, str | None], tuple[Heuristic, frozenset[Path]]] = {}


def opened(word: str) -> Heuristic:
    """Return the heuristic that a word names, for the current variant of Mitsuba.

    Raises
    ------
    InputError
        If there is no such file or function, or its code fails; the message names the line.
    """
    file, function = in_file(word) or (word, "")
    path, function = Path(file), function or FUNCTION
    key = word, path.resolve(), mi.variant()
    if key in _opened:
        known, files = _opened[key]
        if known.code == _digest(files):
            return known
    _opened[key] = _read(word, path, function)
    return _opened[key][0]


def _read(word: str, path: Path, function: str) -> tuple[Heuristic, frozenset[Path]]:
    if not path.is_file():
        raise InputError(
            f"{path}: there is no such file. Give a Python file with a function `{FUNCTION}(point)`"
            " that returns a colour, as FILE.py, or FILE.py:FUNCTION for another name."
        )
    with contained(path) as read:
        given = _named(_run(path), function, path)
        found = heuristic_of(given, word, _label(path, function))
    files = frozenset(read | {path.resolve()})
    return replace(found, code=_digest(files)), files


def _run(path: Path) -> dict[str, Any]:
    """Return what a file defines, by name."""
    try:
        return runpy.run_path(str(path.resolve()), run_name=MODULE)
    except (Exception, SystemExit) as error:  # a user's code may raise anything
        raise InputError(
            f"{told(error)}. Correct {path}, which is to define a heuristic."
        ) from error


def _named(names: dict[str, Any], function: str, path: Path) -> Any:
    """Return the object of a name in a file."""
    if function in names:
        return names[function]
    own = [
        name
        for name, value in names.items()
        if getattr(value, "__module__", None) == MODULE and callable(value)
    ]
    has = f"It has {', '.join(own)}: give {path}:{own[0]}." if own else "It has none."
    raise InputError(
        f"{path}: there is no function `{function}`{suggestion(function, own)}. {has}"
        f" A heuristic is a function `{FUNCTION}(point)` that returns a colour."
    )


def _label(path: Path, function: str) -> str:
    return path.stem if function == FUNCTION else function


def _digest(files: frozenset[Path]) -> str:
    """Return a digest of the content of files; a missing file counts, too."""
    found = sha256()
    for file in sorted(files):
        content = file.read_bytes() if file.is_file() else b"gone"
        found.update(f"{len(content)} ".encode() + content)
    return found.hexdigest()
