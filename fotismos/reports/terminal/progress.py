"""Progress while a command runs: each scene's stage, what comes next, and the time left.

Where standard error is no terminal, a line says what is finished.
"""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from fotismos.comparisons.processes.pool import Pool, Task
from fotismos.reports.terminal.words import echo, is_quiet, visible

SPEED_OVER_S = 600.0
"""Seconds over which the speed is averaged to estimate the time left: scenes differ."""

LINES = 10
"""Most lines on what one task counts, such as a study its points."""


class Bar:
    """Progress bars on standard error, one per task and one for all of several; or lines.

    A task's bar counts ``unit``: the passes of a scene, or what users count themselves.
    """

    def __init__(self, progress: Progress, unit: str = "passes") -> None:
        self._progress = progress
        self._has_lines = progress.disable and not is_quiet()
        self._unit = unit
        self._tasks: dict[Callable[..., None], TaskID] = {}

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
            is_counted = self._has_lines and self._unit != "passes" and done > 0
            if is_counted and LINES * done // total > LINES * (done - 1) // total:
                echo(f"{name}: {done} of {total} {self._unit}", err=True)

        self._tasks[update] = task
        return update

    def each(
        self, pool: Pool, tasks: Sequence[Task], what: str
    ) -> Iterator[tuple[Task, Future[Any]]]:
        """Do tasks in a pool, and yield each with its outcome; ``what`` they are all called.

        Tasks without progress are none of these, and not counted.
        """
        total = sum(task.progress is not None for task in tasks)
        is_one = total == 1
        whole = None if is_one else self._progress.add_task(f"{what}, 0 of {total}", total=total)
        done = 0
        for task, outcome in pool.each(tasks):
            if task.progress in self._tasks:
                self._progress.remove_task(self._tasks.pop(task.progress))
            if whole is not None and task.progress is not None:
                done += 1
                state = f"{what}, {done} of {total}"
                self._progress.update(whole, advance=1, description=state)
                if self._has_lines:
                    ending = "failed" if outcome.exception() else "finished"
                    echo(f"{task.name}: {ending}, {done} of {total}", err=True)
            yield task, outcome


@contextmanager
def shown(unit: str = "passes") -> Iterator[Bar]:
    """Show progress on standard error during the block; see :class:`Bar`."""
    console = Console(stderr=True)
    with Progress(
        TextColumn("{task.description}", markup=False),  # a name may hold brackets
        BarColumn(style="bright_black", complete_style="cyan", finished_style="green"),
        TimeRemainingColumn(),
        console=console,
        transient=True,
        speed_estimate_period=SPEED_OVER_S,
        disable=not console.is_terminal or is_quiet(),
    ) as progress:
        yield Bar(progress, unit)
