"""One process that does tasks, as seen by its parent and from within.

Each leads its own process group, which ends as a whole: with the process, when its time is up, or
when the parent ends in any way.
"""

import gc
import logging
import os
import shutil
import signal
import subprocess
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import count
from multiprocessing import get_context, parent_process, resource_tracker
from pathlib import Path
from tempfile import mkdtemp
from time import monotonic, sleep
from typing import Any, NoReturn

from comparisons.processes.interruption import HELD_BACK, held_back
from heuristic.errors import FotismosError, LostProcessError

FIRST_VICTIM = Path("/proc/self/oom_score_adj")
"""Where Linux reads how readily to kill a process when memory runs out."""

GUARD = ("/bin/sh", "-c", "read _; kill -9 0")
"""Ends its process group as soon as no process is left that could write to its input."""

GRACE_S = 1.0
"""Seconds in which a process may end by itself."""

PAUSE_S = 0.01
"""Seconds between checks whether a process has ended."""

LOGGER = logging.getLogger(__name__)
"""Receives the traceback of unexpected errors."""

_numbers = count()
_is_spent = False


def end_after_task() -> None:
    """End this process of a pool once its task is done: other tasks need a clean one."""
    global _is_spent
    _is_spent = True


@dataclass(frozen=True)
class Task:
    """A call of ``function(*arguments)``, both of them picklable.

    ``name`` appears in messages. ``progress``, if given, is called in the parent; the function
    takes a callable that forwards to it as its last argument. If its process is killed, the task
    is given to another one, once.
    """

    name: str
    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    progress: Callable[..., None] | None = None


class Worker:
    """One process, as seen by its parent."""

    task: Task
    outcome: Future[Any]
    deadline: float
    number: int
    is_second_try: bool

    def __init__(self, prepare: Callable[[], object]) -> None:
        context = get_context("spawn")  # a fork would share threads' locks with its parent
        self.is_spent = self.was_killed = False
        self.pipe, theirs = context.Pipe()
        self._folder = _temporary_folder()
        self.process = context.Process(target=_work, args=(theirs,), daemon=True)
        resource_tracker.ensure_running()  # here, because it unblocks signals
        with held_back(), _temporary_files_in(self._folder):
            self.process.start()
        theirs.close()  # the end of the process must be the end of the pipe
        self._send(prepare)

    def give(self, task: Task, limit_s: float, is_second_try: bool = False) -> None:
        """Send a task, which has ``limit_s`` seconds until its first sign of progress."""
        self.task, self.outcome, self.number = task, Future(), next(_numbers)
        self.is_second_try = is_second_try
        self.deadline = monotonic() + limit_s
        self._send((self.number, task.function, task.arguments, task.progress is not None))

    def receive(self, limit_s: float) -> None:
        """Take one message, which may be the outcome of the task."""
        try:
            number, kind, content, self.is_spent = self.pipe.recv()
        except (EOFError, OSError):
            self.gone()
            return
        except Exception as error:  # unpickling can raise anything
            self.lose(f"its answer cannot be read: {type(error).__name__}: {error}")
            return
        if number != self.number:  # an answer to another task
            return
        self.deadline = monotonic() + limit_s
        if kind == "progress":
            if self.task.progress:
                self.task.progress(*content)
        elif kind == "unexpected":
            self.outcome.set_exception(LostProcessError(f"{self.task.name}: {content}"))
        else:
            getattr(self.outcome, kind)(content)

    def gone(self) -> None:
        """Fail the task because the process ended."""
        code = self.end()
        self.was_killed = code == -signal.SIGKILL
        self.lose(_reason(code))

    def lose(self, reason: str) -> None:
        """End the process, and fail its task for that reason."""
        self.end()
        self.outcome.set_exception(LostProcessError(f"{self.task.name}: {reason}"))

    def end(self, grace_s: float = GRACE_S) -> int | None:
        """End the process and its group, delete its files, and return its exit code."""
        self.is_spent = True
        self.pipe.close()
        until = monotonic() + grace_s
        # Not `join`: it waits forever for a process that closed all its files.
        while self.process.is_alive() and monotonic() < until:
            sleep(PAUSE_S)
        assert self.process.pid is not None
        with suppress(ProcessLookupError, PermissionError):  # no group yet, or only dead ones in it
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.kill()
        self.process.join()
        if self._folder:
            for pid in _processes_of(self._folder):
                with suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
            shutil.rmtree(self._folder, ignore_errors=True)
        return self.process.exitcode

    def _send(self, message: object) -> None:
        with suppress(ConnectionError):  # a process that is gone is noticed in `receive`
            self.pipe.send(message)


