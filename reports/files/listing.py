"""The list of what fotismos made in a folder, ``.fotismos``, in that folder.

A line is a name; later lines go before earlier ones. A line that begins with ``{`` is JSON:
``{"gone": NAME}`` takes a name off, ``{"coming": NAME, "as": ID}`` announces a file that is about
to get its name, and ``{"place": NAME, "of": SCENE}`` says what a folder is for. While
commands run lines are only added, so that processes which write to one folder lose nothing of each
other's.
"""

import errno
import json
import os
from dataclasses import dataclass, field
from pathlib import Path

from comparisons import atomic
from heuristic.errors import OutputError

MARK = ".fotismos"

LARGEST = 2**28
"""Bytes of a list: millions of names."""


@dataclass(frozen=True)
class Listed:
    """What the list of a folder says.

    Attributes
    ----------
    made
        Names of what fotismos made.
    coming
        Names that were announced and not confirmed, with the identity of the file.
    places
        Names of folders, with the scenes that they are for.
    """

    made: set[str] = field(default_factory=set)
    coming: dict[str, str] = field(default_factory=dict)
    places: dict[str, str] = field(default_factory=dict)

    def is_empty(self) -> bool:
        """Tell whether fotismos neither made anything nor was about to."""
        return not self.made and not self.coming


def read(folder: Path) -> Listed:
    """Return what the list of a folder says; nothing where there is none."""
    found = Listed()
    for line in _lines(folder / MARK):
        _apply(line, found)
    return found


def confirm(folder: Path, *names: str) -> None:
    """Add names of what fotismos made; the folder has a list from then on."""
    made = read(folder).made
    _append(folder, [_name_line(name) for name in names if name not in made])


def announce(folder: Path, name: str, identity: str) -> None:
    """Say that a file with this identity is about to get a name, if the name is not listed."""
    if name not in read(folder).made:
        _append(folder, [json.dumps({"coming": name, "as": identity})])


def withdraw(folder: Path, *names: str) -> None:
    """Take names off the list."""
    listed = read(folder)
    known = listed.made | listed.coming.keys()
    if gone := [json.dumps({"gone": name}) for name in names if name in known]:
        _append(folder, gone)


def assign(folder: Path, places: dict[str, str]) -> None:
    """Say which scenes folders are for."""
    known = read(folder).places
    new = {place: scene for place, scene in places.items() if known.get(place) != scene}
    if new:
        _append(folder, [json.dumps({"place": p, "of": scene}) for p, scene in new.items()])


def tidy(folder: Path) -> None:
    """Settle what was announced, drop what is not there, and write the list anew if it changed.

    For the only process that writes to the folder.
    """
    if not (folder / MARK).is_file():
        return
    listed = read(folder)
    coming = listed.coming.items()
    came = {name for name, identity in coming if identity_of(folder / name) == identity}
    made = {name for name in listed.made | came if os.path.lexists(folder / name)}
    places = {place: scene for place, scene in listed.places.items() if place in made}
    lines = [_name_line(name) for name in sorted(made)]
    lines += [json.dumps({"place": p, "of": scene}) for p, scene in sorted(places.items())]
    if lines != _lines(folder / MARK):
        atomic.write(folder / MARK, "".join(f"{line}\n" for line in lines))


def identity_of(path: Path) -> str:
    """Return what tells a file from others that may get its name; empty where there is none.

    A folder is known by the list in it.
    """
    try:
        stat = path.lstat()
    except OSError:
        return ""
    if path.is_dir() and not path.is_symlink():
        return "folder" if (path / MARK).is_file() else ""
    return f"{stat.st_ino}-{stat.st_mtime_ns}"


def _lines(path: Path) -> list[str]:
    """Return the whole lines of a list; one that a full disk cut short has no end."""
    if not path.is_file():  # a pipe would be waited for
        return []
    if path.stat().st_size > LARGEST:
        raise OutputError(
            f"{atomic.printable(path)}: the list of what fotismos made has more than {LARGEST}"
            " bytes, which it never has. Move it away, or choose another output folder with -o."
        )
    try:
        return path.read_text(encoding="utf-8", errors="replace").split("\n")[:-1]
    except OSError:
        return []


def _apply(line: str, found: Listed) -> None:
    try:
        said = json.loads(line) if line[:1] in ("{", '"') else line
    except ValueError:
        return
    match said:
        # What would lead out of the folder, fotismos never wrote.
        case {"gone": str(name)} | {"coming": str(name)} | {"place": str(name)} | str(name) if (
            not _is_name(name)
        ):
            return
        case {"gone": str(name)}:
            found.made.discard(name)
            found.coming.pop(name, None)
        case {"coming": str(name), "as": str(identity)}:
            found.coming[name] = identity
        case {"place": str(name), "of": str(scene)}:
            found.places[name] = scene
        case str(name):
            found.coming.pop(name, None)
            found.made.add(name)


def _is_name(name: str) -> bool:
    return name not in ("", ".", "..") and "/" not in name and "\0" not in name


def _name_line(name: str) -> str:
    """Return the line of a name: itself, or as JSON where a line could not hold it."""
    return name if name.isprintable() and name[:1] not in ("{", '"') else json.dumps(name)


def _append(folder: Path, lines: list[str]) -> None:
    """Add whole lines, or none."""
    content = "".join(f"{line}\n" for line in lines).encode()
    flags = os.O_RDWR | os.O_APPEND | os.O_CREAT | os.O_NOFOLLOW
    descriptor = os.open(folder / MARK, flags, 0o666)
    try:
        size = os.fstat(descriptor).st_size
        if size and os.pread(descriptor, 1, size - 1) != b"\n":
            size = os.pread(descriptor, size, 0).rfind(b"\n") + 1
            os.ftruncate(descriptor, size)
        if os.write(descriptor, content) < len(content):
            os.ftruncate(descriptor, size)
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    finally:
        os.close(descriptor)
