"""How the program was started, so users can paste the commands that it prints."""

import os
import shlex
import sys

VARIABLE = "FOTISMOS_PROGRAM"
"""Environment variable with the words that start the program, such as ``./run``."""


def program() -> list[str]:
    """Return the words that start the program."""
    return shlex.split(os.environ.get(VARIABLE, "")) or ["fotismos"]


def command(*words: object) -> str:
    """Return a command of the program, as a shell takes it."""
    return shlex.join([*program(), *map(str, words)])


def installation(*packages: str) -> str:
    """Return the command that installs packages for this interpreter, as a shell takes it."""
    return shlex.join([sys.executable, "-m", "pip", "install", *packages])
