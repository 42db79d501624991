"""Signals that end a command: the first lets it clean up, a second ends it at once."""

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

NAMES = ("SIGINT", "SIGTERM", "SIGHUP")
SIGNALS = {signal.Signals[name] for name in NAMES if name in signal.Signals.__members__}
"""Ctrl-C, the end of a job, and the end of a terminal, which Windows does not signal."""

PAUSE_S = 0.02
"""Seconds after which a signal that arrived in delicate code is tried again."""

DELICATE = "<frozen importlib._bootstrap>", "popen_spawn_posix.py"
"""Files whose functions must end: a native module that is loading would crash or swallow the
exception, and a process that is starting would print that its parent is gone. A blocked signal can
still arrive there: another thread takes it, and Python calls the handler in the main one."""


class Interrupted(KeyboardInterrupt):
    """A command received a signal to end; ``exit_code`` is what shells expect: 130, 143 or 129."""

    def __init__(self, number: int) -> None:
        super().__init__(signal.Signals(number).name)
        self.exit_code = 128 + number


def listen() -> None:
    """Raise :class:`Interrupted` in this process for each of `SIGNALS` that is not ignored."""
    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:  # nohup
            signal.signal(number, _interrupt)


@contextmanager
def held_back() -> Iterator[None]:
    """Delay interruptions while the block runs; processes that it starts inherit the mask."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def code_of(error: BaseException | None) -> int:
    """Return the exit code for an interruption."""
    return getattr(error, "exit_code", 128 + signal.SIGINT)


def _interrupt(number: int, frame: FrameType | None) -> None:
    # From here on another signal ends the process at once.
    for handled in SIGNALS:
        if signal.getsignal(handled) is _interrupt:
            signal.signal(handled, lambda number, _: os._exit(128 + number))
    if not _is_delicate(frame) or not hasattr(signal, "setitimer"):
        raise Interrupted(number)
    # An alarm tries again, in whatever code runs by then.
    signal.signal(signal.SIGALRM, lambda _, frame: _interrupt(number, frame))
    signal.setitimer(signal.ITIMER_REAL, PAUSE_S)


def _is_delicate(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename.endswith(DELICATE):
            return True
        frame = frame.f_back
    return False
