"""Baselines as files, of scenes and of pictures: finding, reading and writing them."""

import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from fotismos.comparisons import atomic
from fotismos.comparisons.atomic import content, require_regular
from fotismos.comparisons.case import Case, open_case
from fotismos.comparisons.check.measurement import read_baseline
from fotismos.comparisons.check.pictures import Repeats, colour, means
from fotismos.comparisons.departure.blocks import averaged, shrunk
from fotismos.comparisons.names import SUFFIXES, file_of, is_script, matching
from fotismos.comparisons.options import Options
from fotismos.comparisons.picture_files import read_file
from fotismos.comparisons.records.check import HALVES, Baseline, PictureBaseline
from fotismos.comparisons.records.comparison import PictureFiles
from fotismos.heuristic import program
from fotismos.heuristic.errors import InputError
from fotismos.heuristic.heuristics import in_file
from fotismos.reference import records
from fotismos.reference.records import laid_out
from fotismos.reports.files import images

Kept = Mapping[str, NDArray[np.floating]]
"""The halves' small pictures, ``{half: (H, W, 3) linear RGB}``."""


@dataclass(frozen=True)
class BaselineFile:
    """A baseline and the file that it is in."""

    path: Path
    baseline: Baseline

    def open(self, seed: int | None = None) -> Case:
        """Open the scene; ``seed`` replaces the baseline's."""
        options = options_from(self.baseline.options, self.path)
        options |= {} if seed is None else {"seed": seed}
        return open_case(scene_from(self.baseline.scene, self.path), Options.of(options))

    def pictures(self) -> Kept | None:
        """Return the small pictures, or None if the baseline has none."""
        if not (name := self.baseline.images):
            return None
        how = program.command("check", "BASELINE", "--update", "--images")
        return read_layers(
            self.path.parent / Path(name).name, HALVES, longest=LONGEST_KEPT, how=how
        )


def find(path: Path) -> list[Path]:
    """Return the baselines at ``path``: the file itself, or a folder's, sorted."""
    if path.is_dir():
        found = sorted(path.glob("*.json"))
        if not found:
            raise InputError(f"{path}: this folder has no baseline (*.json). {_HOW}")
        return found
    if not path.is_file():
        raise InputError(f"{path}: there is no such baseline. {_HOW}")
    return [path]


LARGEST = 2**24
"""Bytes of a baseline, and of its pictures: a thousand times their usual size."""

LONGEST_KEPT = 128
"""Pixels of the longer side of the pictures that a baseline keeps."""

LONGEST_PICTURE = 2**15
"""Pixels of the longer side of a baseline of pictures that is read, at most."""

PICTURE_LAYERS = ("mean", "variance")

_HOW = (
    f"Make one with `{program.command('check', 'BASELINE', '--update', '--scene', 'SCENE')}`, or"
    " with `--picture NAME=PATTERN` in place of the scene."
)


def read(path: Path) -> BaselineFile:
    """Read a baseline."""
    return BaselineFile(path, read_baseline(read_text(path), str(path)))


def may_run_script(path: Path) -> bool:
    """Return whether a check of a baseline runs a script: its scene is one, or not yet known."""
    try:
        return is_script(json.loads(content(path, LARGEST)).get("scene", ""))
    except (OSError, ValueError, AttributeError, TypeError, RecursionError):
        return True


def read_text(path: Path, of_pictures: bool = False) -> str:
    """Read the text of a baseline: of a scene, or of pictures."""
    try:
        text = content(path, LARGEST).decode()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: {getattr(error, 'strerror', None) or error}. {_HOW}") from error
    # Both kinds are JSON in one folder; only that of pictures counts repeats.
    if ('"repeats":' in text) != of_pictures:
        hint = "not of pictures. Omit" if of_pictures else "of pictures. Give"
        raise InputError(f"{path}: this baseline is {hint} --picture {path.stem}=PATTERN.")
    return text


