"""Baselines as files: finding, reading and writing them.

A baseline is one OpenEXR file, ``NAME.exr``. Its layers are the passes of both halves of a scene,
or the repeats of a picture, in single precision; its header says in JSON what they are of.
"""

import json
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fotismos.comparisons.atomic import LARGEST, content, require_regular
from fotismos.comparisons.case import Case, open_case
from fotismos.comparisons.check.measured import Halves, Measured, measure_scene
from fotismos.comparisons.names import SUFFIXES, file_of, is_script
from fotismos.comparisons.options import Options
from fotismos.comparisons.picture_files import exr_channels, exr_header
from fotismos.comparisons.pictures import Pictures
from fotismos.comparisons.records.check import MOST_PASSES, Baseline
from fotismos.heuristic import program
from fotismos.heuristic.errors import InputError
from fotismos.heuristic.heuristics import in_file
from fotismos.heuristic.program import versions
from fotismos.reference import records
from fotismos.reference.rendering.passes import Progress
from fotismos.reference.scene.graph import set_variant
from fotismos.reports.files import images

HEADER = "fotismos"
"""The attribute of the file's header that holds the record."""

HEADER_BYTES = 2**16
"""Bytes at the start of a file in which a baseline names its layers and its record."""

EXR_MAGIC = b"\x76\x2f\x31\x01"
"""The first bytes of every EXR file."""

LARGEST_VALUE = 1e30
"""Largest value: squares of images in single precision must not overflow."""

SUFFIX = ".exr"
"""Of a baseline's file."""

OLD_SUFFIX = ".json"
"""Of a baseline of fotismos 0.4, which held numbers."""

_HOW = (
    "Make a baseline with"
    f" `{program.command('check', 'BASELINE', '--update', '--scene', 'SCENE')}`, or with `--picture"
    " NAME=PATTERN` in place of the scene."
)


@dataclass(frozen=True)
class BaselineFile:
    """A baseline, the file that it is in, and the passes of its halves."""

    path: Path
    baseline: Baseline
    halves: Halves

    @classmethod
    def of(
        cls, path: Path, scene: str | None, options: Mapping[str, Any], measured: Measured
    ) -> "BaselineFile":
        """Return the baseline of what was measured, with the current versions.

        ``scene`` is None of pictures.
        """
        counts = [len(half.files) for half in measured.halves.values()]
        if counts[0] < 2:
            raise InputError(
                f"{path}: one picture does not show its noise. Give two repeats or more."
            )
        if counts[0] > MOST_PASSES:
            raise InputError(
                f"{path}: {counts[0]} repeats are more than the {MOST_PASSES} that a baseline"
                " keeps. Give fewer."
            )
        baseline = Baseline(
            scene=scene,
            options=dict(sorted(options.items())),
            passes=counts[0],
            versions=versions(),
        )
        return cls(path=path, baseline=baseline, halves=measured.halves)

    def open(self, seed: int | None = None) -> Case:
        """Open the scene; ``seed`` replaces the baseline's."""
        require_kind(self.path, self.baseline.scene, None)
        options = options_from(self.baseline.options, self.path)
        options |= {} if seed is None else {"seed": seed}
        return open_case(scene_from(str(self.baseline.scene), self.path), Options.of(options))

    def rendered(self, case: Case, progress: Progress | None = None) -> Measured:
        """Render a scene in as many passes as the baseline's was."""
        set_variant(case.variant)
        return measure_scene(case.source, case.options, self.baseline.passes, progress)


@dataclass(frozen=True)
class Known:
    """The scene and options of a baseline, and its file, None of one of fotismos 0.4."""

    scene: str | None
    options: Mapping[str, Any]
    file: BaselineFile | None


# --- Finding -----------------------------------------------------------------------------------


def find(path: Path) -> list[Path]:
    """Return the baselines at ``path``: the file itself, or a folder's, sorted.

    Those of fotismos 0.4 are among them, without the pictures beside them, and so are files that
    are damaged; pictures of others are not.
    """
    if path.is_dir():
        old = set(path.glob(f"*{OLD_SUFFIX}"))
        new = {
            file
            for file in path.glob(f"*{SUFFIX}")
            if file.with_suffix(OLD_SUFFIX) not in old and not _is_of_others(file)
        }
        if not (old or new):
            raise InputError(f"{path}: this folder has no baseline (*.exr). {_HOW}")
        return sorted(old | new)
    file = placed(path)
    if not file.is_file():
        raise InputError(f"{path}: there is no such baseline. {_HOW}")
    return [file]


def _is_of_others(path: Path) -> bool:
    """Return whether a file is an EXR picture that was never a baseline."""
    try:
        require_regular(path, LARGEST)
        with path.open("rb") as file:
            start = file.read(HEADER_BYTES)
    except OSError:
        return False
    # By its bytes, since the library refuses what others write, such as several parts or deep
    # pixels, as it refuses what is damaged.
    own = (f"{HEADER}\0string\0", f"\0{images.PASS}")  # before a layer's name stands a 0
    return start.startswith(EXR_MAGIC) and not any(mark.encode() in start for mark in own)


def placed(path: Path) -> Path:
    """Return the file of a baseline: that of 0.4 while there is one, however it is named."""
    if path.suffix not in (OLD_SUFFIX, SUFFIX):
        return path
    old = path.with_suffix(OLD_SUFFIX)
    return old if os.path.lexists(old) else path.with_suffix(SUFFIX)


def may_run_script(path: Path) -> bool:
    """Return whether a check of a baseline runs a script: its scene is one, or not yet known."""
    try:
        is_old = path.suffix == OLD_SUFFIX
        scene = old_record(path).scene if is_old else json.loads(_header(path))["scene"]
        return is_script(scene or "")
    except Exception:  # the library has many for a file that is not EXR
        return True


