"""Turns of the processes of one command: while one measures times, the others wait."""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Self


class Turn:
    """A turn of a process among those that share a folder; within this context it works.

    Working processes share a lock on the folder. One that measures has it alone, and first takes
    that of a subfolder: a process that begins to work waits there, so that it never comes first.
    """

    def __init__(self, folder: Path, gate: Path) -> None:
        self._folder, self._gate = folder, gate

    def __enter__(self) -> Self:
        self._file = os.open(self._folder, os.O_RDONLY)
        with self._at_gate():
            fcntl.flock(self._file, fcntl.LOCK_SH)
        return self

    def __exit__(self, *_: object) -> None:
        os.close(self._file)

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Wait until no other process works, and let none begin within this context."""
        fcntl.flock(self._file, fcntl.LOCK_UN)
        with self._at_gate():
            fcntl.flock(self._file, fcntl.LOCK_EX)
        try:
            yield
        finally:
            fcntl.flock(self._file, fcntl.LOCK_SH)

    @contextmanager
    def _at_gate(self) -> Iterator[None]:
        file = os.open(self._gate, os.O_RDONLY)
        try:
            fcntl.flock(file, fcntl.LOCK_EX)
            yield
        finally:
            os.close(file)
