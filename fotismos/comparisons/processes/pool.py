"""A pool of processes: a task that ends its process, or hangs, harms no other task.

A process does task after task, so its start-up is paid once. A new one replaces one that died, or
that ran a user's script. Each leads its own process group, which ends as a whole: with the process,
when its time is up, or when the parent ends in any way.
"""

import logging
import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, partial
from itertools import islice
from math import inf
from multiprocessing import connection, get_context, parent_process, resource_tracker
from time import monotonic, sleep
from typing import Any, NoReturn

from fotismos.comparisons.processes.interruption import SIGNALS, held_back
from fotismos.heuristic.errors import FotismosError, InputError, LostProcessError

HAS_GROUPS = hasattr(os, "killpg")
"""Whether processes can end with their groups; on Windows, tasks are done in one process."""

LOOK_S = 1.0
"""Seconds between checks that a process lives: its forks may hold its pipe open."""

LOGGER = logging.getLogger(__name__)
"""Receives the traceback of unexpected errors."""


@cache
def once(set_up: Callable[[], object]) -> None:
    """Set this process up once; again if that failed."""
    set_up()


@dataclass(frozen=True)
class Task:
    """A call of ``function(*arguments)``, both of them picklable.

    ``name`` appears in messages. If it ``tells`` of its progress, the function takes a callable as
    its last argument, whose calls reach the one that waits (:meth:`Runner.each`). If it runs a
    user's script, which may change its process, it ``ends_process``: other tasks need a clean one.
    Some are not counted in what users see of the progress.
    """

    name: str
    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    tells: bool = False
    ends_process: bool = False
    is_counted: bool = True


Told = Callable[..., object]
"""Called as ``told(task, *state)`` with what a task tells."""

Ended = Iterator[tuple[Task, Future[Any]]]
"""Tasks in the order in which they end, each with its outcome."""


def silent(*_: object) -> None:
    """Discard what a task tells."""


class Runner:
    """Whatever does tasks: processes here, a cluster, or one of these with a display."""

    def each(self, tasks: Iterable[Task], told: Told = silent) -> Ended:
        """Do tasks; yield each with its outcome when it ends.

        The outcome returns what the function returned, or raises the `FotismosError` that it
        raised. If tasks are done elsewhere, it raises a `LostProcessError` for any other exception,
        for a process that ended, and when the time is up.
        """
        raise NotImplementedError

    def do(self, task: Task) -> Any:
        """Do one task, and return what it returned, or raise what it raised."""
        ((_, outcome),) = self.each([task])
        return outcome.result()


class Pool(Runner):
    """Does tasks in separate processes; a context that ends the processes.

    At most ``count`` processes run at the same time. With 0 the tasks are done in this process, one
    after another and without a time limit. Each calls ``set_up`` once, before its first task. A
    task may take ``limit_s`` seconds without reporting progress, start-up included.
    """

    def __init__(
        self, count: int, set_up: Callable[[], object] = tuple, limit_s: float = inf
    ) -> None:
        self._count = count
        self._set_up = set_up
        self._limit_s = limit_s
        self._idle: list[Worker] = []
        self._busy: list[Worker] = []

    def __enter__(self) -> "Pool":
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def start(self) -> None:
        """Start the processes now: they get ready while this one does other things."""
        while len(self._idle) + len(self._busy) < self._count:
            self._idle.append(Worker(self._set_up))

    def each(self, tasks: Iterable[Task], told: Told = silent) -> Ended:
        """Do tasks, see :meth:`Runner.each`."""
        if self._count == 0:
            self._set_up()
            for task in tasks:
                outcome: Future[Any] = Future()
                more = (partial(told, task),) if task.tells else ()
                try:
                    outcome.set_result(task.function(*task.arguments, *more))
                except Exception as error:
                    outcome.set_exception(error)
                yield task, outcome
            return
        waiting = iter(tasks)
        self._fill(waiting)
        while self._busy:
            finished = self._finished(told)
            self._fill(waiting)  # no process waits while the caller handles results
            yield from finished

    def end(self) -> None:
        """End the processes, whatever they are doing."""
        workers = self._idle + self._busy
        self._idle = []
        self._busy = []
        for worker in workers:
            worker.end()

    def _fill(self, waiting: Iterator[Task]) -> None:
        for task in islice(waiting, self._count - len(self._busy)):
            # An idle process may have died since its last task.
            self._idle = [worker for worker in self._idle if worker.process.is_alive()]
            worker = self._idle.pop() if self._idle else Worker(self._set_up)
            self._busy.append(worker)
            worker.give(task, self._limit_s)

    def _finished(self, told: Told) -> list[tuple[Task, Future[Any]]]:
        """Wait for messages or the next deadline; return the tasks that are over."""
        first = min(worker.deadline for worker in self._busy)
        pause = max(0.0, min(LOOK_S, first - monotonic()))
        ready = connection.wait([worker.pipe for worker in self._busy], pause)
        over = []
        for worker in self._busy:
            # Messages first: a process may have ended just after its answer.
            if worker.pipe in ready:
                worker.receive(self._limit_s, told)
            elif not worker.process.is_alive():
                worker.lose()
            elif worker.deadline <= monotonic():
                worker.lose(f"it made no progress for {self._limit_s:g} s, and was ended.")
            if worker.outcome.done():
                over.append(worker)
                if worker.is_over or worker.task.ends_process:
                    worker.end()
                else:
                    self._idle.append(worker)
        self._busy = [worker for worker in self._busy if worker not in over]
        return [(worker.task, worker.outcome) for worker in over]