def require_kind(path: Path, scene: str | None, pattern: str | None) -> None:
    """Ensure that a baseline of a scene is compared with it, and one of pictures with pictures."""
    if (scene is None) == (pattern is not None):
        return
    hint = "of pictures. Give" if scene is None else "not of pictures. Omit"
    raise InputError(f"{path}: this baseline is {hint} --picture {path.stem}=PATTERN.")


# --- Reading -----------------------------------------------------------------------------------


def known(path: Path) -> Known:
    """Return what a baseline is of, also if it is one of fotismos 0.4."""
    if path.suffix == OLD_SUFFIX:
        return old_record(path)
    file = read(path)
    return Known(scene=file.baseline.scene, options=file.baseline.options, file=file)


def old_record(path: Path) -> Known:
    """Return what a baseline of fotismos 0.4 was of."""
    try:
        kept = json.loads(content(path, 2**24))
        is_old = kept["record_version"] in (*records.OLDER, records.VERSION)
        if not is_old or not kept.keys() & {"repeats", "passes"}:
            raise ValueError("it has other keys.")
        reading = {key: kept[key] for key in ("transfer", "over") if kept.get(key)}
        options = {**kept.get("options", {}), **reading}
        Options.of(options)
        return Known(scene=kept.get("scene"), options=options, file=None)
    # Numbers too long for Python and lists nested too deeply raise other errors.
    except (InputError, OSError, ValueError, LookupError, TypeError, AttributeError,
            OverflowError, RecursionError) as error:  # fmt: skip
        raise _no_baseline(path, error) from error


def read(path: Path) -> BaselineFile:
    """Read a baseline; ``InputError`` has the name of the file and the fault in it."""
    if path.suffix == OLD_SUFFIX:
        shots = () if old_record(path).scene else ("--picture", f"{path.stem}=PATTERN")
        raise InputError(
            f"{path}: this baseline is of fotismos 0.4, which kept numbers where passes are kept"
            " now, so it cannot be compared."
            f" `{program.command('check', path, '--update', *shots)}` makes {path.stem}{SUFFIX} of"
            " what there is today, in its place."
        )
    try:
        baseline = records.read(Baseline, _header(path), str(path))
        if baseline.scene is not None and not (baseline.scene and baseline.scene.isprintable()):
            raise ValueError(
                f"the scene is {baseline.scene!r}: a built-in name or the path of a file is"
                " allowed."
            )
        Options.of(baseline.options)
        return BaselineFile(path=path, baseline=baseline, halves=_halves(path, baseline))
    except Exception as error:  # the library has many for a file that is not EXR
        raise _no_baseline(path, error) from error


def _no_baseline(path: Path, error: Exception) -> InputError:
    reason = getattr(error, "strerror", None) or str(error)
    where = "" if reason.startswith(str(path)) else f"{path}: this is no baseline: "
    return InputError(f"{where}{reason.rstrip('.')}. Move it away. {_HOW}")


def _header(path: Path) -> str:
    """Return the record in a file's header, as JSON."""
    require_regular(path, LARGEST)  # before one is opened
    header = exr_header(path)
    if HEADER not in header:
        raise ValueError("fotismos did not make this file.")
    return str(header[HEADER])


def _halves(path: Path, baseline: Baseline) -> Halves:
    channels = exr_channels(path)
    halves = {}
    for half in baseline.halves:
        shown = []
        for number in range(baseline.passes):
            names = [f"{_layer(half, number)}.{channel}" for channel in "RGB"]
            if not channels.keys() >= set(names):
                raise ValueError(f"the layer {_layer(half, number)} is missing.")
            image = np.stack([channels[name] for name in names], axis=-1)
            # Written so that a NaN fails it, too.
            if not (np.abs(image) <= LARGEST_VALUE).all():
                raise ValueError(f"a value is not finite, or larger than {LARGEST_VALUE:.2g}.")
            shown.append(image)
        halves[half] = Pictures.of(f"{path.name} {half}", shown)
    return halves


def _layer(half: str, number: int) -> str:
    return f"{images.PASS}{half}.{number}"


# --- Writing -----------------------------------------------------------------------------------


def write(file: BaselineFile) -> None:
    """Write a baseline, in place of an older one."""
    path = file.path
    layers = {
        _layer(half, number): picture.image
        for half, pictures in file.halves.items()
        for number, picture in enumerate(pictures.files)
    }
    size = sum(layer.nbytes for layer in layers.values())
    if size > LARGEST:
        raise InputError(
            f"{path}: {len(layers)} repeats of this size are {size / 1e9:.2g} GB. Give fewer, or"
            " smaller ones."
        )
    record = json.dumps(records.plain(file.baseline), ensure_ascii=False, allow_nan=False)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        require_own(path)
        old = path.with_suffix(OLD_SUFFIX)
        if os.path.lexists(old):
            old_record(old)  # refuses what is none
        images.write_exr(path, layers, {HEADER: record})
        old.unlink(missing_ok=True)
    except OSError as error:
        raise InputError(
            f"baseline {path}: {error.strerror or error}. Name another place for it."
        ) from error


def require_own(path: Path) -> None:
    """Ensure that a file, if there is one, is a baseline, or the pictures of one of 0.4."""
    if not os.path.lexists(path):
        return
    foreign = InputError(
        f"{path}: fotismos did not make this file, which the baseline would replace. Move it away,"
        " or give another baseline."
    )
    try:
        require_regular(path, LARGEST)
        header = exr_header(path)
    except (InputError, OSError) as error:
        raise foreign from error
    is_old = all(channel.name.startswith("baseline.") for channel in header["channels"])
    if not (HEADER in header or is_old):
        raise foreign


# --- Scenes and files that a baseline names ----------------------------------------------------


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
