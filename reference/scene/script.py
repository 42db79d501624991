"""Scenes written in Python, and folders of scenes."""

import ast
import os
import re
import runpy
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from heuristic.errors import InputError
from reference.scene.reading import INCLUDE

NAME = "scene"
"""What a Python file calls its dictionary, or the function that returns it."""

ROOT = re.compile(r"<scene\b")


@dataclass(frozen=True)
class Script:
    """A function that runs a Python file and returns its scene, a dictionary."""

    path: Path

    def __call__(self):
        """Run the file.

        Raises
        ------
        InputError
            When it raises anything, or has no scene.
        """
        before = list(sys.path)
        sys.path.insert(0, str(self.path.resolve().parent))
        try:
            scene = runpy.run_path(str(self.path)).get(NAME)
            made = scene() if callable(scene) else scene
        except (Exception, SystemExit) as error:  # whatever a user's own code raises
            raise InputError(f"{self.path}: {type(error).__name__}: {error}") from error
        finally:
            sys.path[:] = before
        if not isinstance(made, Mapping):
            raise InputError(
                f"{self.path}: `{NAME}` is {type(made).__name__}. It has to be a dictionary as"
                " mitsuba.load_dict takes it, or a function that returns one."
            )
        return made


def scenes_in(folder):
    """Return the scenes in a folder, by name.

    They are the files ``*.xml`` that have a scene element, but not those that others in the folder
    include, and the files ``*.py`` that define ``scene``.

    Raises
    ------
    InputError
        When there is none.
    """
    files = [path for path in sorted(folder.iterdir()) if path.is_file()]
    written = [path for path in files if path.suffix == ".xml"]
    parts = set()
    for path in written:
        for name in INCLUDE.findall(_text(path)):
            inner = (folder / name).resolve()
            if inner != path.resolve():
                parts.add(inner)
    found = [
        path
        for path in files
        if (path in written and path.resolve() not in parts and _may_be_scene(path))
        or (path.suffix == ".py" and _defines_scene(path))
    ]
    if not found:
        raise InputError(
            f"{folder}: there is no scene in this folder: no .xml file that has a <scene>, and no"
            f" .py file that defines `{NAME}`."
        )
    return found


def _may_be_scene(path):
    """Tell whether a file has a scene; one that cannot be read fails as a scene, by itself."""
    return not os.access(path, os.R_OK) or ROOT.search(_text(path))


def _text(path):
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""


def _defines_scene(path):
    """Tell whether a Python file gives the name to something, without running it."""
    try:
        body = ast.parse(_text(path)).body
    except (SyntaxError, ValueError):
        return False
    names = set()
    for node in body:
        names |= {node.name} if isinstance(node, ast.FunctionDef) else set()
        names |= {t.id for t in getattr(node, "targets", ()) if isinstance(t, ast.Name)}
    return NAME in names