def require_own_pictures(path: Path) -> None:
    """Ensure that the pictures next to a baseline, if any, are those of a baseline."""
    images = path.with_suffix(".exr")
    if not images.exists():
        return
    import OpenEXR

    foreign = InputError(
        f"{images}: fotismos did not make this file, which the baseline's would replace. Move it"
        " away, or give another baseline."
    )
    try:
        require_regular(images)
        with OpenEXR.File(str(images), separate_channels=True, header_only=True) as file:
            names = [*file.channels()]
    except Exception as error:  # the library has many for a file that is not EXR
        raise foreign from error
    if not all(name.startswith("baseline.") for name in names):
        raise foreign


def write(path: Path, baseline: Baseline, pictures: Kept | None = None) -> None:
    """Write a baseline atomically, with its small pictures if given."""
    layers = {}
    if pictures is not None:
        # "baseline." keeps the layers at half precision, which is enough for pictures.
        layers = {f"baseline.{half}": small(pictures[half]) for half in HALVES}
        baseline = structs.replace(baseline, images=path.with_suffix(".exr").name)
    put(path, baseline.text(), layers, baseline.scene)


def put(path: Path, text: str, layers: Kept, subject: str) -> None:
    """Write the text of a baseline, and the layers of its EXR if there are any."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.exists():
            require_regular(path)
        # The text comes last: it names the pictures.
        if layers:
            require_own_pictures(path)
            images.write_exr(path.with_suffix(".exr"), layers, {"scene": subject})
        atomic.write(path, text)
    except OSError as error:
        raise InputError(
            f"baseline {path}: {error.strerror or error}. Name another place for it."
        ) from error


def small(image: NDArray[np.floating]) -> NDArray[np.floating]:
    """Average an image (H, W, 3) down to sides of at most `LONGEST_KEPT`."""
    return averaged(image, shrunk(image.shape[:2], LONGEST_KEPT))


def scene_from(scene: str, path: Path) -> str:
    """Return a baseline's scene as :func:`fotismos.comparisons.case.open_case` takes it."""
    beside = path.parent / scene
    return str(beside) if Path(scene).suffix in SUFFIXES or beside.is_file() else scene


def scene_for(scene: str, path: Path) -> str:
    """Return how a baseline at ``path`` names a scene: files relative to the baseline's folder."""
    file = file_of(scene)
    return scene if file is None else Path(os.path.relpath(file, path.parent)).as_posix()


def options_from(options: Mapping[str, Any], path: Path) -> dict[str, Any]:
    """Return a baseline's options as a :class:`fotismos.comparisons.options.Options` takes them."""
    return _with_heuristic(options, lambda file: os.path.relpath(path.parent / file))


def options_for(options: Mapping[str, Any], path: Path) -> dict[str, Any]:
    """Return options as a baseline at ``path`` has them: files relative to its folder."""
    return _with_heuristic(options, lambda file: os.path.relpath(file, path.parent))


def _with_heuristic(options: Mapping[str, Any], placed: Callable[[str], str]) -> dict[str, Any]:
    """Return options with another path for the heuristic's file, if it has one."""
    file, function = in_file(options.get("heuristic", "")) or ("", "")
    if not file:
        return dict(options)
    word = Path(placed(file)).as_posix() + (f":{function}" if function else "")
    return dict(options) | {"heuristic": word}


def name_of(scene: str | Path) -> str:
    """Return the name of a scene's baseline: the scene's, or its file's."""
    return Path(scene).stem if Path(scene).suffix in SUFFIXES else str(scene)


