"""Scenes written in Python."""

import os
import runpy
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from heuristic.errors import InputError
from reference.scene.opened import noted

NAME = "scene"
"""What a Python file calls its dictionary, or the function that returns it."""


@dataclass(frozen=True)
class Script:
    """A function that runs a Python file and returns its scene, a dictionary.

    ``files`` are those that the last run read: the file itself, modules of the user's own, and what
    they opened through Python (:func:`reference.scene.opened.noted`).
    """

    path: Path
    files: set[Path] = field(default_factory=set, compare=False, repr=False)

    def __call__(self):
        """Run the file.

        Raises
        ------
        InputError
            When it raises anything, or has no scene.
        """
        try:
            with _put_back(), noted() as read:
                sys.path.insert(0, str(self.path.resolve().parent))
                scene = runpy.run_path(str(self.path)).get(NAME)
                made = scene() if callable(scene) else scene
        except (Exception, SystemExit) as error:  # whatever a user's own code raises
            raise InputError(f"{self.path}: {type(error).__name__}: {error}") from error
        self.files.clear()
        self.files.update({self.path.resolve()} | read)
        if not isinstance(made, Mapping):
            raise InputError(
                f"{self.path}: `{NAME}` is {type(made).__name__}. It has to be a dictionary as"
                " mitsuba.load_dict takes it, or a function that returns one."
            )
        return made


@contextmanager
def _put_back() -> Iterator[None]:
    """Undo what a script does to its process: folder, umask, environment, arguments and path.

    What it forks ends here instead of going on beside its parent.
    """
    pid, folder, environment = os.getpid(), os.getcwd(), dict(os.environ)
    arguments, path = list(sys.argv), list(sys.path)
    umask = os.umask(0o022)
    os.umask(umask)
    try:
        yield
    finally:
        if os.getpid() != pid:
            os._exit(0)
        os.chdir(folder)
        os.umask(umask)
        os.environ.clear()
        os.environ.update(environment)
        sys.argv[:], sys.path[:] = arguments, path
