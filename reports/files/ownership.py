"""Writing to folders that may hold other people's files: only what fotismos made is replaced.

Each folder that fotismos writes to lists what it made there (:mod:`reports.files.listing`).
Unlisted files, and folders without a list, are not touched.
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
    """Reject a file that fotismos did not make.

    Raises
    ------
    InputError
        Naming what is there.
    """
    _require(path, path.is_file() and path.name in made(path.parent))


def require_free_folder(path: Path) -> None:
    """Reject a folder that fotismos did not make, unless it is empty.

    Raises
    ------
    InputError
        Naming what is there.
    """
    is_own = path.name in made(path.parent) and (path / MARK).is_file()
    _require(path, is_own or _is_empty(path))


def _is_empty(path: Path) -> bool:
    return path.is_dir() and not any(path.iterdir())


def _require(path: Path, is_free: bool) -> None:
    if path.is_symlink() or (path.exists() and not is_free):
        kind = "folder" if path.is_dir() else "file"
        raise InputError(
            f"{atomic.printable(path)}: this {kind} was not made by fotismos. Move it away, or"
            " choose another output folder with -o."
        )


def folder(path: Path) -> Path:
    """Make a folder for single results, or use an existing one, whatever else it holds.

    Raises
    ------
    OutputError
        If it cannot be made or written to.
    """
    with atomic.explained(path):
        path.mkdir(exist_ok=True)
        if _is_empty(path):
            listing.confirm(path.parent, path.name)
        listing.confirm(path)
    return path


def clear(path: Path, names: Iterable[str]) -> None:
    """Delete the named files that fotismos made, and their folder if it is empty then."""
    if not path.is_dir():
        return
    with atomic.explained(path):
        ours = made(path) & set(names)
        for name in ours:
            (path / name).unlink(missing_ok=True)
        listing.withdraw(path, *ours)
        leave(path)


def leave(path: Path) -> None:
    """Delete a folder's list if fotismos made nothing there, and the folder if it is empty."""
    if not listing.read(path).is_empty():
        return
    (path / MARK).unlink(missing_ok=True)
    if path.name in made(path.parent) and _is_empty(path):
        path.rmdir()
        listing.withdraw(path.parent, path.name)


def leave_empty(folder: Path) -> None:
    """Apply :func:`leave` to the folders in a folder."""
    for inner in folder.iterdir():
        if (inner / MARK).is_file() and not inner.is_symlink():
            leave(inner)


def write(path: Path, content: str | bytes) -> None:
    """Write bytes, or text as UTF-8, in place of an earlier result.

    Raises
    ------
    InputError
        If the place holds something that fotismos did not make.
    OutputError
        If it cannot be written to.
    """
    with replacing(path) as partial:
        partial.write_bytes(atomic.encoded(content))


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a file to write to, which replaces an earlier result at the end.

    Raises
    ------
    InputError, OutputError
        See :func:`write`.
    """
    require_free(path)
    with _withdrawing(path), atomic.replacing(path) as partial:
        yield partial
        listing.announce(path.parent, path.name, listing.identity_of(partial))
    with atomic.explained(path):
        listing.confirm(path.parent, path.name)


@contextmanager
def replacing_folder(place: Path) -> Iterator[Path]:
    """Yield a new folder to fill, which replaces an earlier result at the end.

    The old folder steps aside and is deleted last: at every moment one of the two is complete.
    Other people's files in it are kept.

    Raises
    ------
    InputError
        If the place holds something that fotismos did not make, or a new file has the name of one
        that others put into an earlier result.
    OutputError
        If it cannot be written to; the earlier result stays in place.
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
            with suppress(OSError):  # the next run clears away what stays
                atomic.remove(new)
        listing.confirm(place.parent, place.name)
    with suppress(OSError):  # as above; a half deleted folder never has the name of a complete one
        if was_there:
            old.rename(new)
            atomic.remove(new)


def recover(folder: Path) -> None:
    """Clear away what dead processes left half written, and restore what they were replacing.

    Includes folders that fotismos made. No other process may be writing there.
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
            with suppress(OSError, OutputError):  # an inaccessible folder does not hinder this run
                recover(inner)


@contextmanager
def _withdrawing(path: Path) -> Iterator[None]:
    """Withdraw an announcement if the block fails and the file is not there."""
    try:
        yield
    except BaseException:
        if not os.path.lexists(path):
            with suppress(OSError):  # without it, its identity shows that the file never came
                listing.withdraw(path.parent, path.name)
        raise


def _put(new: Path, place: Path, old: Path) -> bool:
    """Replace an old folder with a new one, keeping other people's files.

    Returns whether there was an old one.
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
    """Copy other people's files from an old folder."""
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
