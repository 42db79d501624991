"""Progress while a command runs: what is done, what is running, and the time left.

On a terminal, the last line has the bar of all tasks, at any height; above it are the tasks that
run, and above these the rows of the table of results, as far as they fit. Where standard error is
no terminal, a line says from time to time how many are done.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import dataclass, field
from time import monotonic
from typing import Any

from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table as Grid
from rich.text import Text

from fotismos.comparisons.processes.pool import Ended, Runner, Task, Told, silent
from fotismos.reports.terminal.words import echo, is_quiet, visible

PAUSE_S = 10.0
"""Seconds between two lines where there is no terminal."""

BAR = 30
"""Characters of a bar, at most."""

HEAD = 1
"""Lines of the heading of a table."""

FEWEST = 3
"""Tasks that ended before a time is told, unless that is half of all."""

LEAST_LEFT = 0.25
"""Share of a task that is left at least while it runs, as far as anyone knows."""


@dataclass
class Running:
    """A task that runs: when it told something for the first time, and what it told last."""

    begin: float
    stage: str = ""
    done: int = 0
    total: int = 0


@dataclass
class Progress(Runner):
    """Does tasks with a runner, and shows how far they are; ``what`` they are all called.

    ``rows`` are the lines of a table of what is done, its heading first.
    """

    runner: Runner
    what: str
    clock: Callable[[], float] = monotonic
    rows: Sequence[str] = ()
    running: dict[str, Running] = field(default_factory=dict)
    total: int = 0
    done: int = 0
    failed: int = 0
    begin: float = 0.0
    has_lines: bool = False
    next_line: float = 0.0

    def each(self, tasks: Iterable[Task], told: Told = silent) -> Ended:
        """Do tasks, see :class:`Runner`; ``told`` gets what they tell beside their stages."""
        chosen = list(tasks)
        self.total = sum(task.is_counted for task in chosen)
        self.done = 0
        self.failed = 0
        self.begin = self.clock()
        self.next_line = self.begin + PAUSE_S

        def heard(task: Task, *state: Any) -> None:
            """Show a stage, or pass on anything else."""
            match state:
                case (str(stage), int(done), int(total)):
                    self._stage(task, stage, done, total)
                case _:
                    told(task, *state)

        for task, outcome in self.runner.each(chosen, heard):
            self._end(task, outcome)
            yield task, outcome

    def seconds_left(self) -> float | None:
        """Return the time that is left; None before enough tasks have ended to tell.

        A task takes the time so far over the number of those that ended. That counts the ones that
        run, so the estimate grows slowly where the long ones come late.
        """
        if self.done < max(1, min(FEWEST, self.total / 2)):
            return None
        now = self.clock()
        pace = (now - self.begin) / self.done
        # So many run at once, each for so long.
        each = pace * max(1, len(self.running))
        spent = [now - task.begin for task in self.running.values()]
        waiting = self.total - self.done - len(spent)
        # Nobody knows how much is left of a task that takes longer than the others.
        return pace * (waiting + sum(max(1 - seconds / each, LEAST_LEFT) for seconds in spent))

    def lines(self, width: int, height: int) -> Group:
        """Return what a terminal shows: rows of results, what is running, and the bar of all."""
        shown = list(self.running.items())[: max(1, height - 2)]
        room = max(0, height - len(shown) - 2)
        rows = self.rows
        if len(rows) > room:
            rows = [*rows[:HEAD], *rows[len(rows) - max(0, room - HEAD) :]][:room]
        grid = Grid.grid(padding=(0, 1), expand=False)
        for name, task in shown:
            stage = f"{task.stage} {task.done} of {task.total}" if task.stage else ""
            grid.add_row(*self._row(visible(name), task.done, task.total, stage, width))
        if self.total > 1 or not shown:
            state = f"{self.done} of {self.total}{self._failures()}{self._time_left()}"
            grid.add_row(*self._row(self.what, self.done, self.total, state, width))
        texts = [Text(row, no_wrap=True, overflow="crop") for row in rows]
        return Group(*texts, grid)

    def _row(
        self, name: str, done: int, total: int, state: str, width: int
    ) -> tuple[Text, ProgressBar, Text]:
        bar = ProgressBar(
            total=max(total, 1),
            completed=done,
            width=min(BAR, max(4, width // 4)),
            style="bright_black",
            complete_style="cyan",
            finished_style="green",
        )
        words = Text(name, no_wrap=True, overflow="ellipsis")
        return words, bar, Text(state, no_wrap=True, overflow="ellipsis")

    def _stage(self, task: Task, stage: str, done: int, total: int) -> None:
        running = self.running.setdefault(task.name, Running(begin=self.clock()))
        running.stage = stage
        running.done = done
        running.total = total
        self._say()

    def _end(self, task: Task, outcome: Future[Any]) -> None:
        self.running.pop(task.name, None)
        if not task.is_counted:
            return
        self.done += 1
        self.failed += outcome.exception() is not None
        self._say()

    def _say(self) -> None:
        """Print a line where there is no terminal, unless one was printed just now."""
        now = self.clock()
        if not self.has_lines or now < self.next_line or self.total < 2:
            return
        self.next_line = now + PAUSE_S
        state = f"{self.done} of {self.total}{self._failures()}{self._time_left()}"
        echo(f"{self.what}: {state}", err=True)

    def _failures(self) -> str:
        return f", {self.failed} failed" if self.failed else ""

    def _time_left(self) -> str:
        left = self.seconds_left()
        if left is None:
            return ""
        minutes, seconds = divmod(round(left), 60)
        return f", {minutes}:{seconds:02d} left"


@contextmanager
def shown(runner: Runner, what: str) -> Iterator[Progress]:
    """Show the progress of a runner on standard error during the block."""
    console = Console(stderr=True)
    progress = Progress(runner, what)
    if is_quiet() or not console.is_terminal:
        progress.has_lines = not is_quiet()
        yield progress
        return
    with Live(
        get_renderable=lambda: progress.lines(console.width, console.height),
        console=console,
        transient=True,
        vertical_overflow="crop",
    ):
        yield progress
