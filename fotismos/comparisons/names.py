"""What words of a command name: a built-in scene, the file of one, pictures and their layers."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from glob import glob, has_magic
from pathlib import Path
from typing import TYPE_CHECKING

from fotismos.comparisons import atomic
from fotismos.comparisons.gallery.builtin import builtin
from fotismos.comparisons.options import Options
from fotismos.heuristic import program
from fotismos.heuristic.errors import InputError, suggestion

if TYPE_CHECKING:  # help needs no NumPy
    import numpy as np

SUFFIXES = (".xml", ".py")
"""Suffixes of scene files: Mitsuba's, and Python's."""
PICTURES = (".exr", ".png", ".jpg", ".jpeg", ".hdr", ".pfm", ".npy")


def file_of(scene: str | Path) -> Path | None:
    """Return the path of a scene file, None for a built-in scene."""
    path = Path(scene)
    # A folder may have the name of a built-in scene; only a scene's suffix always means a file.
    if not str(scene) or (path.suffix not in SUFFIXES and (path.is_dir() or not path.exists())):
        return None
    if not path.is_file():
        siblings = map(str, path.parent.glob("*")) if path.parent.is_dir() else ()
        raise InputError(
            f"{scene}: there is no such file{suggestion(str(scene), siblings)}. Give a Mitsuba"
            " scene (.xml), a Python file that makes one (.py), or the name of a built-in scene"
            f" (listed by `{program.command('scenes')}`)."
        )
    try:
        str(path.resolve()).encode()
    except UnicodeEncodeError as error:
        raise InputError(
            f"{atomic.printable(path.resolve())}: Mitsuba cannot open this name, which is not in"
            " UTF-8. Rename the file, or its folder."
        ) from error
    return path


def is_script(scene: str | Path) -> bool:
    """Return whether opening a scene runs a user's code, which may change the process."""
    return Path(scene).suffix == ".py"


def name_of(scene: str | Path) -> str:
    """Return a scene's name, without reading the scene."""
    path = file_of(scene)
    return builtin(str(scene)).name if path is None else path.stem


def picture_parts(word: str) -> tuple[Path, str]:
    """Return the file and the layer that a word names."""
    # A path may hold colons: one separates a layer only after a picture's suffix.
    file, _, layer = word.rpartition(":")
    if file.lower().endswith(PICTURES):
        return Path(file), layer
    if not word.lower().endswith(PICTURES):
        raise InputError(f"{word}: pictures are {' or '.join(PICTURES)} files. Convert it to EXR.")
    return Path(word), ""


def matching(patterns: Iterable[str]) -> tuple[str, ...]:
    """Return the files that match patterns such as ``render_*.exr`` or ``render_*.exr:LAYER``.

    A name of a file is a pattern that matches it; one that is not there is returned as it is.
    """
    files: list[str] = []
    for pattern in patterns:
        path, layer = picture_parts(pattern)
        if path.is_file() or pattern in ARRAYS:
            files.append(pattern)
            continue
        found = sorted(glob(str(path), recursive=True))
        if not found and has_magic(str(path)):
            raise InputError(
                f"{pattern}: no file matches. Give repeats, such as 'render_*.exr' in quotes."
            )
        files += [f"{file}:{layer}" if layer else file for file in found or [str(path)]]
    return tuple(files)


def with_files(options: Options) -> Options:
    """Return options in which the files that match stand for the patterns of both halves."""
    return options.changed(image=matching(options.image), reference=matching(options.reference))


ARRAYS: dict[str, np.ndarray] = {}
"""Pictures of this process by names like those of files; see :func:`as_files`."""


@contextmanager
def as_files(arrays: Mapping[str, np.ndarray]) -> Iterator[None]:
    """Let arrays (H, W, 3) be read by names like those of NumPy's files, within the block."""
    ARRAYS.update(arrays)
    try:
        yield
    finally:
        for name in arrays:
            del ARRAYS[name]
