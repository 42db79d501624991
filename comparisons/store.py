"""What was computed once, kept in a file, and found again by a key of all that it depends on.

A file holds a mapping: as JSON, or as arrays where its name ends in ``.npz``. The key stands in it
as well, so that what belongs to another scene, other options or another version is not used.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from comparisons import atomic

KEY = "key"
"""What the file calls the key."""


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
        """Return the result; None where there is none, a damaged one, or one of another key."""
        try:
            content = self._read()
            return content if str(content.pop(KEY)) == self.key else None
        except (OSError, EOFError, BadZipFile, ValueError, KeyError, TypeError, AttributeError):
            return None

    def save(self, content: Mapping[str, Any]) -> None:
        """Put a result in place of what is there."""
        content = {**content, KEY: self.key}
        with atomic.replacing(self.path) as partial:
            if self._is_arrays():
                with partial.open("wb") as file:
                    np.savez(file, **content)
            else:
                partial.write_text(json.dumps(content, ensure_ascii=False), encoding="utf-8")

    def remove(self) -> None:
        """Delete the file."""
        self.path.unlink(missing_ok=True)

    def _is_arrays(self) -> bool:
        return self.path.suffix == ".npz"

    def _read(self) -> dict[str, Any]:
        if not self._is_arrays():
            return json.loads(self.path.read_text(encoding="utf-8"))
        with self.path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
            return {name: file[name] for name in file.files}
