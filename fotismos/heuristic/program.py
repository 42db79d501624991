"""The program: its version, a digest of its sources, and the commands that it prints."""

import hashlib
import os
import shlex
import sys
from functools import lru_cache
from pathlib import Path

__version__ = "0.4.0"

PACKAGE = Path(__file__).resolve().parents[1]
"""The folder of the package, which holds the four rooms."""

VARIABLE = "FOTISMOS_PROGRAM"
"""Environment variable with the words that start the program, such as ``./run``."""


@lru_cache
def source_digest() -> str:
    """Return a digest of the sources where fotismos runs from a checkout; empty if installed."""
    if not (PACKAGE.parent / "pyproject.toml").is_file():
        return ""
    whole = hashlib.sha256()
    for path in sorted(PACKAGE.rglob("*.*")):
        if "__pycache__" not in path.parts and path.is_file():
            whole.update(f"{path.relative_to(PACKAGE)}\0".encode())
            whole.update(hashlib.sha256(path.read_bytes()).digest())
    return whole.hexdigest()


def program() -> list[str]:
    """Return the words that start the program."""
    return shlex.split(os.environ.get(VARIABLE, "")) or ["fotismos"]


def command(*arguments: object) -> str:
    """Return a command of the program, as a shell takes it."""
    return shlex.join([*program(), *map(str, arguments)])


def installation(*packages: str) -> str:
    """Return the command that installs packages for this interpreter, as a shell takes it."""
    return shlex.join([sys.executable, "-m", "pip", "install", *packages])
