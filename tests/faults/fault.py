"""What a fault is: how it is set up, the command that meets it, and what may come of it."""

import signal
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from tests.small_scene import SCENE

SMALL = ("--spp", "4", "--resolution", "16x16")
RESULTS = ("out/index.html", "out/run.json", "out/*/comparison.json", "out/*/comparison.exr")
"""What a comparison leaves, as patterns."""

CHECKED = "out/junit.xml"
UNPRIVILEGED = "exec setpriv --bounding-set -dac_override,-dac_read_search,-fowner "
"""Rights of files hold for root, too."""


@dataclass(frozen=True)
class Sent:
    """A signal that is sent while the command runs.

    ``when`` is a time in seconds, or a pattern of files: as soon as there is one. The signal goes
    to the ``main`` process, to its ``group``, or to its first ``worker``, once that is there.
    """

    number: signal.Signals
    when: float | str = 0.0
    to: str = "main"


@dataclass(frozen=True)
class Fault:
    """One fault, the command that meets it, and what may come of it.

    Attributes
    ----------
    name
        What is wrong.
    words
        Of the command; its current folder holds what ``prepare`` made, and ``out`` is for results.
    message
        Pattern of what has to be said where the exit code is not 0; None where nobody is left who
        could say anything.
    codes
        Exit codes that are allowed.
    results
        Patterns of files that are there where the exit code is 0.
    leaves
        Patterns of files that are there in any case.
    shell
        Script that runs the command, ``"$@"``.
    ours
        Patterns of files that the command, or what is run by it, may replace.
    """

    name: str
    words: tuple[str | bytes, ...]
    message: str | None
    codes: tuple[int, ...] = (2,)
    prepare: Callable[[Path], object] = lambda folder: None
    results: tuple[str, ...] = ()
    leaves: tuple[str, ...] = ()
    shell: str = 'exec "$@"'
    environment: Mapping[str, str] = field(default_factory=dict)
    sent: tuple[Sent, ...] = ()
    ours: tuple[str, ...] = ()


def with_scene(folder: Path) -> None:
    """Write the small scene to a.xml."""
    (folder / "a.xml").write_text(SCENE, encoding="utf-8")


def written(files: Mapping[str, str | bytes | None]) -> Callable[[Path], None]:
    """Return what writes files, by name; None makes a folder."""

    def write(folder: Path) -> None:
        for name, content in files.items():
            place = folder / name
            place.parent.mkdir(parents=True, exist_ok=True)
            if content is None:
                place.mkdir()
            else:
                place.write_bytes(content.encode() if isinstance(content, str) else content)

    return write


def then(*steps: Callable[[Path], object]) -> Callable[[Path], None]:
    """Return what does one thing after another in a folder."""

    def do(folder: Path) -> None:
        for step in steps:
            step(folder)

    return do


def compare(*scenes: str, small: bool = True) -> tuple[str, ...]:
    """Return the words that compare scenes."""
    return ("compare", *(scenes or ("a.xml",)), "-o", "out", *(SMALL if small else ()))
