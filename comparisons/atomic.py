"""Replacing files atomically: a path holds either the old file or the complete new one.

A partial file's name identifies its writer, ``.NAME.HOST.PID-START.fotismos-partial``: only files
of dead processes of this machine are ever cleared away. START distinguishes a process from later
ones with the same number.
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
"""Bytes of the longest name that file systems commonly allow."""

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
"""What to do about a system error; the alternative is always another place."""


@contextmanager
def explained(path: Path) -> Iterator[None]:
    """Turn system errors of a block that writes into readable ones.

    Raises
    ------
    OutputError
        Naming the path, the reason and the remedy.
    """
    try:
        yield
    except OSError as error:
        raise refusal(path, error) from error


def refusal(path: Path, error: OSError) -> OutputError:
    """Return the error that says why a place cannot be written to."""
    reason = os.strerror(error.errno) if error.errno else str(error)
    advice = ADVICE.get(error.errno or 0, "Move away whatever is in the way")
    return OutputError(
        f"{printable(path)}: {reason}. {advice}, or choose another place (-o). Finished results"
        " are kept."
    )


def printable(path: str | Path) -> str:
    """Return a path as text, escaped if it is not printable."""
    text = str(path)
    return text if text.isprintable() else ascii(text)


def beside(path: Path, kind: str = "partial") -> Path:
    """Return where this process keeps what is about to replace ``path``, or what was there."""
    pid = os.getpid()
    end = f".{HOST}.{'-'.join(filter(None, (str(pid), _start(pid))))}.fotismos-{kind}"
    room = LONGEST - 1 - len(end)
    name = path.name
    if len(os.fsencode(name)) > room:
        name = os.fsencode(name)[:room].decode(errors="ignore")
    return path.with_name(f".{name}{end}")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a file to write to, and replace ``path`` with it if the block succeeds.

    Raises
    ------
    OutputError
        When the place cannot be written to; no partial file is left.
    """
    partial = beside(path)
    with explained(path):
        try:
            yield partial
            partial.replace(path)
        finally:
            with suppress(OSError):  # the next run clears away the rest
                partial.unlink(missing_ok=True)


def write(path: Path, content: str | bytes) -> None:
    """Write bytes, or text as UTF-8.

    Raises
    ------
    OutputError
        See :func:`replacing`.
    """
    with replacing(path) as partial:
        partial.write_bytes(encoded(content))


def encoded(content: str | bytes) -> bytes:
    """Return text as UTF-8; names that are not UTF-8 are escaped as in JSON."""
    return content.encode(errors="backslashreplace") if isinstance(content, str) else content


def put(path: Path, content: str | bytes) -> None:
    """Write to a path that a user named: replace a file, or write into a device or a pipe.

    Raises
    ------
    OutputError
        See :func:`replacing`.
    """
    content = content.encode() if isinstance(content, str) else content
    with explained(path):
        if not path.exists() or path.is_file():
            write(Path(os.path.realpath(path)), content)  # a link stays one
            return
        # Opening a pipe without a reader would wait forever.
        descriptor = os.open(path, os.O_WRONLY | os.O_NONBLOCK)
        os.set_blocking(descriptor, True)
        with open(descriptor, "wb") as file:
            file.write(content)


def abandoned(folder: Path, kind: str = "partial") -> Iterator[tuple[Path, Path]]:
    """Yield each path left behind in a folder, and the path that it was to replace.

    They are from dead processes of this machine, and from failed attempts of this process.
    """
    for path in sorted(folder.iterdir()):
        found = LEFT.fullmatch(path.name)
        if found is None or (found["kind"], found["host"]) != (kind, HOST):
            continue
        if not _may_be_alive(int(found["pid"]), found["start"]):
            yield path, folder / found["name"]


def remove(path: Path) -> None:
    """Delete a file, link or folder that is known to be the project's."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def _may_be_alive(pid: int, start: str | None) -> bool:
    """Return whether another process with this number, and start if known, may be alive."""
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
    """Return when a process started, in ticks of the system's clock; empty if unknown."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_bytes()
    except OSError:
        return ""
    return stat.rpartition(b")")[2].split()[19].decode()  # field 22; a name may hold spaces
