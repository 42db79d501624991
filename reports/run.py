"""Where the time of a run went, and the record of it, ``run.json``."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from time import perf_counter
from typing import Any

START = perf_counter()


class Run:
    """Wall time of one run by stage, in seconds, from the start of the program.

    To be made when start-up is over.
    """

    def __init__(self, command: str) -> None:
        from comparisons import record

        self.command = command
        self.machine, self.versions = record.machine(), record.versions()
        self._seconds = {"start-up": perf_counter() - START}
        self._page: float | None = None

    @contextmanager
    def timing(self, stage: str) -> Iterator[None]:
        """Count the time of a block towards a stage."""
        begin = perf_counter()
        yield
        self._add(stage, perf_counter() - begin)

    def compared(self, record: Mapping[str, Any], seconds: float) -> None:
        """Count a comparison that took so long, by what its record says of it.

        Passes that an interrupted run had rendered took their time then: rendering is at most what
        passed now.
        """
        time = record["time"]
        preparing = sum(
            time["stages"].get(name, 0.0) for name in ("scene and pairing", "planning", "geometry")
        )
        passes = time["heuristic"]["total_s"] + time["reference"]["total_s"]
        rendering = min(passes, seconds - preparing)
        self._add("scenes and plans", preparing)
        self._add("rendering", rendering)
        self._add("metrics", seconds - preparing - rendering)

    def begin_page(self) -> None:
        """Say that from now on the page is written, which ends the run."""
        self._page = perf_counter()

    def stages(self) -> dict[str, float]:
        """The seconds of each stage; the page's, from its beginning to the first call of this."""
        if self._page is not None:
            now = perf_counter()
            self._add("page", now - self._page)
            self._page = None
            self._add("other", max(0.0, now - START - sum(self._seconds.values())))
        return dict(self._seconds)

    def data(self) -> dict[str, Any]:
        """The record of the run."""
        return {
            "command": self.command,
            "stages": self.stages(),
            "machine": self.machine,
            "versions": self.versions,
        }

    def _add(self, stage: str, seconds: float) -> None:
        self._seconds[stage] = self._seconds.get(stage, 0.0) + seconds
