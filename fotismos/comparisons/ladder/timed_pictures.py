"""Settings of another renderer as a user gives them: ``NAME @ TIME=PATTERN``.

The name ends at the first ``@ TIME=``, so it may hold at signs and equals signs, too. A time is a
number above 0 with a unit, such as ``6.3ms``, ``1.5 s`` or ``120us``.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from fotismos.comparisons.atomic import printable
from fotismos.heuristic.errors import InputError

UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6}
"""Units of times, in seconds; both letters for micro are in use."""

TIME = re.compile(rf"((?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)\s*({'|'.join(UNITS)})")

SHORTEST_S = 1e-9
LONGEST_S = 1e6
"""Seconds of an image, at least and at most."""

FORM = "write NAME @ TIME=PATTERN, such as 'PCSS low @ 6.3ms=low_*.exr'"


def seconds_of(text: str) -> float:
    """Return the seconds of a time with a unit; InputError for any other text."""
    match = TIME.fullmatch(text.strip())
    value = float(match[1]) * UNITS[match[2]] if match else 0.0
    if not SHORTEST_S <= value <= LONGEST_S:
        raise InputError(
            f"{printable(text.strip())!r} is not a time: give a number with s, ms or us, from 1e-9s"
            " to 1e6s, such as 6.3ms."
        )
    return value


@dataclass(frozen=True)
class TimedPicture:
    """A setting: its name, the time of its picture, and patterns of the picture's files.

    ``word`` is how it was given.
    """

    name: str
    seconds: float
    patterns: tuple[str, ...]
    word: str

    @classmethod
    def of(cls, word: str) -> "TimedPicture":
        """Parse ``NAME @ TIME=PATTERN``; InputError for a part that is missing or not allowed."""
        try:
            word.encode()
        except UnicodeEncodeError as error:
            raise InputError(f"{printable(word)}: it is not in UTF-8. Rename it.") from error
        refusal = None
        for equals in re.finditer("=", word):
            name, at, time = word[: equals.start()].rpartition("@")
            if not at:
                continue
            try:
                seconds = seconds_of(time)
            except InputError as error:
                refusal = refusal or error
                continue
            pattern = word[equals.end() :]
            if not name.strip() or not pattern.strip():
                missing = "picture" if name.strip() else "name"
                raise InputError(f"{word!r} has no {missing}: {FORM}.")
            return cls(name=name.strip(), seconds=seconds, patterns=(pattern,), word=word)
        if refusal:
            raise InputError(f"{word!r}: {refusal} A picture with its time: {FORM}.")
        raise InputError(f"{word!r} has no time, which a front needs: {FORM}.")


@dataclass(frozen=True)
class EngineTimes:
    """Settings with their times, the machine that they were measured on, and the kernel's time.

    ``machine`` is in the user's words, and empty if not known. ``kernel_time`` is the time of the
    textbook kernel on that machine, as it was typed. Raises `InputError` for a name that is given
    twice, or what is not a time.
    """

    pictures: tuple[TimedPicture, ...]
    machine: str = ""
    kernel_time: str | None = None

    def __post_init__(self) -> None:
        if self.kernel_time is not None:
            seconds_of(self.kernel_time)
        names = [picture.name for picture in self.pictures]
        for name in names:
            if names.count(name) > 1:
                raise InputError(
                    f"{names.count(name)} pictures are called {name!r}: give each setting a name of"
                    " its own; repeats of one setting share a pattern."
                )

    @classmethod
    def of(
        cls, words: Sequence[str], machine: str | None, kernel_time: str | None
    ) -> "EngineTimes | None":
        """Return what a user typed; None without pictures, which the others need."""
        return cls.given([TimedPicture.of(word) for word in words], machine, kernel_time)

    @classmethod
    def given(
        cls, pictures: Sequence[TimedPicture], machine: str | None, kernel_time: str | None
    ) -> "EngineTimes | None":
        """Return the settings with what their times are of; None without pictures."""
        if pictures:
            return cls(pictures=tuple(pictures), machine=machine or "", kernel_time=kernel_time)
        if machine or kernel_time:
            raise InputError(
                f"machine {machine or kernel_time!r}: it says what given times are of."
                f" Give a picture: {FORM}."
            )
        return None

    def as_options(self) -> dict[str, Any]:
        """Return the options of the command that gives the same."""
        return {
            "picture": [picture.word for picture in self.pictures],
            "machine": self.machine or None,
            "kernel_time": self.kernel_time,
        }

    @property
    def kernel_s(self) -> float | None:
        """Seconds of the textbook kernel on that machine."""
        return None if self.kernel_time is None else seconds_of(self.kernel_time)
