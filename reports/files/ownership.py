"""Writing to folders that may hold other people's files: only what fotismos made is replaced.

A folder that fotismos writes to holds a list of what was made there (:mod:`reports.files.listing`).
What is not in the list is not touched, and neither is a folder without such a list in it.
"""

import os
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from comparisons import atomic
from heuristic.errors import InputError, OutputError
from reports.files import listing
from reports.files.listing import MARK


def made(folder: Path) -> set[str]:
    """Return the names of what fotismos made in a folder."""
    return listing.read(folder).made


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
            f"{atomic.printable(path)}: this {kind} was not made by fotismos, and is left as it is."
            " Choose another output folder with -o, or move it away."
        )


def folder(path: Path) -> Path:
    """Make a folder for single results, or use one that is there, whatever else is in it.

    Raises
    ------
    OutputError
        Where it cannot be made or written to.
    """
    with atomic.explained(path):
        path.mkdir(exist_ok=True)
        if _is_empty(path):
            listing.confirm(path.parent, path.name)
        listing.confirm(path)
    return path


def clear(path: Path, names: Iterable[str]) -> None:
    """Delete those of some files that fotismos made, and their folder once it is empty."""
    if not path.is_dir():
        return
    with atomic.explained(path):
        ours = made(path) & set(names)
        for name in ours:
            (path / name).unlink(missing_ok=True)
        listing.withdraw(path, *ours)
        leave(path)


def leave(path: Path) -> None:
    """Delete the list of a folder in which fotismos made nothing, and the folder if it is empty."""
    if not listing.read(path).is_empty():
        return
    (path / MARK).unlink(missing_ok=True)
    if path.name in made(path.parent) and _is_empty(path):
        path.rmdir()
        listing.withdraw(path.parent, path.name)


def leave_empty(folder: Path) -> None:
    """Delete the lists in the folders of a folder in which nothing was made, and empty folders."""
    for inner in folder.iterdir():
        if (inner / MARK).is_file() and not inner.is_symlink():
            leave(inner)


def write(path: Path, content: str | bytes) -> None:
    """Write bytes, or text as UTF-8, in place of an earlier result.

    Raises
    ------
    InputError
        Where the place holds something that fotismos did not make.
    OutputError
        Where it cannot be written to.
    """
    with replacing(path) as partial:
        partial.write_bytes(atomic.encoded(content))


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a file to write to, and put it in the place of an earlier result at the end.

    Raises
    ------
    InputError, OutputError
        As for :func:`write`.
    """
    require_free(path)
    with _withdrawing(path), atomic.replacing(path) as partial:
        yield partial
        listing.announce(path.parent, path.name, listing.identity_of(partial))
    with atomic.explained(path):
        listing.confirm(path.parent, path.name)


@contextmanager
def replacing_folder(place: Path) -> Iterator[Path]:
    """Give a new folder to fill, and put it in the place of an earlier result at the end.

    The old folder steps aside and is deleted last: at every moment one of the two is whole. What
    others put into it is kept.

    Raises
    ------
    InputError
        Where the place holds something that fotismos did not make, or would have to replace
        something that others put into an earlier result.
    OutputError
        Where it cannot be written to; the earlier result is in its place then.
    """
    require_free_folder(place)
    new, old = atomic.beside(place), atomic.beside(place, "old")
    with atomic.explained(place), _withdrawing(place):
        try:
            atomic.remove(new)
            new.mkdir()
            yield new
            listing.confirm(new, *sorted(path.name for path in new.iterdir()))
            was_there = _put(new, place, old)
        finally:
            with suppress(OSError):  # what stays is cleared away by the next run
                atomic.remove(new)
        listing.confirm(place.parent, place.name)
    with suppress(OSError):  # as above; what is half deleted has not the name of what is whole
        if was_there:
            old.rename(new)
            atomic.remove(new)


def recover(folder: Path) -> None:
    """Clear away what dead processes left half written, and restore what they were replacing.

    In the folders that fotismos made as well. For the only process that writes there.
    """
    for partial, _ in atomic.abandoned(folder):
        atomic.remove(partial)
    for old, place in atomic.abandoned(folder, "old"):
        if not (old / MARK).is_file():
            continue
        if not place.exists():
            old.rename(place)
        elif (place / MARK).is_file():
            atomic.remove(old)
    listing.tidy(folder)
    for name in made(folder):
        inner = folder / name
        if (inner / MARK).is_file() and not inner.is_symlink():
            with suppress(OSError, OutputError):  # without rights it is not in this run's way
                recover(inner)


@contextmanager
def _withdrawing(path: Path) -> Iterator[None]:
    """Take what was announced off the list if the block fails and it is not there."""
    try:
        yield
    except BaseException:
        if not os.path.lexists(path):
            with suppress(OSError):  # without it, the identity tells what comes from what came
                listing.withdraw(path.parent, path.name)
        raise


def _put(new: Path, place: Path, old: Path) -> bool:
    """Put a new folder in the place of an old one, with what others put into that.

    Returns whether there was one.
    """
    listing.announce(place.parent, place.name, listing.identity_of(new))
    if not place.exists():
        new.rename(place)
        return False
    _keep(place, new)
    place.rename(old)
    try:
        new.rename(place)
    except BaseException:
        if not place.exists():
            old.rename(place)
        raise
    return True


def _keep(place: Path, new: Path) -> None:
    """Copy from an old folder what is not fotismos's."""
    ours = made(place) | {MARK}
    for path in place.iterdir():
        is_result = path.name in ours or atomic.LEFT.fullmatch(path.name)
        if os.path.lexists(new / path.name):
            _require(path, is_free=bool(is_result))
        elif is_result:
            continue
        elif path.is_dir() and not path.is_symlink():
            shutil.copytree(path, new / path.name, symlinks=True)
        else:
            shutil.copy2(path, new / path.name, follow_symlinks=False)
