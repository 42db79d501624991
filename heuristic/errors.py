"""Every error that fotismos raises on purpose.

::

    FotismosError
    ├── InputError         a scene, value or option that cannot be used     exit code 2
    ├── OutputError        a place that cannot be written to                exit code 2
    ├── InstallationError  something that must be on the machine is not     exit code 2
    ├── NonFiniteError     a NaN or an infinity in an image                 exit code 1
    └── LostProcessError   a process that work was given to is gone         exit code 1

A message names the value, what is allowed and what to do next. The command line prints it without
a traceback and leaves with the class's `exit_code`.
"""

from collections.abc import Iterable
from difflib import get_close_matches


class FotismosError(Exception):
    """Base of the errors that fotismos raises on purpose; catch it to catch them all."""

    exit_code = 1


class InputError(FotismosError):
    """A scene, a value or an option that cannot be used as it was given."""

    exit_code = 2


class OutputError(FotismosError):
    """A place that results cannot be written to: a full disk, missing rights, a name in use."""

    exit_code = 2


class InstallationError(FotismosError):
    """Something that must be on the machine is missing, or is there in an unusable version."""

    exit_code = 2


class NonFiniteError(FotismosError):
    """A NaN or an infinity in an image; the message says in which, and where."""

    exit_code = 1


class LostProcessError(FotismosError):
    """A process, or a scheduler, that work was given to is gone; what it finished is kept."""

    exit_code = 1


def unknown(what: str, given: object, allowed: Iterable[str]) -> InputError:
    """Return the error for a word that is not among those allowed.

    ``what`` stands before the word, such as ``loss`` or ``form =``.
    """
    allowed = list(allowed)
    return InputError(
        f"{what} {given!r} is not known{suggestion(given, allowed)}: choose one of"
        f" {', '.join(allowed)}."
    )


def suggestion(given: object, allowed: Iterable[str]) -> str:
    """Return the question whether the nearest of the words allowed is meant; empty if none is."""
    near = get_close_matches(str(given), list(allowed), n=1)
    return f" (did you mean {near[0]}?)" if near else ""
