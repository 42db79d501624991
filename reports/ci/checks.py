"""Checking scenes against baselines, and writing baselines and the pictures of what failed."""

from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

from comparisons import record
from comparisons.check import baseline, check, suspects
from comparisons.check.check import Check
from comparisons.check.measurement import HALVES
from comparisons.check.moved import LEVEL
from comparisons.records import to_json
from heuristic.errors import FotismosError
from reference.scene.graph import set_variant
from reports.ci import baselines, check_pictures, check_record
from reports.ci.baselines import BaselineFile
from reports.ci.check_record import VersionChange
from reports.files import ownership

FILES = ("check.json", *(f"{name}.png" for name in check_pictures.NAMES))
"""What a failure leaves in its folder."""

ERROR = 2
"""Exit code of what could not be checked, told apart from 1, which means that something moved."""


@dataclass(frozen=True)
class Result:
    """What became of one baseline.

    Attributes
    ----------
    path, scene
        The baseline's file, and the scene that it names.
    status
        ``passed``, ``failed`` (something moved), ``error`` (it could not be told); of an update
        ``created``, ``updated`` or ``unchanged``.
    seconds
        Time that it took.
    check
        The comparison with the baseline; None where there was none to compare with.
    message
        Of an error, or on an update.
    exit_code
        0, 1 for a failure, 2 for an error, whatever its reason.
    folder
        Where the pictures of a failure are.
    versions
        Those that changed since the baseline was made, by name.
    causes
        Of a failure: sentences on why, as far as the numbers tell.
    objects
        Of a failure: the share of the change that each object has, by half.
    """

    path: Path
    scene: str
    status: str
    seconds: float = 0.0
    check: Check | None = None
    message: str = ""
    exit_code: int = 0
    folder: Path | None = None
    versions: dict[str, VersionChange] | None = None
    causes: tuple[str, ...] = ()
    objects: dict[str, dict[str, float]] | None = None

    @property
    def name(self):
        """Return the baseline's name."""
        return self.path.stem


def examine(file, case, level=LEVEL, folder=None, progress=None):
    """Check a scene against its baseline, and write pictures of what failed.

    Parameters
    ----------
    file : BaselineFile
        The baseline.
    case
        The scene, see :meth:`BaselineFile.open`.
    level
        Chance of an alarm though nothing changed.
    folder
        For the pictures, which are written only if something moved; those of an earlier failure
        are deleted.
    progress
        As of :func:`comparisons.compare.compare`.

    Raises
    ------
    FotismosError
        When the scene cannot be measured, or the baseline's pictures cannot be read.
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
        _write_failure(result, pictures)
    return result


def update(file, case, level=LEVEL, images=False, progress=None):
    """Measure again, and write the baseline if anything moved; else its file stays as it is."""
    begin = perf_counter()
    found = _checked(file, case, level, progress)
    old, new, message = file.baseline, None, ""
    if not found.passed:
        new = baseline.of(old.scene, old.options, found.after)
    elif images and not old.images:
        new, message = old, "the pictures were added"
    if new is not None:
        kept = check_pictures.reduced(found.pictures) if images or old.images else None
        baselines.write(file.path, new, kept)
    status = "unchanged" if found.passed else "updated"
    return Result(file.path, old.scene, status, perf_counter() - begin, found, message)


def create(path, scene, case, images=False, progress=None):
    """Measure a scene, and write a baseline of it, in place of any that is there.

    Parameters
    ----------
    path
        The baseline's file.
    scene
        How the baseline names the scene.
    case
        The scene; the resolution is a small one unless it is given.
    images
        Write pictures beside it.
    progress
        As of :func:`comparisons.compare.compare`.
    """
    begin = perf_counter()
    case = check.made_small(case)
    measured = check.measure_scene(case.source, case.options, progress=progress)
    options = baselines.options_for(case.asking(spp=measured.spp).request.stated(), path)
    status = "updated" if path.exists() else "created"
    new = baseline.of(scene, options, measured.measurement)
    baselines.write(path, new, check_pictures.reduced(measured.pictures) if images else None)
    return Result(path, scene, status, perf_counter() - begin)


def guarded(run, path, *more):
    """Call ``run(path, *more)``; whatever it raises is the error of this baseline alone.

    An interruption and ``SystemExit`` pass through.
    """
    begin = perf_counter()
    try:
        return run(path, *more)
    except Exception as error:
        return failed(path, error, perf_counter() - begin)


def failed(path, error, seconds=0.0):
    """Return the result of a baseline that an exception kept from being judged."""
    kind = "" if isinstance(error, FotismosError) else f"{type(error).__name__}: "
    where = "" if str(error).startswith(str(path)) else f"{path}: "
    message = f"{where}{kind}{error}"
    return Result(path, "", "error", seconds=seconds, message=message, exit_code=ERROR)


def _checked(file: BaselineFile, case, level, progress):
    set_variant(case.variant)
    return check.check(case.source, case.options, file.baseline.measured(), level, progress)


def _changed_versions(baseline):
    now = record.versions()
    return {
        name: VersionChange(old, now.get(name, "none"))
        for name, old in baseline.versions.items()
        if now.get(name) != old
    }


def _explained(found: Check, before):
    """Return causes and objects of a failure; ``before`` are the baseline's pictures, if any."""
    halves = (half for half in HALVES if any(move.half == half for move in found.moved))
    objects = {half: found.objects(half, before and before[half]) for half in halves}
    return {"causes": tuple(suspects.causes(found)), "objects": objects}


def _write_failure(result, before):
    """Write pictures and the record; ``before`` are the pictures of the baseline, if any."""
    folder = result.folder
    ownership.folder(folder)
    for name, png in check_pictures.pictures(result.check, before).items():
        ownership.write(folder / f"{name}.png", png)
    ownership.write(folder / "check.json", to_json(check_record.of(result)))
