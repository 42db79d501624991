"""What was computed once, kept in a file, and found again by a key of all that it depends on.

A file holds a mapping: as JSON, or as arrays where its name ends in ``.npz``. The key stands in it
as well, so that what belongs to another scene, other options or another version is not used. A
checksum (that of ZIP for arrays) tells what was damaged, which is computed again.
"""

import json
import os
import stat
from collections.abc import Callable, Iterator, Mapping
from hashlib import sha256
from math import prod
from pathlib import Path
from typing import Any, BinaryIO
from zipfile import ZIP_STORED, ZipFile

import numpy as np

from comparisons import atomic
from heuristic.errors import InputError

KEY = "key"
"""What the file calls the key."""

LARGEST = 2**30
"""Bytes of the largest file that is read at once: far beyond any that is written."""


def content(path: str | Path, largest: int = LARGEST) -> bytes:
    """Return what is in a regular file.

    Raises ``OSError``, without opening it, for what is not a regular file (opening a FIFO waits for
    ever) or has more than ``largest`` bytes.
    """
    require_regular(path, largest)
    with Path(path).open("rb") as file:
        return file.read(largest)


class Lazy(Mapping[str, Any]):
    """A mapping whose values are made by functions without arguments, each time they are asked for.

    So the arrays of a large content need not be in memory together.
    """

    def __init__(self, makers: Mapping[str, Callable[[], Any]]) -> None:
        self._makers = makers

    def __getitem__(self, name: str) -> Any:
        return self._makers[name]()

    def __iter__(self) -> Iterator[str]:
        return iter(self._makers)

    def __len__(self) -> int:
        return len(self._makers)


class Entry:
    """A place for one result.

    Parameters
    ----------
    path
        The file.
    key
        What the result depends on, as text.
    """

    def __init__(self, path: str | Path, key: str) -> None:
        self.path, self.key = Path(path), key

    def load(self) -> dict[str, Any] | None:
        """Return the result; None where there is none, a damaged one, or one of another key.

        Arrays are never of objects. Whether the mapping holds what it should is the caller's to
        check.
        """
        try:
            return self._arrays() if self._is_arrays() else self._json()
        # What is wrong with a damaged file shows in many ways; the answer to all is the same.
        except Exception:
            return None

    def save(self, content: Mapping[str, Any]) -> None:
        """Put a result in place of what is there.

        Raises
        ------
        InputError
            When the place cannot be written to, or holds something other than a file.
        """
        try:
            if self.path.exists():
                require_regular(self.path)
            with atomic.replacing(self.path) as partial:
                if self._is_arrays():
                    with partial.open("wb") as file:
                        _write_arrays(file, content, self.key)
                else:
                    body = json.dumps(content, ensure_ascii=False).encode()
                    partial.write_bytes(self._head(body) + body + b"}")
        except OSError as error:
            raise InputError(
                f"{self.path}: {error.strerror or error}. Results are kept there: make room,"
                " or choose another output folder with -o."
            ) from error

    def remove(self) -> None:
        """Delete the file; what is not a file stays."""
        if self.path.is_file():
            self.path.unlink(missing_ok=True)

    def _is_arrays(self) -> bool:
        return self.path.suffix == ".npz"

    def _head(self, body: bytes) -> bytes:
        """Return what stands before the content: the key, and the content's checksum."""
        key = json.dumps(self.key, ensure_ascii=False)
        return f'{{"{KEY}": {key}, "sha256": "{sha256(body).hexdigest()}", "content": '.encode()

    def _json(self) -> dict[str, Any] | None:
        text = content(self.path)
        body = text[len(self._head(b"")) : -1]
        found = json.loads(body) if text == self._head(body) + body + b"}" else None
        return found if isinstance(found, dict) else None

    def _arrays(self) -> dict[str, Any] | None:
        require_regular(self.path)
        with self.path.open("rb") as stream, ZipFile(stream) as archive:
            members = archive.infolist()
            size = sum(member.file_size for member in members)
            # Only what is not compressed is bounded by the size of the file.
            stored = all(member.compress_type == ZIP_STORED for member in members)
            if not stored or size > self.path.stat().st_size:
                return None
            found = {}
            for member in members:
                with archive.open(member) as file:
                    found[member.filename.removesuffix(".npy")] = _array(file)
        return found if str(found.pop(KEY)) == self.key else None


def _write_arrays(file: BinaryIO, content: Mapping[str, Any], key: str) -> None:
    """Write arrays as ``np.savez`` does, but one at a time."""
    with ZipFile(file, "w", ZIP_STORED) as archive:
        for name in (*content, KEY):
            value = key if name == KEY else content[name]
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array(member, np.asanyarray(value), allow_pickle=False)


def _array(file: BinaryIO) -> np.ndarray:
    """Read one array in NumPy's format, whose header must tell the size of what follows."""
    version = np.lib.format.read_magic(file)
    if version != (1, 0):
        raise ValueError("another version of the format")
    shape, is_fortran, dtype = np.lib.format.read_array_header_1_0(file)
    if dtype.hasobject:
        raise ValueError("an array of objects")
    content = file.read()
    if len(content) != prod(shape) * dtype.itemsize:
        raise ValueError("an array of another size")
    return np.ndarray(shape, dtype, content, order="F" if is_fortran else "C")


def require_regular(path: str | Path, largest: int | None = None) -> None:
    """Raise ``OSError`` for what is not a regular file, or has more than ``largest`` bytes."""
    found = os.stat(path)
    if not stat.S_ISREG(found.st_mode):
        raise OSError(None, "it is not a regular file")
    if largest is not None and found.st_size > largest:
        raise OSError(None, f"it has {found.st_size} bytes, and at most {largest} are read")
