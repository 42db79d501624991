"""Checking scenes against baselines, and writing baselines and the pictures of what failed."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

from comparisons import record
from comparisons.case import Case
from comparisons.check import baseline, check, suspects
from comparisons.check.baseline import Baseline
from comparisons.check.check import Check
from comparisons.check.measurement import HALVES
from comparisons.check.moved import LEVEL
from comparisons.compare import Progress
from comparisons.records import to_json
from heuristic.errors import FotismosError
from reference.scene.graph import set_variant
from reports.ci import baselines, check_pictures, check_record
from reports.ci.baselines import BaselineFile, Pictures
from reports.ci.check_record import Status, VersionChange
from reports.files import ownership

FILES = ("check.json", *(f"{name}.png" for name in check_pictures.NAMES))
"""The files of a failure."""

ERROR = 2
"""Exit code if a baseline could not be checked; 1 means that something moved."""


@dataclass(frozen=True)
class Result:
    """The result for one baseline.

    Attributes
    ----------
    path, scene
        The baseline's file, and the scene that it names.
    status
        ``passed``, ``failed`` (something moved), ``error`` (not checked); of an update ``created``,
        ``updated`` or ``unchanged``.
    seconds
        Time that it took.
    check
        The comparison with the baseline; None if there was nothing to compare with.
    message
        The error, or a remark on an update.
    exit_code
        0, 1 for a failure, 2 for an error.
    folder
        The folder of a failure's pictures.
    versions
        Libraries whose version changed since the baseline was made.
    causes
        Likely reasons for a failure, in sentences.
    objects
        Each object's share of a failure's change, by half.
    """

    path: Path
    scene: str
    status: Status
    seconds: float = 0.0
    check: Check | None = None
    message: str = ""
    exit_code: int = 0
    folder: Path | None = None
    versions: dict[str, VersionChange] | None = None
    causes: tuple[str, ...] = ()
    objects: dict[str, dict[str, float]] | None = None

    @property
    def name(self) -> str:
        """Return the baseline's name."""
        return self.path.stem


def examine(
    file: BaselineFile,
    case: Case,
    level: float = LEVEL,
    folder: Path | None = None,
    progress: Progress | None = None,
) -> Result:
    """Check a scene against its baseline, and write pictures of a failure.

    Parameters
    ----------
    file
        The baseline.
    case
        The scene, see :meth:`BaselineFile.open`.
    level
        Chance of an alarm though nothing changed.
    folder
        For the pictures, which are written only if something moved; an earlier failure's are
        deleted.
    progress
        See :func:`comparisons.compare.compare`.

    Raises
    ------
    FotismosError
        If the scene cannot be measured, or the baseline's pictures cannot be read.
    """
    begin = perf_counter()
    pictures = file.pictures()
    found = _checked(file, case, level, progress)
    if folder is not None:
        ownership.clear(folder, FILES)
    result = Result(
        file.path,
        file.baseline.scene,
        "passed" if found.passed else "failed",
        seconds=perf_counter() - begin,
        check=found,
        exit_code=0 if found.passed else 1,
        folder=None if found.passed else folder,
        versions=_changed_versions(file.baseline),
        **({} if found.passed else _explained(found, pictures)),
    )
    if result.folder is not None:
        _write_failure(result, result.folder, found, pictures)
    return result


def update(
    file: BaselineFile,
    case: Case,
    level: float = LEVEL,
    images: bool = False,
    progress: Progress | None = None,
) -> Result:
    """Measure again, and write the baseline if anything moved, or pictures are to be added."""
    begin = perf_counter()
    found = _checked(file, case, level, progress)
    old, message = file.baseline, ""
    new: Baseline | None = None
    if not found.passed:
        new = baseline.of(old.scene, old.options, found.after)
    elif images and not old.images:
        new, message = old, "the pictures were added"
    if new is not None:
        kept = check_pictures.reduced(found.pictures) if images or old.images else None
        baselines.write(file.path, new, kept)
    status: Status = "unchanged" if found.passed else "updated"
    return Result(file.path, old.scene, status, perf_counter() - begin, found, message)


def create(
    path: Path, scene: str, case: Case, images: bool = False, progress: Progress | None = None
) -> Result:
    """Measure a scene, and write or replace its baseline.

    Parameters
    ----------
    path
        The baseline's file.
    scene
        How the baseline names the scene.
    case
        The scene; its resolution is small unless requested otherwise.
    images
        Write pictures next to it.
    progress
        See :func:`comparisons.compare.compare`.
    """
    begin = perf_counter()
    case = check.made_small(case)
    measured = check.measure_scene(case.source, case.options, progress=progress)
    options = baselines.options_for(case.asking(spp=measured.spp).request.stated(), path)
    status: Status = "updated" if path.exists() else "created"
    new = baseline.of(scene, options, measured.measurement)
    baselines.write(path, new, check_pictures.reduced(measured.pictures) if images else None)
    return Result(path, scene, status, perf_counter() - begin)


def guarded(run: Callable[..., Result], path: Path, *more: Any) -> Result:
    """Return ``run(path, *more)``; an exception becomes this baseline's result.

    An interruption and ``SystemExit`` pass through.
    """
    begin = perf_counter()
    try:
        return run(path, *more)
    except Exception as error:
        return failed(path, error, perf_counter() - begin)


def failed(path: Path, error: BaseException, seconds: float = 0.0) -> Result:
    """Return the result of a baseline that an exception kept from being judged."""
    kind = "" if isinstance(error, FotismosError) else f"{type(error).__name__}: "
    where = "" if str(error).startswith(str(path)) else f"{path}: "
    message = f"{where}{kind}{error}"
    return Result(path, "", "error", seconds=seconds, message=message, exit_code=ERROR)


def _checked(file: BaselineFile, case: Case, level: float, progress: Progress | None) -> Check:
    set_variant(case.variant)
    return check.check(case.source, case.options, file.baseline.measured(), level, progress)


def _changed_versions(baseline: Baseline) -> dict[str, VersionChange]:
    now = record.versions()
    return {
        name: VersionChange(old, now.get(name, "none"))
        for name, old in baseline.versions.items()
        if now.get(name) != old
    }


def _explained(found: Check, before: Pictures | None) -> dict[str, Any]:
    """Return causes and objects of a failure; ``before`` are the baseline's pictures, if any."""
    halves = (half for half in HALVES if any(move.half == half for move in found.moved))
    objects = {half: found.objects(half, before[half] if before else None) for half in halves}
    return {"causes": tuple(suspects.causes(found)), "objects": objects}


def _write_failure(result: Result, folder: Path, found: Check, before: Pictures | None) -> None:
    """Write pictures and the record; ``before`` are the baseline's pictures, if any."""
    ownership.folder(folder)
    for name, png in check_pictures.pictures(found, before).items():
        ownership.write(folder / f"{name}.png", png)
    ownership.write(folder / "check.json", to_json(check_record.of(result)))
