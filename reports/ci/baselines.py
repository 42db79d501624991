"""Baselines as files: finding them, reading and writing them, and the scenes that they name."""

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from msgspec import structs

from comparisons import atomic
from comparisons.case import SUFFIXES, Request, file_of, open_case
from comparisons.check.baseline import FORMAT_0_1, Baseline, parse
from comparisons.check.measurement import HALVES
from comparisons.store import content, require_regular
from heuristic import program
from heuristic.errors import InputError
from heuristic.heuristics import in_file
from reports.files import exr


@dataclass(frozen=True)
class BaselineFile:
    """A baseline and the file that it is in."""

    path: Path
    baseline: Baseline

    def open(self, seed=None):
        """Open the scene, as :func:`comparisons.case.open_case`.

        Parameters
        ----------
        seed
            In place of the baseline's own.
        """
        options = options_from(self.baseline.options, self.path)
        options |= {} if seed is None else {"seed": seed}
        return open_case(scene_from(self.baseline.scene, self.path), Request.of(options))

    def pictures(self):
        """Return the halves' small pictures by name, or None where the baseline has none.

        Raises
        ------
        InputError
            When they cannot be read.
        """
        if not self.baseline.images:
            return None
        return _read_pictures(self.path.parent / Path(self.baseline.images).name)


def find(path):
    """Return the files that ``path`` stands for: itself, or the baselines in a folder, by name.

    Raises
    ------
    InputError
        When there is nothing.
    """
    path = Path(path)
    if path.is_dir():
        found = sorted(path.glob("*.json"))
        if not found:
            raise InputError(f"{path}: no baseline (*.json) is in this folder. {_HOW}")
        return found
    if not path.is_file():
        raise InputError(f"{path}: there is no such baseline. {_HOW}")
    return [path]


LARGEST = 2**24
"""Bytes of a baseline, and of its pictures: a thousand times what is written."""

LONGEST_KEPT = 128
"""Pixels of the longer side of the pictures that a baseline keeps."""

HEADS = ('{\n  "record_version"', "{\n  " + FORMAT_0_1)
"""How baselines begin."""

_HOW = f"Make one with `{program.command('check', 'BASELINE', '--update', '--scene', 'SCENE')}`."


def read(path):
    """Read a baseline.

    Raises
    ------
    InputError
        When it cannot be read, or is none.
    """
    try:
        text = content(path, LARGEST).decode()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: {getattr(error, 'strerror', None) or error}. {_HOW}") from error
    return BaselineFile(path, parse(text, str(path)))


def was_ours(path):
    """Tell whether a file that cannot be read begins as baselines do, if only with a part of it."""
    try:
        text = content(path, LARGEST).decode(errors="replace")
    except OSError:
        return False
    return any(text.startswith(head) or head.startswith(text) for head in HEADS)


def write(path, baseline, pictures=None):
    """Write a baseline atomically, with small pictures of both halves where given.

    Raises
    ------
    InputError
        When the place cannot be written to.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.exists():
            require_regular(path)
        if pictures is not None:
            images = path.with_suffix(".exr")
            # "baseline." keeps the layers at half precision, which pictures are fine with.
            layers = {f"baseline.{half}": image for half, image in pictures.items()}
            exr.write(images, layers, {"scene": baseline.scene})
            baseline = structs.replace(baseline, images=images.name)
        atomic.write(path, baseline.text())
    except OSError as error:
        raise InputError(
            f"baseline {path}: {error.strerror or error}. Name another place for it."
        ) from error


def scene_from(scene, path):
    """Return the scene of a baseline as a name for :func:`comparisons.case.open_case`."""
    beside = path.parent / scene
    return str(beside) if Path(scene).suffix in SUFFIXES or beside.is_file() else scene


def scene_for(scene, path):
    """Return how a baseline at ``path`` names a scene: files relative to its own folder.

    Raises
    ------
    InputError
        When the file is not there.
    """
    file = file_of(scene)
    return scene if file is None else Path(os.path.relpath(file, path.parent)).as_posix()


def options_from(options, path):
    """Return the options of a baseline as a :class:`comparisons.case.Request` takes them."""
    return _with_heuristic(options, lambda file: os.path.relpath(path.parent / file))


def options_for(options, path):
    """Return options as a baseline at ``path`` has them: files relative to its own folder."""
    return _with_heuristic(options, lambda file: os.path.relpath(file, path.parent))


def _with_heuristic(options, placed):
    """Return options whose heuristic, where it is in a file, has another path."""
    file, function = in_file(options.get("heuristic", "")) or ("", "")
    if not file:
        return dict(options)
    word = Path(placed(file)).as_posix() + (f":{function}" if function else "")
    return dict(options) | {"heuristic": word}


def name_of(scene):
    """Return what the baseline of a scene is called: its name, or its file's."""
    return Path(scene).stem if Path(scene).suffix in SUFFIXES else str(scene)


def _read_pictures(path):
    import OpenEXR

    try:
        content(path, LARGEST)  # refuses what is not a file before it is opened
        with OpenEXR.File(str(path), separate_channels=True) as file:
            channels = file.channels()
            pictures = {
                half: np.stack(
                    [channels[f"baseline.{half}.{c}"].pixels.astype(float) for c in "RGB"], axis=-1
                )
                for half in HALVES
            }
    # Of what is not an EXR file, the library says so in many ways.
    except Exception as error:
        raise _unreadable(path, error) from error
    for picture in pictures.values():
        if picture.ndim != 3 or max(picture.shape) > LONGEST_KEPT or not np.isfinite(picture).all():
            raise _unreadable(path, "they are too large, or not finite")
    return pictures


def _unreadable(path, reason):
    return InputError(
        f"{path}: the baseline's pictures cannot be read: {reason}. Write them again with"
        f" `{program.command('check', 'BASELINE', '--update', '--images')}`."
    )
