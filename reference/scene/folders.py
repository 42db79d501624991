"""Folders of scenes: which files in them, and in their subfolders, are scenes."""

from __future__ import annotations

import ast
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from heuristic.errors import InputError
from reference.scene.reading import INCLUDE
from reference.scene.script import NAME

ROOT = re.compile(r"<scene\b")


@dataclass(frozen=True)
class Found:
    """The scenes of a folder by path: Mitsuba's files, and Python files, which are code."""

    written: tuple[Path, ...]
    scripts: tuple[Path, ...]


def scenes_in(folder: Path) -> Found:
    """Return the scenes in a folder and its subfolders; hidden ones and links are skipped.

    They are the files ``*.xml`` that have a scene element, but not those that others include, and
    the files ``*.py`` that define ``scene``. Nothing is run.

    Raises
    ------
    InputError
        If there is none.
    """
    files = list(_files(folder))
    written = [path for path in files if path.suffix == ".xml"]
    parts = {
        inner
        for path in written
        for name in INCLUDE.findall(_text(path))
        if (inner := (path.parent / name).resolve()) != path.resolve()
    }
    found = Found(
        tuple(path for path in written if path.resolve() not in parts and _may_be_scene(path)),
        tuple(path for path in files if path.suffix == ".py" and _defines_scene(path)),
    )
    if not (found.written or found.scripts):
        raise InputError(
            f"{folder}: there is no scene in this folder: no .xml file that has a <scene>, and no"
            f" .py file that defines `{NAME}`."
        )
    return found


def _files(folder: Path) -> Iterator[Path]:
    for place, inner, names in os.walk(folder):
        inner[:] = sorted(name for name in inner if not name.startswith("."))
        yield from (path for name in sorted(names) if (path := Path(place, name)).is_file())


def _may_be_scene(path: Path) -> bool:
    """Return whether a file has a scene; an unreadable one counts, and fails later."""
    return not os.access(path, os.R_OK) or ROOT.search(_text(path)) is not None


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""


def _defines_scene(path: Path) -> bool:
    """Return whether a Python file defines the name, without running it."""
    try:
        body = ast.parse(_text(path)).body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return False
    names = set()
    for node in body:
        names |= {node.name} if isinstance(node, ast.FunctionDef) else set()
        names |= {t.id for t in getattr(node, "targets", ()) if isinstance(t, ast.Name)}
    return NAME in names
