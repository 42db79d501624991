"""Results kept in files, under a key of everything that they depend on.

A file holds a mapping: as JSON, or as arrays if its name ends in ``.npz``. It also holds the key,
so results of another scene, other options or another version are not used. A checksum (ZIP's own
for arrays) detects damaged results, which are computed again.
"""

import json
import os
import stat
from collections.abc import Callable, Iterator, Mapping
from hashlib import sha256
from math import prod
from pathlib import Path
from typing import IO, Any, BinaryIO
from zipfile import ZIP_STORED, ZipFile

import numpy as np

from comparisons import atomic
from heuristic.errors import InputError

KEY = "key"
"""Name of the key in the file."""

LARGEST = 2**30
"""Bytes of the largest file that is read at once: far more than any that is written."""


def content(path: str | Path, largest: int = LARGEST) -> bytes:
    """Return the content of a regular file.

    Raises ``OSError``, without opening it, for anything but a regular file (opening a FIFO waits
    forever) or for more than ``largest`` bytes.
    """
    require_regular(path, largest)
    with Path(path).open("rb") as file:
        return file.read(largest)


class Lazy(Mapping[str, Any]):
    """A mapping whose values are made by functions without arguments, at each access.

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
        """Return the result; None if there is none, it is damaged, or it has another key.

        Arrays never hold objects. The caller must check that the mapping holds what it should.
        """
        try:
            return self._arrays() if self._is_arrays() else self._json()
        # A damaged file can raise anything, and the answer is always the same.
        except Exception:
            return None

    def save(self, content: Mapping[str, Any]) -> None:
        """Save a result, replacing the old one.

        Raises
        ------
        InputError
            When the path cannot be written to, or is not a regular file.
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
        """Delete the file; anything but a file stays."""
        if self.path.is_file():
            self.path.unlink(missing_ok=True)

    def _is_arrays(self) -> bool:
        return self.path.suffix == ".npz"

    def _head(self, body: bytes) -> bytes:
        """Return the text before the content: the key, and the content's checksum."""
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
            # Only uncompressed members are bounded by the size of the file.
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


def _array(file: IO[bytes]) -> np.ndarray:
    """Read one array in NumPy's format, whose header must match its size."""
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
    """Raise ``OSError`` for anything but a regular file of at most ``largest`` bytes."""
    found = os.stat(path)
    if not stat.S_ISREG(found.st_mode):
        raise OSError(None, "it is not a regular file")
    if largest is not None and found.st_size > largest:
        raise OSError(None, f"it has {found.st_size} bytes, and at most {largest} are read")