class Worker:
    """One process, as seen by its parent."""

    task: Task
    outcome: Future[Any]
    deadline: float

    def __init__(self, set_up: Callable[[], object]) -> None:
        context = get_context("spawn")  # a fork would share threads' locks with its parent
        self.is_over = False
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=_work, args=(theirs, set_up), daemon=True)
        resource_tracker.ensure_running()  # here, because it unblocks signals
        with held_back():
            self.process.start()
        theirs.close()  # the end of the process must be the end of the pipe

    def give(self, task: Task, limit_s: float) -> None:
        """Send a task, which has ``limit_s`` seconds until its first sign of progress."""
        self.task, self.outcome, self.deadline = task, Future(), monotonic() + limit_s
        with suppress(ConnectionError):  # a process that is gone is noticed in `receive`
            self.pipe.send((task.function, task.arguments, task.tells))

    def receive(self, limit_s: float, told: Told) -> None:
        """Take one message: the outcome of the task, or what it tells."""
        try:
            kind, content = self.pipe.recv()
        except (EOFError, OSError):
            self.lose()
            return
        except Exception as error:  # unpickling can raise anything
            self.lose(f"its answer cannot be read: {type(error).__name__}: {error}")
            return
        self.deadline = monotonic() + limit_s
        if isinstance(content, LostProcessError):
            content = LostProcessError(f"{self.task.name}: {content}")
        match kind:
            case "result":
                self.outcome.set_result(content)
            case "failure":
                self.outcome.set_exception(content)
            case "told":
                told(self.task, *content)

    def lose(self, reason: str = "") -> None:
        """End the process, and fail its task for a reason, or because the process ended."""
        until = monotonic() + (0 if reason else LOOK_S)
        # Not `join`: it waits forever for a process that closed all its files.
        while self.process.is_alive() and monotonic() < until:
            sleep(0.01)
        code = self.process.exitcode
        self.end()
        if code == 0:  # nothing of ours ends a process that has a task
            self.outcome.set_exception(
                InputError(
                    f"{self.task.name}: a script or shader ended its process with exit code 0."
                    " Remove os._exit from it."
                )
            )
            return
        if code == -signal.SIGKILL:
            reason = "its process was killed (SIGKILL), usually because memory ran out."
        elif code is not None and code < 0:
            reason = f"its process died of {signal.Signals(-code).name} in native code."
        elif code is not None:
            reason = f"its process ended with exit code {code}."
        reason = reason or "its process no longer answered."
        self.outcome.set_exception(LostProcessError(f"{self.task.name}: {reason}"))

    def end(self) -> None:
        """End the process and its group."""
        self.is_over = True
        self.pipe.close()
        assert self.process.pid is not None
        with suppress(ProcessLookupError, PermissionError):  # no group yet, or only dead ones in it
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.kill()
        self.process.join()


def _work(pipe: Any, set_up: Callable[[], object]) -> NoReturn:
    """Do the tasks that come through the pipe, until it is closed."""
    # A group of its own, so that what a task starts ends with it.
    os.setpgid(0, 0)
    os.register_at_fork(after_in_child=pipe.close)  # only this process answers
    os.dup2(2, 1)  # standard output is for the parent's results
    threading.Thread(target=_end_with_parent, daemon=True).start()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent gets it too, and ends this process
    # The mask comes from the parent, which held signals back at the start.
    signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
    with suppress(Exception):  # the first task meets it, too, and answers with it
        once(set_up)
    while True:
        try:
            call = pipe.recv()
        except (EOFError, OSError):
            os._exit(0)  # the parent is gone
        function, arguments, tells = call
        kind, content = _answer(pipe, set_up, function, arguments, tells)
        _send(pipe, kind, content)
        del call, function, arguments, content  # what a task had must not outlive it


def _end_with_parent() -> None:
    parent = parent_process()
    assert parent is not None
    connection.wait([parent.sentinel])
    os.killpg(0, signal.SIGKILL)


def _answer(
    pipe: Any,
    set_up: Callable[[], object],
    function: Callable[..., Any],
    arguments: tuple[Any, ...],
    tells: bool,
) -> tuple[str, Any]:
    """Do a task; return the kind of the message about it, ``result`` or ``failure``, and which."""
    if tells:
        arguments = (*arguments, lambda *state: _send(pipe, "told", state))
    try:
        once(set_up)
        return "result", function(*arguments)
    except FotismosError as error:
        return "failure", error
    except BaseException as error:  # Ctrl-C is ignored here: this is the task's own
        LOGGER.info("a task failed", exc_info=True)
        return "failure", LostProcessError(f"{type(error).__name__}: {error}")


def _send(pipe: Any, kind: str, content: Any) -> None:
    try:
        pipe.send((kind, content))
    except OSError:  # the parent is gone, or this is a fork
        os._exit(0)
    except Exception as error:  # pickling can raise anything
        reason = f"its result cannot be sent: {type(error).__name__}: {error}"
        pipe.send(("failure", LostProcessError(reason)))
