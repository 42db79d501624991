"""Scenes written in Python."""

import runpy
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from heuristic.errors import InputError
from heuristic.user_code import contained

NAME = "scene"
"""Name of a Python file's dictionary, or of the function that returns it."""


@dataclass(frozen=True)
class Script:
    """A function that runs a Python file and returns its scene, a dictionary.

    ``files`` are those that the last run read: the file itself, the user's modules, and files that
    they opened through Python (:func:`heuristic.opened.noted`).
    """

    path: Path
    files: set[Path] = field(default_factory=set, compare=False, repr=False)

    def __call__(self) -> Any:
        """Run the file.

        Raises
        ------
        InputError
            If it raises anything, or has no scene.
        """
        try:
            with contained(self.path) as read:
                scene = runpy.run_path(str(self.path)).get(NAME)
                made = scene() if callable(scene) else scene
        except (Exception, SystemExit) as error:  # a user's code may raise anything
            raise InputError(f"{self.path}: {type(error).__name__}: {error}") from error
        self.files.clear()
        self.files.update({self.path.resolve()} | read)
        if not isinstance(made, Mapping):
            raise InputError(
                f"{self.path}: `{NAME}` is {type(made).__name__}. It must be a dictionary for"
                " mitsuba.load_dict, or a function that returns one."
            )
        return made
