"""The program: its version, a digest of its sources, what it runs on, and commands it prints."""

import hashlib
import os
import platform
import shlex
import sys
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path

__version__ = "0.4.0"

PICTURE_LIBRARIES = ("numpy", "colour-science", "OpenEXR", "pillow")
"""What a comparison of two pictures depends on."""

LIBRARIES = ("mitsuba", "drjit", "numpy", "colour-science", "OpenEXR")
"""What a comparison of a scene depends on."""

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


def cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def versions(libraries: Iterable[str] = LIBRARIES) -> dict[str, str]:
    """Return the versions that a result depends on, and with Dr.Jit LLVM's."""
    numbers = {"fotismos": __version__, "python": platform.python_version()}
    numbers |= {library: _version(library) for library in libraries}
    if "drjit" in numbers:
        import drjit as dr  # loaded late: two pictures are compared without it

        numbers["LLVM"] = ".".join(map(str, dr.detail.llvm_version()))
    return numbers


@lru_cache
def _version(library: str) -> str:
    from importlib import metadata  # loaded late: help needs no versions

    return metadata.version(library)


def program() -> list[str]:
    """Return the words that start the program."""
    return shlex.split(os.environ.get(VARIABLE, "")) or ["fotismos"]


def command(*arguments: object) -> str:
    """Return a command of the program, as a shell takes it."""
    return shlex.join([*program(), *map(str, arguments)])


def installation(*packages: str) -> str:
    """Return the command that installs packages for this interpreter, as a shell takes it."""
    return shlex.join([sys.executable, "-m", "pip", "install", *packages])
