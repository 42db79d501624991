"""Which versions of Mitsuba fotismos works with, and which one its documented numbers are of."""

import re
from importlib import metadata

from fotismos.heuristic.errors import InstallationError
from fotismos.heuristic.program import installation

TESTED = (3, 9, 1)
"""The version that the documentation's figures and this project's baselines were made with."""

NAME = ".".join(map(str, TESTED))
REQUIREMENT = f"mitsuba~={NAME}"
"""What pip installs: this version, or a later one with the same first two numbers."""


def require_mitsuba() -> None:
    """Raise `InstallationError` unless the installed Mitsuba is one that fotismos works with."""
    version = metadata.version("mitsuba")
    numbers = _numbers(version)
    if numbers < TESTED or numbers[:2] != TESTED[:2]:
        major, minor, _ = TESTED
        raise InstallationError(
            f"Mitsuba {version} is installed, and fotismos needs {NAME} or a later"
            f" {major}.{minor}. Install it: {installation(REQUIREMENT)}"
        )


def other_version() -> str:
    """Return what to know of a Mitsuba that is not the tested one; empty if it is."""
    version = metadata.version("mitsuba")
    if version == NAME:
        return ""
    return (
        f"The documentation's numbers are of Mitsuba {NAME}. With {version} the noise may be"
        " another, and `check` may find that old baselines moved."
    )


def _numbers(version: str) -> tuple[int, ...]:
    """Return the numbers at the start of a version, such as (3, 9, 1) of ``3.9.1.post2``."""
    start = re.match(r"\d+(\.\d+)*", version)
    return tuple(map(int, start[0].split("."))) if start else ()
