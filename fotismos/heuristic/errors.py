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
    return InputError(
        f"{what} {given!r} is not known{suggestion(given, allowed)}: choose one of"
        f" {', '.join(allowed)}."
    )


def suggestion(given: object, allowed: Iterable[str]) -> str:
    """Return a question that suggests the nearest allowed word; empty if none is near."""
    near = get_close_matches(str(given), list(allowed), n=1)
    return f" (did you mean {near[0]}?)" if near else ""


def type_of(value: object) -> str:
    """Return the words for a value of a wrong type, such as ``of type tuple of 2``."""
    shape = f" of shape {value.shape}" if hasattr(value, "shape") else ""
    if isinstance(value, (list, tuple)):
        shape = f" of {len(value)}"
    kind = f"{type(value).__module__}.{type(value).__qualname__}{shape}"
    return f"of type {kind}".replace("builtins.", "")
