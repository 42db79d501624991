"""The page of a run, rewritten while its scenes are made."""

from __future__ import annotations

from collections.abc import Callable, Collection
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic
from typing import Any

from heuristic.errors import FotismosError, OutputError
from reports.page.scene_view import Making, SceneView
from reports.run.stages import Failure

INTERVAL_S = 4.0
"""Least seconds between two writings."""

SHARE = 0.1
"""Greatest share of the time that writing may take."""


@dataclass
class Growing:
    """The results so far of a run's scenes, by the names of their places.

    ``seen`` is called with the page's path once the page exists. ``coarse`` are small previews,
    which ``views`` replace.
    """

    folder: Path
    places: Collection[str]
    seen: Callable[[Path], object]
    coarse: dict[str, SceneView] = field(default_factory=dict)
    views: dict[str, SceneView] = field(default_factory=dict)
    failures: dict[str, FotismosError] = field(default_factory=dict)
    _next: float = 0.0
    _is_seen: bool = False

    @property
    def has_begun(self) -> bool:
        """Whether there is anything to show."""
        return bool(self.views or self.coarse or self.failures)

    def shown(self) -> list[SceneView]:
        """The views in the order of their places."""
        best = self.coarse | self.views
        return [best[place] for place in self.places if place in best]

    def failed(self) -> list[Failure]:
        """The scenes that could not be compared."""
        found = self.failures
        return [Failure(scene=p, error=str(found[p])) for p in self.places if p in found]

    @property
    def is_whole(self) -> bool:
        """Whether no scene is left."""
        return len(self.views) + len(self.failures) == len(self.places)

    def making(self, is_interrupted: bool = False) -> Making:
        """The progress of the run."""
        done = len(self.views) + len(self.failures)
        return Making(done, len(self.places), is_interrupted)

    def offer(self, at_once: bool = False) -> None:
        """Write the page if it is due; a failure is left for the next time."""
        begin = monotonic()
        if len(self.places) == 1 or (begin < self._next and not at_once):
            return
        with suppress(OutputError):
            self.write(failures=self.failed(), making=self.making())
        end = monotonic()
        self._next = end + max(INTERVAL_S, (end - begin) * (1.0 / SHARE - 1.0))

    def write(self, **shown: Any) -> None:
        """Write the page with more arguments of :func:`reports.page.page.render`.

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        from reports.run import output

        output.write_page(self.folder, self.shown(), **shown)
        if not self._is_seen:
            self._is_seen = True
            self.seen(self.folder / output.PAGE)
