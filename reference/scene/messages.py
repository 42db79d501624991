"""Mitsuba's messages about a scene while it is read, made and rendered.

Mitsuba's logger writes to standard output, which is for results. Here its messages are collected,
so a record can state them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import mitsuba as mi


class _Listener(mi.Appender):
    """Mitsuba's messages, one call each; progress is shown by commands themselves."""

    def __init__(self, hear: Callable[[str], Any]) -> None:
        super().__init__()
        self._hear = hear

    def append(self, level: mi.LogLevel, text: str) -> None:
        self._hear(text)

    def log_progress(self, *progress: Any) -> None:
        pass


class _Plain(mi.Formatter):
    """Only the words of a message, without time, thread and line of code."""

    def format(self, *parts: Any) -> str:
        return parts[-1]


def divert(hear: Callable[[str], Any]) -> None:
    """Send Mitsuba's messages from now on to ``hear``, one or more lines at a time."""
    logger = mi.logger()
    logger.clear_appenders()
    logger.set_formatter(_Plain())
    logger.add_appender(_Listener(hear))


@contextmanager
def collected(into: list[str]) -> Iterator[None]:
    """Collect Mitsuba's messages while the block runs, and keep them from their former target."""
    logger = mi.logger()
    appenders = [logger.appender(number) for number in range(logger.appender_count())]
    formatter = logger.formatter()
    divert(into.append)
    try:
        yield
    finally:
        logger.clear_appenders()
        logger.set_formatter(formatter)
        for appender in appenders:
            logger.add_appender(appender)


def counted(messages: Iterable[str]) -> tuple[str, ...]:
    """Return each message once, in order, with its count if it was repeated.

    Each line is a message here.
    """
    lines = Counter(" ".join(message.split()) for message in messages)
    return tuple(
        f"Mitsuba: {line}" + (f" ({count} times)" if count > 1 else "")
        for line, count in lines.items()
    )
