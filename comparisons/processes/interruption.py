"""Signals that end a command: the first lets it clear up, a second one ends it at once."""

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

SIGNALS = {
    number
    for number in (signal.SIGINT, signal.SIGTERM, getattr(signal, "SIGHUP", None))
    if number is not None
}
"""Ctrl-C, what ends a job, and the end of a terminal."""

HELD_BACK = SIGNALS | {signal.SIGALRM}
"""What can raise an interruption: an alarm stands for a signal that came during an import."""

PAUSE_S = 0.02
"""Seconds after which a signal that came during an import is looked at again."""

_is_held_back = False


class Interrupted(KeyboardInterrupt):
    """A command was told to end; ``exit_code`` is what a shell expects then: 130, 143 or 129."""

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
    """Let interruptions wait while the block runs, and by the mask in what is started there.

    The mask is of this thread alone: another one may take a signal, and have it handled here.
    """
    global _is_held_back
    before = signal.pthread_sigmask(signal.SIG_BLOCK, HELD_BACK)
    _is_held_back = True
    try:
        yield
    finally:
        _is_held_back = False
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def code_of(error: BaseException | None) -> int:
    """Return the exit code for an interruption."""
    return getattr(error, "exit_code", 128 + signal.SIGINT)


def _interrupt(number: int, frame: FrameType | None) -> None:
    for each in SIGNALS:
        if signal.getsignal(each) is _interrupt:
            signal.signal(each, lambda number, _: os._exit(128 + number))
    if not (_is_held_back or _is_importing(frame)):
        raise Interrupted(number)
    # Native modules that are just loaded crash, or swallow what is raised: later, then.
    signal.signal(signal.SIGALRM, lambda _, frame: _interrupt(number, frame))
    signal.setitimer(signal.ITIMER_REAL, PAUSE_S)


def _is_importing(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename == "<frozen importlib._bootstrap>":
            return True
        frame = frame.f_back
    return False
