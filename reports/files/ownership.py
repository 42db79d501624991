"""Writing to folders that may hold other people's files: only what fotismos made is replaced.

A folder that fotismos writes to holds a file `MARK`, which lists what was made there, one name per
line. What is not in the list is not touched, and neither is a folder without such a file in it.
"""

import os
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from comparisons import atomic
from heuristic.errors import InputError

MARK = ".fotismos"


def made(folder: Path) -> set[str]:
    """Return the names of what fotismos made in a folder."""
    try:
        return set((folder / MARK).read_text(encoding="utf-8").splitlines())
    except (OSError, UnicodeDecodeError):
        return set()


def require_free(path: Path) -> None:
    """Refuse a file that fotismos did not make.

    Raises
    ------
    InputError
        Naming it, or what is there in its place.
    """
    _require(path, path.is_file() and path.name in made(path.parent))


def require_free_folder(path: Path) -> None:
    """Refuse a folder that fotismos did not make, unless it is empty.

    Raises
    ------
    InputError
        Naming it, or what is there in its place.
    """
    is_own = path.name in made(path.parent) and (path / MARK).is_file()
    _require(path, is_own or _is_empty(path))


def _is_empty(path: Path) -> bool:
    return path.is_dir() and not any(path.iterdir())


def _require(path: Path, is_free: bool) -> None:
    if path.is_symlink() or (path.exists() and not is_free):
        kind = "folder" if path.is_dir() else "file"
        raise InputError(
            f"{path}: this {kind} was not made by fotismos, and is left as it is. Choose another"
            " output folder with -o, or move it away."
        )


def claim(folder: Path, *names: str) -> None:
    """Add to the list of what fotismos made in a folder."""
    listed = made(folder)
    new = [name for name in names if name not in listed]
    if new or not (folder / MARK).exists():
        with (folder / MARK).open("a", encoding="utf-8") as file:
            file.write("".join(f"{name}\n" for name in new))


def release(folder: Path, *names: str) -> None:
    """Take names off the list of what fotismos made in a folder."""
    left = made(folder) - set(names)
    if left:
        atomic.write(folder / MARK, "".join(f"{name}\n" for name in sorted(left)))
    else:
        (folder / MARK).unlink(missing_ok=True)


def folder(path: Path) -> Path:
    """Make a folder for single results, or use one that is there, whatever else is in it."""
    if not path.exists():
        path.mkdir()
        claim(path.parent, path.name)
    claim(path)
    return path


def clear(path: Path, names: Iterable[str]) -> None:
    """Delete those of some files that fotismos made, and their folder once it is empty."""
    ours = made(path) & set(names)
    for name in ours:
        (path / name).unlink(missing_ok=True)
    release(path, *ours)
    if _is_empty(path):
        path.rmdir()
        release(path.parent, path.name)


def write(path: Path, content: str | bytes) -> None:
    """Write bytes, or text as UTF-8, in place of an earlier result.

    Raises
    ------
    InputError
        Where the place holds something that fotismos did not make.
    """
    require_free(path)
    claim(path.parent, path.name)
    atomic.write(path, content)


@contextmanager
def replacing_folder(place: Path, keep: str | None = None) -> Iterator[Path]:
    """Give a new folder to fill, and put it in the place of an earlier result at the end.

    The old folder steps aside and is deleted last: at every moment one of the two is whole. What
    others put into it is kept, and so are results whose names match the pattern ``keep``.

    Raises
    ------
    InputError
        Where the place holds something that fotismos did not make, or would have to replace
        something that others put into an earlier result.
    """
    require_free_folder(place)
    new, old = atomic.beside(place), atomic.beside(place, "old")
    atomic.remove(new)
    new.mkdir()
    try:
        yield new
        claim(new, *sorted(path.name for path in new.iterdir()))
        claim(place.parent, place.name)
        if place.exists():
            _keep(place, new, keep)
            place.rename(old)
        new.rename(place)
    finally:
        atomic.remove(new)
    atomic.remove(old)


def recover(folder: Path) -> None:
    """Clear away what dead processes left half written, and restore what they were replacing."""
    for partial, _ in atomic.abandoned(folder):
        atomic.remove(partial)
    for old, place in atomic.abandoned(folder, "old"):
        if not (old / MARK).is_file():
            continue
        if place.exists():
            atomic.remove(old)
        else:
            old.rename(place)


def _keep(place: Path, new: Path, pattern: str | None) -> None:
    """Copy from an old folder what is not fotismos's, and its results that match a pattern."""
    ours = made(place) | {MARK}
    for path in place.iterdir():
        is_result = path.name in ours or atomic.LEFT.fullmatch(path.name)
        is_replaced = os.path.lexists(new / path.name)
        if is_replaced:
            _require(path, is_free=bool(is_result))
        if is_replaced or (is_result and not (pattern and path.match(pattern))):
            continue
        if path.is_dir() and not path.is_symlink():
            shutil.copytree(path, new / path.name, symlinks=True)
        else:
            shutil.copy2(path, new / path.name, follow_symlinks=False)
        if is_result:
            claim(new, path.name)
