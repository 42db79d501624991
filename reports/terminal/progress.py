"""Progress bars while a command runs."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    Task,
    TaskID,
    TextColumn,
    TimeRemainingColumn,
)
from rich.text import Text

from reports.terminal.words import level, visible

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
        self._progress, self._unit, self._whole = progress, unit, None
        if total:
            self._whole = progress.add_task("", total=total, unit="", is_whole=True)
        self._stage, self._done, self._count, self._weight = "", 0, 0, 0.0

    def of(self, scene: str) -> Callable[[str, int, int], None]:
        """Return the callback ``(stage, done, total)`` for one scene."""
        task = self._progress.add_task(visible(scene), total=None, unit=self._unit, is_whole=False)
        return partial(self._update, task)

    def begin(self, stage: str, count: int, weight: float) -> None:
        """Begin a stage of the run: ``count`` tasks of a weight each."""
        self._stage, self._done, self._count, self._weight = stage, 0, count, weight
        if self._whole is not None:
            self._progress.update(self._whole, description=self._words())

    def over(self, update: Callable[..., None] | None, weight: float | None = None) -> None:
        """End the task with this callback: remove its bar, and advance the run's.

        A task with its own weight is not one of the stage's.
        """
        if isinstance(update, partial):
            self._progress.remove_task(update.args[0])
        self._done += weight is None
        if self._whole is not None:
            advance = self._weight if weight is None else weight
            self._progress.update(self._whole, advance=advance, description=self._words())

    def _words(self) -> str:
        return f"{self._stage}, {self._done} of {self._count}"

    def _update(self, task: TaskID, stage: str, done: int, total: int) -> None:
        self._progress.update(task, completed=done, total=total)


class _Count(MofNCompleteColumn):
    """The part of a task that is done; of the whole run, in percent."""

    def render(self, task: Task) -> Text:
        return Text(f"{task.percentage:.0f} %") if task.fields["is_whole"] else super().render(task)


@contextmanager
def shown(unit: str = "passes", total: float | None = None) -> Iterator[Bar]:
    """Show progress on standard error during the block, if that is a terminal; see :class:`Bar`."""
    console = Console(stderr=True)
    with Progress(
        TextColumn("{task.description}", markup=False),  # a name may hold brackets
        BarColumn(),
        _Count(),
        TextColumn("{task.fields[unit]}"),
        TimeRemainingColumn(),
        console=console,
        transient=True,
        speed_estimate_period=SPEED_OVER_S,
        disable=not console.is_terminal or level() < 0,
    ) as progress:
        yield Bar(progress, unit, total)
