"""Every error that fotismos raises on purpose.

::

    FotismosError
    ├── InputError         a scene, value or option that cannot be used     exit code 2
    ├── OutputError        a place that cannot be written to                exit code 2
    ├── InstallationError  something required is not on the machine         exit code 2
    ├── NonFiniteError     a NaN or an infinity in an image                 exit code 1
    └── LostProcessError   a process that had work to do is gone            exit code 1

A message names the value, what is allowed and what to do next. The command line prints it without a
traceback and exits with the class's `exit_code`.
"""

from collections.abc import Iterable
from difflib import get_close_matches
from functools import wraps
from inspect import signature
from typing import Any, TypeVar

Kind = TypeVar("Kind")


class FotismosError(Exception):
    """Base of the errors that fotismos raises on purpose; catch it to catch them all."""

    exit_code = 1


class InputError(FotismosError):
    """A scene, a value or an option that cannot be used as given."""

    exit_code = 2


class OutputError(FotismosError):
    """A place that results cannot be written to: a full disk, missing rights, a name in use."""

    exit_code = 2


class InstallationError(FotismosError):
    """Something required on the machine is missing, or its version is unusable."""

    exit_code = 2


class NonFiniteError(FotismosError):
    """A NaN or an infinity in an image; the message names the image and the place."""


class LostProcessError(FotismosError):
    """A process or scheduler that had work to do is gone; the finished work is kept."""


def unknown(what: str, given: object, allowed: Iterable[str]) -> InputError:
    """Return the error for a word that is not allowed.

    ``what`` stands before the word, such as ``loss`` or ``form =``.
    """
    allowed = list(allowed)
    choice = f"choose one of {', '.join(allowed)}" if allowed else "there is none, so omit it"
    return InputError(f"{what} {given!r} is not known{suggestion(given, allowed)}: {choice}.")


def suggestion(given: object, allowed: Iterable[str], least: float = 0.6) -> str:
    """Return a question that suggests the nearest allowed word; empty if none is near.

    ``least`` is the share of letters in common, in their order, from which a word is near.
    """
    near = get_close_matches(str(given), list(allowed), n=1, cutoff=least)
    return f" (did you mean {near[0]}?)" if near else ""


def with_known_words(kind: type[Kind]) -> type[Kind]:
    """Let a class answer a misspelt keyword with an `InputError` that suggests the right one."""
    make = kind.__init__
    known = list(signature(kind).parameters)

    @wraps(make)
    def checked(self: Kind, *values: Any, **words: Any) -> None:
        for word in words:
            if word not in known:
                raise unknown(f"{kind.__name__}: parameter", word, known)
        make(self, *values, **words)

    setattr(kind, "__init__", checked)  # noqa: B010  mypy refuses the plain form
    return kind


def type_of(value: object) -> str:
    """Return the words for a value of a wrong type, such as ``of type tuple of 2``."""
    shape = f" of shape {value.shape}" if hasattr(value, "shape") else ""
    if isinstance(value, (list, tuple)):
        shape = f" of {len(value)}"
    kind = f"{type(value).__module__}.{type(value).__qualname__}{shape}"
    return f"of type {kind}".replace("builtins.", "")