def _reason(code: int | None) -> str:
    """Return why a process ended."""
    if code == -signal.SIGKILL:
        return "its process was killed (SIGKILL), usually because memory ran out."
    if code is not None and code < 0:
        return f"its process died of {signal.Signals(-code).name} in native code."
    return f"its process ended with exit code {code}."


def _temporary_folder() -> str | None:
    """Make a folder for the temporary files of one process; None if that is impossible."""
    try:
        return mkdtemp(prefix="fotismos-")
    except OSError:
        return None


@contextmanager
def _temporary_files_in(folder: str | None) -> Iterator[None]:
    """Direct temporary files of processes started in the block, and of theirs, to a folder."""
    before = os.environ.get("TMPDIR")
    if folder:
        os.environ["TMPDIR"] = folder
    try:
        yield
    finally:
        if before is None:
            os.environ.pop("TMPDIR", None)
        else:
            os.environ["TMPDIR"] = before


def _processes_of(folder: str) -> Iterator[int]:
    """Yield the processes that started with that folder, in any group or session."""
    mark = b"TMPDIR=" + os.fsencode(folder) + b"\0"
    for place in Path("/proc").glob("[0-9]*/environ"):
        with suppress(OSError):
            if mark in place.read_bytes():
                yield int(place.parent.name)


def _work(pipe: Any) -> NoReturn:
    """Do the tasks that come through the pipe, until it is closed."""
    os.setpgid(0, 0)
    os.set_inheritable(pipe.fileno(), False)  # children must not keep it open
    os.register_at_fork(after_in_child=pipe.close)  # only this process answers
    os.dup2(2, 1)  # standard output is for the parent's results
    parent = parent_process()
    assert parent is not None
    guard = subprocess.Popen(GUARD, stdin=parent.sentinel)  # noqa: F841  lives as long
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent gets it too, and ends this process
    signal.pthread_sigmask(signal.SIG_UNBLOCK, HELD_BACK)
    if FIRST_VICTIM.exists():
        FIRST_VICTIM.write_text("1000")
    waiting = [_asked(pipe)]  # the preparation, until it succeeds
    while True:
        number, *call = _asked(pipe)
        _tell(pipe, number, *_answer(pipe, number, waiting, *call))
        del call
        gc.collect()
        gc.freeze()  # what outlives a task stays: later collections need not look at it


def _asked(pipe: Any) -> Any:
    try:
        return pipe.recv()
    except (EOFError, OSError):
        os._exit(0)  # the parent is gone


def _answer(
    pipe: Any,
    number: int,
    waiting: list[Callable[[], object]],
    function: Callable[..., Any],
    arguments: tuple[Any, ...],
    with_progress: bool,
) -> tuple[str, Any]:
    """Do a task; return the method of its outcome to call, and the argument."""

    def progress(*told: Any) -> None:
        _tell(pipe, number, "progress", told)

    try:
        while waiting:
            waiting[0]()
            waiting.pop()
        return "set_result", function(*arguments, *([progress] if with_progress else []))
    except FotismosError as error:
        return "set_exception", error
    except BaseException as error:  # Ctrl-C is ignored here: this is the task's own
        LOGGER.info("a task failed", exc_info=True)
        return "unexpected", f"{type(error).__name__}: {error}"


def _tell(pipe: Any, number: int, kind: str, content: Any) -> None:
    try:
        pipe.send((number, kind, content, _is_spent))
    except OSError:  # the parent is gone, or this is a fork
        os._exit(0)
    except Exception as error:  # pickling can raise anything
        told = f"its result cannot be sent: {type(error).__name__}: {error}"
        pipe.send((number, "unexpected", told, _is_spent))
