"""A pool of processes: a task that kills its process harms no other task.

A process does task after task, so its start-up is paid once. A new one replaces one that died, or
that ran a user's code (:func:`comparisons.processes.worker.end_after_task`).
"""

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future
from itertools import islice
from math import inf
from multiprocessing import connection
from time import monotonic
from typing import Any

from comparisons.processes.worker import GRACE_S, Task, Worker

LOOK_S = 1.0
"""Seconds between checks that a process lives: its forks may hold its pipe open."""


def cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class Pool:
    """Does tasks in separate processes; a context that ends the processes.

    Parameters
    ----------
    count
        Most processes at the same time. With 0 the tasks are done in this process, one after
        another and without a time limit.
    prepare
        Called once in each process, before its first task.
    limit_s
        Seconds that a task may take without reporting progress, start-up included.
    """

    def __init__(
        self, count: int, prepare: Callable[[], object] = tuple, limit_s: float = inf
    ) -> None:
        self._count, self._prepare, self._limit_s = count, prepare, limit_s
        self._idle: list[Worker] = []
        self._busy: list[Worker] = []

    def __enter__(self) -> "Pool":
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def start(self) -> None:
        """Start the processes now: they get ready while this one does other things."""
        while len(self._idle) + len(self._busy) < self._count:
            self._idle.append(Worker(self._prepare))

    def do(self, task: Task) -> Any:
        """Do one task, and return what it returned, or raise what it raised."""
        ((_, outcome),) = self.each([task])
        return outcome.result()

    def each(self, tasks: Iterable[Task]) -> Iterator[tuple[Task, Future[Any]]]:
        """Do tasks; yield each with its outcome when it finishes.

        The outcome returns what the function returned, or raises the `FotismosError` that it
        raised. In a separate process it raises a `LostProcessError` for any other exception, for a
        process that ended, and when the time is up.
        """
        if self._count == 0:
            self._prepare()
            for task in tasks:
                yield task, _done_here(task)
            return
        waiting = iter(tasks)
        self._fill(waiting)
        while self._busy:
            finished = self._finished()
            self._fill(waiting)  # no process waits while the caller handles results
            yield from finished

    def end(self) -> None:
        """End the processes, whatever they are doing."""
        workers, self._idle, self._busy = self._idle + self._busy, [], []
        for worker in workers:
            worker.pipe.close()
        until = monotonic() + GRACE_S
        for worker in workers:
            worker.end(max(0.0, until - monotonic()))

    def _fill(self, waiting: Iterator[Task]) -> None:
        """Give tasks to idle and new processes."""
        for worker in self._idle:
            if not worker.process.is_alive():
                worker.end()
        self._idle = [worker for worker in self._idle if not worker.is_spent]
        for task in islice(waiting, self._count - len(self._busy)):
            self._give(task)

    def _give(self, task: Task, is_second_try: bool = False) -> None:
        worker = self._idle.pop() if self._idle else Worker(self._prepare)
        self._busy.append(worker)
        worker.give(task, self._limit_s, is_second_try)

    def _finished(self) -> list[tuple[Task, Future[Any]]]:
        """Wait for messages or the next deadline; return the tasks that are over."""
        first = min(worker.deadline for worker in self._busy)
        ready = connection.wait(
            [worker.pipe for worker in self._busy],
            max(0.0, min(LOOK_S, first - monotonic())),
        )
        for worker in self._busy:
            if worker.pipe in ready:
                worker.receive(self._limit_s)
            elif not worker.process.is_alive():
                worker.gone()
            elif worker.deadline <= monotonic():
                worker.lose(f"it made no progress for {self._limit_s:g} s, and was ended.")
        over = [worker for worker in self._busy if worker.outcome.done()]
        self._busy = [worker for worker in self._busy if worker not in over]
        killed = [worker for worker in over if worker.was_killed and not worker.is_second_try]
        over = [worker for worker in over if worker not in killed]
        for worker in killed:
            self._give(worker.task, is_second_try=True)
        for worker in over:
            if worker.is_spent:
                worker.end()
            else:
                self._idle.append(worker)
        return [(worker.task, worker.outcome) for worker in over]


def _done_here(task: Task) -> Future[Any]:
    outcome: Future[Any] = Future()
    try:
        outcome.set_result(task.function(*task.arguments, *filter(None, [task.progress])))
    except Exception as error:
        outcome.set_exception(error)
    return outcome