def read_layers(
    path: Path, names: Sequence[str], longest: int, how: str
) -> dict[str, NDArray[np.float64]]:
    """Read layers ``baseline.NAME`` of a baseline's EXR, of at most so many pixels per side.

    ``how`` is the command that makes the file.
    """
    import OpenEXR

    try:
        require_regular(path, atomic.LARGEST)  # before one is opened
        with OpenEXR.File(str(path), separate_channels=True) as file:
            channels = file.channels()
            pictures = {
                name: np.stack(
                    [channels[f"baseline.{name}.{c}"].pixels.astype(float) for c in "RGB"], axis=-1
                )
                for name in names
            }
            if max(max(picture.shape) for picture in pictures.values()) > longest:
                raise ValueError("they are too large")
            if not all(np.isfinite(picture).all() for picture in pictures.values()):
                raise ValueError("they are not finite")
            return pictures
    except Exception as error:  # the library has many for a file that is not EXR
        raise InputError(
            f"{path}: the baseline's pictures cannot be read: {error}. Write them again with"
            f" `{how}`."
        ) from error


# --- Pictures ----------------------------------------------------------------------------------


def read_repeats(
    pattern: str, transfer: str | None, over: str | None = None
) -> tuple[Repeats, PictureFiles]:
    """Read the repeats that match a pattern, ``render_*.exr`` or ``render_*.exr:LAYER``.

    Also return the record of their files.
    """
    names = matching([pattern])
    digests = []
    notes: dict[str, None] = {}

    def shots() -> Iterator[np.ndarray]:
        # One at a time: only their sums are kept.
        for name in names:
            file = read_file(name, transfer, over)
            digests.append(file.digest)
            notes.update(dict.fromkeys(file.notes))
            yield file.image

    repeats = Repeats.of(shots())
    files = PictureFiles(
        files=names,
        digests=tuple(digests),
        transfer=transfer,
        notes=tuple(notes),
        repeats=len(names),
    )
    return repeats, files


def write_pictures(
    path: Path,
    repeats: Repeats,
    transfer: Literal["linear", "srgb"] | None,
    over: str | None = None,
) -> None:
    """Write a baseline, and its EXR with the mean and variance of each pixel."""
    if repeats.count < 2:
        raise InputError(f"{path}: one picture does not show its noise. Give two repeats or more.")
    # Compared with itself: the difference of two such means has an error √2 times that of one.
    whole, _ = means(repeats, repeats)
    height, width = repeats.mean.shape[:2]
    baseline = PictureBaseline(
        repeats=repeats.count,
        resolution=(width, height),
        transfer=transfer,
        over=over,
        mean=colour(whole.before[0, 0]),
        error=colour(whole.error[0, 0] / np.sqrt(2.0)),
        correlation=float(repeats.correlation),
        images=path.with_suffix(".exr").name,
    )
    layers = {f"baseline.{name}": getattr(repeats, name) for name in PICTURE_LAYERS}
    put(path, laid_out(records.plain(baseline)) + "\n", layers, path.stem)


def picture_record(path: Path) -> PictureBaseline:
    """Read the record of a baseline."""
    return records.read(PictureBaseline, read_text(path, of_pictures=True), str(path))


def read_pictures(path: Path) -> tuple[PictureBaseline, Repeats]:
    """Read a baseline, and the statistics of its repeats from the EXR beside it."""
    baseline = picture_record(path)
    return baseline, kept_repeats(path, baseline)


def kept_repeats(path: Path, baseline: PictureBaseline) -> Repeats:
    """Read the statistics of a baseline's repeats from the EXR beside it."""
    # Only the name counts: a baseline must not lead to files elsewhere.
    kept = path.parent / Path(baseline.images).name
    how = program.command("check", path, "--update", "--picture", f"{path.stem}=PATTERN")
    found = read_layers(kept, PICTURE_LAYERS, longest=LONGEST_PICTURE, how=how)
    repeats = Repeats(baseline.repeats, **found, correlation=np.array(baseline.correlation))
    # The two files may come from different runs, or one was edited.
    is_same = np.allclose(repeats.mean.mean(axis=(0, 1)), baseline.mean, rtol=1e-5, atol=1e-9)
    if not (is_same and (repeats.variance >= 0).all() and baseline.correlation < np.inf):
        raise InputError(f"{kept}: this is not of {path.name}. Write both again: `{how}`.")
    return repeats
