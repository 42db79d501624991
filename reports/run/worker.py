"""A process that compares the scenes of a batch, so that one which kills it takes no other along.

One process does scene after scene, so that start-up is paid once; a new one takes the place of one
that died.
"""

import ctypes
import os
import signal
import traceback
from multiprocessing import get_context
from pathlib import Path

from heuristic.errors import FotismosError, LostProcessError
from reports.run import single

FIRST_VICTIM = Path("/proc/self/oom_score_adj")
"""Where Linux reads which process to end first when memory runs out."""

DIE_WITH_PARENT = 1
"""PR_SET_PDEATHSIG of Linux's prctl(2)."""


class Worker:
    """Runs `single.compare` in a process of its own; a context that ends the process."""

    def __init__(self):
        self._process = self._pipe = None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._end()

    def compare(self, name, folder, place, wanted, progress):
        """Do what `single.compare` does.

        Raises
        ------
        FotismosError
            What it raised there.
        LostProcessError
            When the process ended, or anything else was raised.
        """
        if self._process is None:
            self._start()
        try:
            self._pipe.send((name, folder, place, wanted))
            while True:
                kind, content = self._pipe.recv()
                if kind == "progress":
                    progress(*content)
                elif kind == "done":
                    return content
                else:
                    raise content
        except (EOFError, OSError):
            code = self._end()
            raise LostProcessError(f"{place}: {_reason(code)}") from None

    def _start(self):
        context = get_context("spawn")  # a fork would share threads' locks with its parent
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_work, args=(theirs,), daemon=True)
        self._process.start()
        theirs.close()  # so that the end of the process is the end of the pipe

    def _end(self):
        """End the process, and return its exit code."""
        if self._process is None:
            return None
        self._pipe.close()
        self._process.join(1.0)
        self._process.kill()
        self._process.join()
        code, self._process = self._process.exitcode, None
        return code


def _reason(code):
    """Say what is known about a process that ended."""
    if code == -signal.SIGKILL:
        return "its process was killed (SIGKILL), most often by the system when memory runs out."
    if code is not None and code < 0:
        return f"its process died of {signal.Signals(-code).name} in native code."
    return f"its process ended with exit code {code}."


def _work(pipe):
    """Compare what comes through the pipe, until it is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent is told as well, and ends this
    if FIRST_VICTIM.exists():
        FIRST_VICTIM.write_text("1000")
        ctypes.CDLL(None).prctl(DIE_WITH_PARENT, signal.SIGKILL)
    single.load()

    def progress(*told):
        pipe.send(("progress", told))

    try:
        while True:
            pipe.send(_answer(pipe.recv(), progress))
    except (EOFError, ConnectionError):
        os._exit(0)  # nobody is listening any more


def _answer(asked, progress):
    try:
        return "done", single.compare(*asked, progress)
    except FotismosError as error:
        return "failed", error
    except ConnectionError:
        raise
    except Exception as error:  # whatever a scene brings about is its own failure
        traceback.print_exc()
        return "failed", LostProcessError(f"{asked[2]}: {type(error).__name__}: {error}")
