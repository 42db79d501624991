"""Passes of a long run, kept in a file that an interrupted run resumes from.

``.SCENE.fotismos-passes.npz``, next to the folder of a scene's results, is written atomically,
belongs to one scene, one set of options and one set of versions, and is deleted when the run
succeeds.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

from comparisons.store import Entry
from heuristic.heuristics import named
from reference.scene.identity import digest

if TYPE_CHECKING:
    from comparisons.case import Case
    from comparisons.options import Options
    from reference.scene.source import Source

INTERVAL_S = 10.0
"""Least seconds between writings: short runs write nothing."""

SHARE = 0.05
"""Greatest share of the time that writing may take."""


class KeptPasses(Entry):
    """The kept passes of one scene.

    Parameters
    ----------
    path, key
        See :class:`comparisons.store.Entry`; :func:`key_of` makes the key.
    interval
        Least seconds between writings.
    """

    def __init__(self, path: str | Path, key: str, interval: float = INTERVAL_S) -> None:
        super().__init__(path, key)
        self.interval = interval
        self._next = perf_counter() + interval

    def offer(self, count: int, state: Callable[[], Mapping[str, Any]]) -> None:
        """Write ``state()``, which holds ``count`` passes, if it is due."""
        begin = perf_counter()
        if begin < self._next:
            return
        self.save(state())
        end = perf_counter()
        self._next = end + max(self.interval, (end - begin) / SHARE)


def of_scene(folder: Path, name: str, case: Case) -> KeptPasses:
    """Return the :class:`KeptPasses` of a comparison whose results go to ``folder/name``.

    The file is next to that folder, which a finished result replaces.
    """
    from comparisons import record

    key = key_of(case.source, case.options, case.variant, record.versions())
    return KeptPasses(folder / f".{name}.fotismos-passes.npz", key)


def _digest(word: str) -> str:
    from comparisons.pictures.picture_files import path_of

    path = path_of(word)
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""


def key_of(source: Source, options: Options, variant: str, versions: Mapping[str, str]) -> str:
    """Return a digest of all that the passes of a comparison depend on.

    These are the scene with the content of every file that it reads
    (:func:`reference.scene.identity.digest`), the code of the heuristic or the pictures in its
    place, the options except how long to continue, variant and versions.
    """
    told: dict[str, Any] = {
        name: str(value) for name, value in vars(options).items() if name != "noise"
    }
    told |= {"until noise": options.noise is not None, "variant": variant, "versions": versions}
    told["heuristic code"] = named(options.heuristic).digest()
    told["pictures"] = [_digest(word) for word in options.image]
    told["scene"] = digest(source)
    return hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()
