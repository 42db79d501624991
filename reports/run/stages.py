"""Where the time of a run went, and its record, ``run.json``."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter
from typing import TYPE_CHECKING, Annotated

from msgspec import Meta

from comparisons.records import VERSION, Machine, Record, Versions

if TYPE_CHECKING:
    from comparisons.comparison import TimeSpent

START = perf_counter()


class Failure(Record):
    """A scene that could not be compared; ``scene`` is the folder for its results."""

    scene: str
    error: str


class RunRecord(Record, kw_only=True):
    """What one command did, besides the records of its scenes: ``run.json``."""

    command: str
    stages: Annotated[
        dict[str, float],
        Meta(description="Wall time in seconds, summed over simultaneous processes."),
    ]
    failures: tuple[Failure, ...]
    machine: Machine
    versions: Versions
    record_version: int = VERSION


class Stages:
    """Wall time by stage, in seconds, summed over simultaneous processes."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    def add(self, stage: str, seconds: float) -> None:
        """Count seconds towards a stage."""
        self.seconds[stage] = self.seconds.get(stage, 0.0) + seconds

    @contextmanager
    def timing(self, stage: str) -> Iterator[None]:
        """Count the time of a block towards a stage."""
        begin = perf_counter()
        yield
        self.add(stage, perf_counter() - begin)

    def compared(self, time: TimeSpent, seconds: float) -> None:
        """Count the seconds of a comparison, split by its record of time.

        Passes of an interrupted run took their time then, so rendering is limited to the time now.
        """
        preparing = sum(
            time.stages.get(name, 0.0) for name in ("scene and pairing", "planning", "geometry")
        )
        passes = time.heuristic.total_s + time.reference.total_s
        rendering = min(passes, seconds - preparing)
        self.add("scenes and plans", preparing)
        self.add("rendering", rendering)
        self.add("metrics", seconds - preparing - rendering)


class Run(Stages):
    """The stages of one run, from the start of the program.

    Made when start-up is over. `failures` are the scenes that could not be compared.
    """

    def __init__(self, command: str) -> None:
        from comparisons import record

        super().__init__()
        self.add("start-up", perf_counter() - START)
        self.command = command
        self.machine, self.versions = record.machine(), record.versions()
        self.failures: list[Failure] = []
        self._page: float | None = None

    def begin_page(self) -> None:
        """Begin the last stage, writing the page."""
        self._page = perf_counter()

    def stages(self) -> dict[str, float]:
        """The seconds of each stage; the page's stage ends with the first call of this."""
        if self._page is not None:
            now = perf_counter()
            self.add("page", now - self._page)
            self._page = None
            self.add("other", max(0.0, now - START - sum(self.seconds.values())))
        return dict(self.seconds)

    def record(self) -> RunRecord:
        """The record of the run."""
        return RunRecord(
            command=self.command,
            stages=self.stages(),
            failures=tuple(self.failures),
            machine=self.machine,
            versions=self.versions,
        )
