"""One process that does tasks, as seen from the process that asks and from within.

Each leads a process group of its own, which ends as a whole: with the process, when its time is
over, and when the process that asked for the work ends, in whatever way.
"""

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
"""Where Linux reads which process to end first when memory runs out."""

GUARD = ("/bin/sh", "-c", "read _; kill -9 0")
"""Ends its process group as soon as there is nobody left who could write to its input."""

GRACE_S = 1.0
"""Seconds in which a process may end by itself."""

PAUSE_S = 0.01
"""Seconds between looks at whether a process that was told to end has ended."""

LOGGER = logging.getLogger(__name__)
"""Told where an unexpected error came from."""

_numbers = count()
_is_spent = False


def end_after_task() -> None:
    """End this process of a pool once its task is done: other tasks are to find a clean one."""
    global _is_spent
    _is_spent = True


@dataclass(frozen=True)
class Task:
    """A call of ``function(*arguments)``, both of which can be pickled.

    ``name`` stands in messages. ``progress``, where it is given, is called in the process that
    asked; the function takes what calls it as one more argument. A process that somebody kills
    loses nothing: the task is given to another one, once.
    """

    name: str
    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    progress: Callable[..., None] | None = None


class Worker:
    """One process, as seen from the one that asked."""

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
        resource_tracker.ensure_running()  # here, for it lets signals through afterwards
        with held_back(), _temporary_files_in(self._folder):
            self.process.start()
        theirs.close()  # so that the end of the process is the end of the pipe
        self._send(prepare)

    def give(self, task: Task, limit_s: float, is_second_try: bool = False) -> None:
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
        except Exception as error:  # whatever cannot be unpickled here
            self.lose(f"its answer cannot be read: {type(error).__name__}: {error}")
            return
        if number != self.number:  # an answer to nothing that was asked
            return
        self.deadline = monotonic() + limit_s
        if kind == "progress":
            self.task.progress(*content)
        elif kind == "unexpected":
            self.outcome.set_exception(LostProcessError(f"{self.task.name}: {content}"))
        else:
            getattr(self.outcome, kind)(content)

    def gone(self) -> None:
        """Say as the outcome of the task that the process ended."""
        code = self.end()
        self.was_killed = code == -signal.SIGKILL
        self.lose(_reason(code))

    def lose(self, reason: str) -> None:
        """End the process, and say why as the outcome of its task."""
        self.end()
        self.outcome.set_exception(LostProcessError(f"{self.task.name}: {reason}"))

    def end(self, grace_s: float = GRACE_S) -> int | None:
        """End the process with its group, and return its exit code; nothing of it is left."""
        self.is_spent = True
        self.pipe.close()
        until = monotonic() + grace_s
        # Not by `join`, which waits for ever for a process that closed all its files.
        while self.process.is_alive() and monotonic() < until:
            sleep(PAUSE_S)
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
    """Say what is known about a process that ended."""
    if code == -signal.SIGKILL:
        return "its process was killed (SIGKILL), most often by the system when memory runs out."
    if code is not None and code < 0:
        return f"its process died of {signal.Signals(-code).name} in native code."
    return f"its process ended with exit code {code}."


def _temporary_folder() -> str | None:
    """Make a folder for temporary files of one process; None where there is no place for any."""
    try:
        return mkdtemp(prefix="fotismos-")
    except OSError:
        return None


@contextmanager
def _temporary_files_in(folder: str | None) -> Iterator[None]:
    """Let processes that are started meanwhile, and theirs, put temporary files into a folder."""
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
    """Yield processes that began with that folder, in whatever group or session they are."""
    mark = b"TMPDIR=" + os.fsencode(folder) + b"\0"
    for place in Path("/proc").glob("[0-9]*/environ"):
        with suppress(OSError):
            if mark in place.read_bytes():
                yield int(place.parent.name)


def _work(pipe: Any) -> NoReturn:
    """Do what comes through the pipe, until it is closed."""
    os.setpgid(0, 0)
    os.set_inheritable(pipe.fileno(), False)  # by what this starts: its end is the pipe's
    os.register_at_fork(after_in_child=pipe.close)  # only this process answers
    os.dup2(2, 1)  # standard output is for the results of the process that asked
    guard = subprocess.Popen(GUARD, stdin=parent_process().sentinel)  # noqa: F841  lives as long
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent is told as well, and ends this
    signal.pthread_sigmask(signal.SIG_UNBLOCK, HELD_BACK)
    if FIRST_VICTIM.exists():
        FIRST_VICTIM.write_text("1000")
    waiting = [_asked(pipe)]  # what prepares, until it has
    while True:
        number, *call = _asked(pipe)
        _tell(pipe, number, *_answer(pipe, number, waiting, *call))


def _asked(pipe: Any) -> Any:
    try:
        return pipe.recv()
    except (EOFError, OSError):
        os._exit(0)  # nobody is there any more


def _answer(
    pipe: Any,
    number: int,
    waiting: list[Callable[[], object]],
    function: Callable[..., Any],
    arguments: tuple,
    with_progress: bool,
) -> tuple[str, Any]:
    """Return how a task ended, and what of it: the method of its outcome to call, and with what."""

    def progress(*told: Any) -> None:
        _tell(pipe, number, "progress", told)

    try:
        while waiting:
            waiting[0]()
            waiting.pop()
        return "set_result", function(*arguments, *([progress] if with_progress else []))
    except FotismosError as error:
        return "set_exception", error
    except BaseException as error:  # Ctrl-C is ignored here: whatever comes is the task's own
        LOGGER.info("a task failed", exc_info=True)
        return "unexpected", f"{type(error).__name__}: {error}"


def _tell(pipe: Any, number: int, kind: str, content: Any) -> None:
    try:
        pipe.send((number, kind, content, _is_spent))
    except OSError:  # nobody listens, or this is the fork of a process that answers
        os._exit(0)
    except Exception as error:  # what cannot be pickled
        told = f"its result cannot be sent: {type(error).__name__}: {error}"
        pipe.send((number, "unexpected", told, _is_spent))
