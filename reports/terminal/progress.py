"""Progress while a command runs: each scene's stage, what comes next, and the time left."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from fotismos.reports.terminal.words import level, visible

SPEED_OVER_S = 600.0
"""Seconds over which the speed is averaged to estimate the time left: scenes differ."""


class Bar:
    """Progress bars on standard error, one per scene; silent where no person is watching.

    A scene's bar counts ``unit``. The whole run has one if there is a ``total``, in the weights
    given to :meth:`begin`.
    """

    def __init__(
        self, progress: Progress, unit: str = "passes", total: float | None = None
    ) -> None:
        self._progress = progress
        self._unit = unit
        self._whole = progress.add_task("", total=total) if total else None
        self._tasks: dict[Callable[..., None], TaskID] = {}
        self._stage = ""
        self._done = 0
        self._count = 0
        self._weight = 0.0

    def of(self, scene: str, stages: tuple[str, ...] = ()) -> Callable[[str, int, int], None]:
        """Return the callback ``(stage, done, total)`` for one scene; ``stages`` are to come."""
        name = visible(scene)
        task = self._progress.add_task(name, total=None)
        current = ""

        def update(stage: str, done: int, total: int) -> None:
            nonlocal current
            if stage != current:
                current = stage
                self._progress.reset(task)  # the speed of the last stage says nothing on this one
            after = stages[stages.index(stage) + 1 :] if stage in stages else ()
            line = f"{name}: {stage} {done} of {total} {self._unit}"
            line += f", {after[0]} next" if after else ""
            self._progress.update(task, completed=done, total=total, description=line)

        self._tasks[update] = task
        return update

    def begin(self, stage: str, count: int, weight: float) -> None:
        """Begin a stage of the run: ``count`` tasks of a weight each."""
        self._stage = stage
        self._done = 0
        self._count = count
        self._weight = weight
        self._advance(0.0)

    def over(self, update: Callable[..., None] | None, weight: float | None = None) -> None:
        """End the task with this callback: remove its bar, and advance the run's.

        A task with its own weight is not one of the stage's.
        """
        if update in self._tasks:
            self._progress.remove_task(self._tasks.pop(update))
        self._done += weight is None
        self._advance(self._weight if weight is None else weight)

    def _advance(self, weight: float) -> None:
        if self._whole is not None:
            state = f"{self._stage}, {self._done} of {self._count}"
            self._progress.update(self._whole, advance=weight, description=state)


@contextmanager
def shown(unit: str = "passes", total: float | None = None) -> Iterator[Bar]:
    """Show progress on standard error during the block, if that is a terminal; see :class:`Bar`."""
    console = Console(stderr=True)
    with Progress(
        TextColumn("{task.description}", markup=False),  # a name may hold brackets
        BarColumn(),
        TimeRemainingColumn(),
        console=console,
        transient=True,
        speed_estimate_period=SPEED_OVER_S,
        disable=not console.is_terminal or level() < 0,
    ) as progress:
        yield Bar(progress, unit, total)
