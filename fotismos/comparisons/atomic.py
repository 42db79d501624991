"""Writing files atomically, and reading kept results back.

A path holds either the old file or the complete new one. A partial file, ``.NAME.PID`` and
`PARTIAL`, is left only by a killed process.
"""

import errno
import json
import os
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from hashlib import sha256
from pathlib import Path
from typing import Any

from fotismos.heuristic.errors import InputError, OutputError

PARTIAL = ".fotismos-partial"

LONGEST = 255
"""Bytes of the longest name that file systems commonly allow."""

LARGEST = 2**30
"""Bytes of the largest file that is read at once: far more than any that is written."""

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
    """Turn system errors of a block that writes into readable ones."""
    try:
        yield
    except OSError as error:
        raise refusal(path, error) from error


def refusal(path: Path, error: OSError) -> OutputError:
    """Return the error that says why a place cannot be written to."""
    reason = error.strerror or str(error)
    advice = ADVICE.get(error.errno or 0, "Move away whatever is in the way")
    return OutputError(
        f"{printable(path)}: {reason}. {advice}, or choose another `output`. Finished results"
        " are kept."
    )


def printable(path: str | Path) -> str:
    """Return a path as text, escaped if it is not printable."""
    text = str(path)
    return text if text.isprintable() else ascii(text)


def file_name(name: object, what: str) -> str:
    """Return a name that a user gave for a file, which must not lead to another folder."""
    is_plain = isinstance(name, str) and name.isprintable() and Path(name).name == name != ".."
    if not is_plain:
        raise InputError(
            f"{what} has name = {name!r}: a file gets that name. Give one without a slash."
        )
    return str(name)


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a file to write to, and replace ``path`` with it if the block succeeds."""
    # In the same folder, so that replacing is one rename. Names are cut by bytes, and what is
    # left of a split character is dropped.
    end = f".{os.getpid()}{PARTIAL}"
    name = os.fsencode(path.name)[: LONGEST - 1 - len(end)].decode(errors="ignore")
    partial = path.with_name(f".{name}{end}")
    with explained(path):
        try:
            yield partial
            partial.replace(path)
        finally:
            with suppress(OSError):
                partial.unlink(missing_ok=True)


def write(path: Path, content: str | bytes) -> None:
    """Write bytes, or text as UTF-8, see :func:`replacing`."""
    with replacing(path) as partial:
        partial.write_bytes(encoded(content))


def encoded(content: str | bytes) -> bytes:
    """Return text as UTF-8; names that are not UTF-8 are escaped as in JSON."""
    return content.encode(errors="backslashreplace") if isinstance(content, str) else content


def put(path: Path, content: str | bytes) -> None:
    """Write to a path that a user named: replace a file, or write into a device or a pipe."""
    with explained(path):
        if not path.exists() or path.is_file():
            write(Path(os.path.realpath(path)), content)  # a link stays one
            return
        # Opening a pipe without a reader would wait forever.
        descriptor = os.open(path, os.O_WRONLY | getattr(os, "O_NONBLOCK", 0))
        os.set_blocking(descriptor, True)
        with open(descriptor, "wb") as file:
            file.write(encoded(content))


def content(path: str | Path, largest: int = LARGEST) -> bytes:
    """Return the content of a regular file.

    Raises ``OSError``, without opening it, for anything but a regular file (opening a FIFO waits
    forever) or for more than ``largest`` bytes.
    """
    require_regular(path, largest)
    with Path(path).open("rb") as file:
        return file.read(largest)


def require_regular(path: str | Path, largest: int | None = None) -> None:
    """Raise ``OSError`` for anything but a regular file of at most ``largest`` bytes."""
    state = os.stat(path)
    if not stat.S_ISREG(state.st_mode):
        raise OSError(None, "it is not a regular file")
    if largest is not None and state.st_size > largest:
        raise OSError(None, f"it has {state.st_size} bytes, and at most {largest} are read")


class Entry:
    """A JSON file that keeps a mapping under ``key``, the text of all that it depends on.

    A checksum detects a damaged file, which does not count.
    """

    def __init__(self, path: str | Path, key: str) -> None:
        self.path = Path(path)
        self.key = key

    def load(self) -> dict[str, Any] | None:
        """Return the mapping; None if there is none, it is damaged, or it has another key.

        The caller must check that it holds what it should.
        """
        try:
            text = content(self.path)
            # Checksums have one length, so the head of an empty body is as long as any.
            body = text[len(self._head(b"")) : -1]
            result = json.loads(body) if text == self._head(body) + body + b"}" else None
        except (OSError, ValueError, RecursionError):
            return None
        return result if isinstance(result, dict) else None

    def save(self, content: Mapping[str, Any]) -> None:
        """Save a mapping, in place of the old one."""
        with explained(self.path):
            if self.path.exists():
                require_regular(self.path)
            body = json.dumps(content, ensure_ascii=False).encode()
            write(self.path, self._head(body) + body + b"}")

    def _head(self, body: bytes) -> bytes:
        """Return the text before the content: the key, and the content's checksum."""
        key = json.dumps(self.key, ensure_ascii=False)
        return f'{{"key": {key}, "sha256": "{sha256(body).hexdigest()}", "content": '.encode()
