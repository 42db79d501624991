"""The files that Python code reads while it runs, by opening them or importing modules."""

import os
import site
import sys
import sysconfig
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib.util import source_from_cache
from pathlib import Path, PurePath

OWN = ("heuristic", "reference", "comparisons", "reports")
"""Packages of the project, identified by their version instead."""

VOLATILE = ("/proc", "/sys", "/dev")

_open: list[set[str]] = []
"""Files noted for the code that is running; empty if none is."""


@contextmanager
def noted() -> Iterator[set[Path]]:
    """Yield a set that holds, after the block, the files that its code read.

    These are files opened for reading through Python and not deleted since, and files of imported
    modules. The standard library, installed packages and the project itself are left out. Imported
    modules are forgotten again: other code may mean another file by the same name. Reads in native
    code, in other processes, after the block (as a Python plugin may, once it renders), and of the
    environment and the clock are not noted.
    """
    _listen()
    paths: set[str] = set()
    files: set[Path] = set()
    before = set(sys.modules)
    _open.append(paths)
    try:
        yield files
    finally:
        _open.remove(paths)
        for name in set(sys.modules) - before:
            places = _places(sys.modules[name])
            if places and all(is_users(Path(place)) for place in places):
                paths |= places
                del sys.modules[name]
        sources = {Path(_source(path)) for path in paths}
        files |= {path.resolve() for path in sources if is_users(path) and path.is_file()}


@cache
def _listen() -> None:
    """Note files opened from now on; Python keeps such a hook until it exits."""
    sys.addaudithook(_note)


def _note(event: str, arguments: tuple) -> None:
    if event != "open" or not _open:
        return
    path, _, flags = arguments
    if not isinstance(path, (str, bytes, PurePath)) or not isinstance(flags, int):
        return
    is_read = flags & (os.O_WRONLY | os.O_TRUNC) == 0
    if is_read:
        try:
            place = os.path.abspath(os.fsdecode(path))  # now: the code may change the folder
        except OSError:  # the current folder is gone
            return
        for paths in _open:
            paths.add(place)


def _places(module: object) -> set[str]:
    """Return the file of a module, or the folders of a package that has none."""
    file = getattr(module, "__file__", None)
    places = [file] if isinstance(file, str) else getattr(module, "__path__", ())
    return {str(place) for place in places}


def _source(path: str) -> str:
    """Return the source of compiled code if it exists, and otherwise the file itself."""
    try:
        source = source_from_cache(path)
    except ValueError:
        return path
    return source if os.path.exists(source) else path


def is_users(path: Path) -> bool:
    """Return whether a file is outside Python, installed packages and the project."""
    return not any(path.is_relative_to(folder) for folder in _left_out())


@cache
def _left_out() -> tuple[str, ...]:
    installed = sysconfig.get_paths()
    names = ("stdlib", "platstdlib", "purelib", "platlib")
    root = Path(__file__).parents[1]
    own = [str(root / name) for name in OWN]
    places = [installed[name] for name in names] + site.getsitepackages() + own
    return (*places, *map(os.path.realpath, places), site.getusersitepackages(), *VOLATILE)
