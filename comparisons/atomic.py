"""Replacing files as a whole: what is there is either the old file or the complete new one.

What is half written has a name that says whose it is, ``.NAME.HOST.PID-START.fotismos-partial``:
only what a process of this machine left that is no longer alive is ever cleared away. START tells
the process from a later one of its number.
"""

import errno
import os
import platform
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from heuristic.errors import OutputError

HOST = re.sub(r"[^A-Za-z0-9-]", "-", platform.node()) or "unknown"

LEFT = re.compile(
    r"\.(?P<name>.+)\.(?P<host>[A-Za-z0-9-]+)\.(?P<pid>\d+)(?:-(?P<start>\d+))?"
    r"\.fotismos-(?P<kind>\w+)",
    re.DOTALL,
)

LONGEST = 255
"""Bytes of a name, which file systems have in common."""

ADVICE = {
    errno.ENOSPC: "Free some space",
    errno.EDQUOT: "Free some space",
    errno.EFBIG: "Raise the limit on the size of files (ulimit -f)",
    errno.EACCES: "Ensure that it can be written to",
    errno.EPERM: "Ensure that it can be written to",
    errno.EROFS: "Ensure that it can be written to",
    errno.ENAMETOOLONG: "Give it a shorter name",
    errno.ENOENT: "Make its folder",
}
"""What to do about an error of the system; the alternative is always another place."""


@contextmanager
def explained(path: Path) -> Iterator[None]:
    """Turn the system's errors of a block that writes into ones for people.

    Raises
    ------
    OutputError
        Naming the path, the reason, and what to do.
    """
    try:
        yield
    except OSError as error:
        raise refusal(path, error) from error


def refusal(path: Path, error: OSError) -> OutputError:
    """Return the error that says why a place cannot be written to."""
    reason = os.strerror(error.errno) if error.errno else str(error)
    advice = ADVICE.get(error.errno or 0, "Move away what is in the way")
    return OutputError(
        f"{printable(path)}: {reason}. {advice}, or choose another place (-o); results that were"
        " finished are kept."
    )


def printable(path: str | Path) -> str:
    """Return a path as it is, or with escapes where it holds what is no plain text."""
    text = str(path)
    return text if text.isprintable() else ascii(text)


def beside(path: Path, kind: str = "partial") -> Path:
    """Return where this process keeps something that is about to stand at ``path``, or stood."""
    pid = os.getpid()
    end = f".{HOST}.{'-'.join(filter(None, (str(pid), _start(pid))))}.fotismos-{kind}"
    room = LONGEST - 1 - len(end)
    name = path.name
    if len(os.fsencode(name)) > room:
        name = os.fsencode(name)[:room].decode(errors="ignore")
    return path.with_name(f".{name}{end}")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a file to write to, and put it in the place of ``path`` if the block succeeds.

    Raises
    ------
    OutputError
        Where the place cannot be written to; nothing half written is left.
    """
    partial = beside(path)
    with explained(path):
        try:
            yield partial
            partial.replace(path)
        finally:
            with suppress(OSError):  # what stays is cleared away by the next run
                partial.unlink(missing_ok=True)


def write(path: Path, content: str | bytes) -> None:
    """Write bytes, or text as UTF-8.

    Raises
    ------
    OutputError
        As for :func:`replacing`.
    """
    with replacing(path) as partial:
        partial.write_bytes(encoded(content))


def encoded(content: str | bytes) -> bytes:
    """Return text as UTF-8, with names that are not in UTF-8 escaped as JSON does it."""
    return content.encode(errors="backslashreplace") if isinstance(content, str) else content


def put(path: Path, content: str | bytes) -> None:
    """Write to what a user named: in place of a file, into a device, or a pipe that is read.

    Raises
    ------
    OutputError
        As for :func:`replacing`.
    """
    content = content.encode() if isinstance(content, str) else content
    with explained(path):
        if not path.exists() or path.is_file():
            write(Path(os.path.realpath(path)), content)  # a link stays one
            return
        # Opening a pipe that nobody reads would wait for ever.
        descriptor = os.open(path, os.O_WRONLY | os.O_NONBLOCK)
        os.set_blocking(descriptor, True)
        with open(descriptor, "wb") as file:
            file.write(content)


def abandoned(folder: Path, kind: str = "partial") -> Iterator[tuple[Path, Path]]:
    """Yield what was left in a folder, and what it was to stand at.

    That is by dead processes of this machine, and by earlier writings of this one that failed.
    """
    for path in sorted(folder.iterdir()):
        found = LEFT.fullmatch(path.name)
        if found is None or (found["kind"], found["host"]) != (kind, HOST):
            continue
        if not _may_go_on(int(found["pid"]), found["start"]):
            yield path, folder / found["name"]


def remove(path: Path) -> None:
    """Delete a file, a link or a folder that is known to be the project's."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def _may_go_on(pid: int, start: str | None) -> bool:
    """Tell whether another process is alive that has this number, and started then if known."""
    if start and (pid, start) == (os.getpid(), _start(pid)):
        return False
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return not start or _start(pid) in ("", start)


def _start(pid: int) -> str:
    """Return when a process started, in ticks of the system's clock; empty where nobody says."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_bytes()
    except OSError:
        return ""
    return stat.rpartition(b")")[2].split()[19].decode()  # field 22; a name may hold spaces
