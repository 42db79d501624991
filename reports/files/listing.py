"""The list of what fotismos made in a folder, ``.fotismos``, in that folder.

A line is a name; later lines override earlier ones. A line that begins with ``{`` is JSON:
``{"gone": NAME}`` removes a name, ``{"coming": NAME, "as": ID}`` announces a file that is about
to get its name, and ``{"place": NAME, "of": SCENE}`` assigns a folder to a scene. Running commands
only add lines, so processes that share a folder lose nothing.
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
    """The list of a folder.

    Attributes
    ----------
    made
        Names of what fotismos made.
    coming
        Names announced but not confirmed, with the file's identity.
    places
        Names of folders, with their scenes.
    """

    made: set[str] = field(default_factory=set)
    coming: dict[str, str] = field(default_factory=dict)
    places: dict[str, str] = field(default_factory=dict)

    def is_empty(self) -> bool:
        """Return whether fotismos made nothing and announced nothing."""
        return not self.made and not self.coming


def read(folder: Path) -> Listed:
    """Return the list of a folder, empty if there is none."""
    found = Listed()
    for line in _lines(folder / MARK):
        _apply(line, found)
    return found


def confirm(folder: Path, *names: str) -> None:
    """Add names of what fotismos made, creating the list if needed."""
    made = read(folder).made
    _append(folder, [_name_line(name) for name in names if name not in made])


def announce(folder: Path, name: str, identity: str) -> None:
    """Announce that a file is about to get a name, unless the name is listed."""
    if name not in read(folder).made:
        _append(folder, [json.dumps({"coming": name, "as": identity})])


def withdraw(folder: Path, *names: str) -> None:
    """Remove names from the list."""
    listed = read(folder)
    known = listed.made | listed.coming.keys()
    if gone := [json.dumps({"gone": name}) for name in names if name in known]:
        _append(folder, gone)


def assign(folder: Path, places: dict[str, str]) -> None:
    """Assign folders to scenes."""
    known = read(folder).places
    new = {place: scene for place, scene in places.items() if known.get(place) != scene}
    if new:
        _append(folder, [json.dumps({"place": p, "of": scene}) for p, scene in new.items()])


def tidy(folder: Path) -> None:
    """Settle announcements, drop missing files, and rewrite the list if it changed.

    No other process may be writing to the folder.
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
    """Return what identifies a file among those that may get its name; empty if there is none.

    A folder is identified by its list.
    """
    try:
        stat = path.lstat()
    except OSError:
        return ""
    if path.is_dir() and not path.is_symlink():
        return "folder" if (path / MARK).is_file() else ""
    return f"{stat.st_ino}-{stat.st_mtime_ns}"


def _lines(path: Path) -> list[str]:
    """Return the complete lines of a list; a full disk may have cut the last one short."""
    if not path.is_file():  # reading a pipe would block
        return []
    if path.stat().st_size > LARGEST:
        raise OutputError(
            f"{atomic.printable(path)}: fotismos did not make this list, which exceeds {LARGEST}"
            " bytes. Move it away, or choose another output folder with -o."
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
        # fotismos never writes names that lead out of the folder.
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
    """Return the line of a name: itself, or JSON if a line cannot hold it."""
    return name if name.isprintable() and name[:1] not in ("{", '"') else json.dumps(name)


def _append(folder: Path, lines: list[str]) -> None:
    """Add all lines or none."""
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
