"""Checking scenes against baselines, and writing baselines: one, or all of a command."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any, Literal

from msgspec import structs

from fotismos.comparisons.case import Case, open_case
from fotismos.comparisons.check.measurement import (
    LINEAR_ROUNDING,
    baseline_of,
    made_small,
    measure_scene,
)
from fotismos.comparisons.check.moved import LEVEL, Check, check, level_of_each
from fotismos.comparisons.check.pictures import (
    SIDE,
    PictureCheck,
    Repeats,
    check_pictures,
    picture_gate,
)
from fotismos.comparisons.compare import compare
from fotismos.comparisons.departure.blocks import averaged
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.options import Options
from fotismos.comparisons.processes.pool import Pool, Task
from fotismos.comparisons.records.check import (
    READERS,
    Change,
    CheckRecord,
    PictureBaseline,
    SmallestChanges,
)
from fotismos.comparisons.records.comparison import PictureFiles
from fotismos.comparisons.steps import steps
from fotismos.heuristic.errors import FotismosError, InputError
from fotismos.heuristic.program import versions
from fotismos.reference.records import to_json
from fotismos.reference.rendering.passes import Progress
from fotismos.reference.scene.graph import set_variant
from fotismos.reports.ci import baselines
from fotismos.reports.ci.baselines import BaselineFile
from fotismos.reports.files import images, results
from fotismos.reports.page import page
from fotismos.reports.page.scene_view import Before, SceneView
from fotismos.reports.run import scene_files
from fotismos.reports.terminal import progress

RECORD = "check.json"

Judging = Callable[..., tuple["CheckRecord", SceneView | Before | None]]
"""A function that checks or writes the baseline at a path."""

LARGEST_ERROR = 2.0
"""ΔE2000 at which the map's colours end: changes are often hardly noticeable."""


@dataclass(frozen=True)
class Tolerance:
    """At most the share ``bound`` of the pixels may differ by more than the ΔE2000 ``within``."""

    within: float
    bound: float


# --- One baseline ----------------------------------------------------------------------------


def examine(
    file: BaselineFile,
    case: Case,
    level: float = LEVEL,
    folder: Path | None = None,
    progress: Progress | None = None,
) -> tuple[CheckRecord, SceneView | None]:
    """Check a scene against its baseline.

    ``level`` is the chance of an alarm though nothing changed. If something moved, the scene is
    compared as ``fotismos compare`` does, its files and ``check.json`` are written to ``folder``,
    and its part of the page is returned; else those of an earlier failure are deleted.
    """
    begin = perf_counter()
    kept = file.pictures()
    found = _checked(file, case, level, progress)
    if folder is not None:
        scene_files.remove(folder)
        results.clear(folder, (RECORD,))
    made = _record(file, "passed" if found.passed else "failed", found, begin)
    if found.passed:
        return made, None
    made = structs.replace(
        made, causes=tuple(found.causes()), pictures=folder.as_posix() if folder else None
    )
    if folder is None:
        return made, None
    # Checks usually pass, so a failure alone is compared in full.
    added = steps(why=False)
    comparison = compare(case.source, case.options, progress, case.command(), then=added)
    folder.parent.mkdir(parents=True, exist_ok=True)
    view = scene_files.write(folder.parent, folder.name, comparison)
    results.write(folder / RECORD, to_json(made))
    return made, structs.replace(view, before=_before(made, kept or {}, found.now.pictures))


def update(
    file: BaselineFile,
    case: Case,
    level: float = LEVEL,
    with_pictures: bool = False,
    progress: Progress | None = None,
) -> CheckRecord:
    """Measure again, and write the baseline if anything moved, or pictures are to be added."""
    begin = perf_counter()
    old = file.baseline
    found = _checked(file, case, level, progress)
    made = _record(file, "unchanged" if found.passed else "updated", found, begin)
    is_added = found.passed and with_pictures and not old.images
    if is_added:
        added = f"the pictures were added. {found.now.caution}".removesuffix(". ")
        made = structs.replace(made, message=added)
    if is_added or not found.passed:
        kept = found.now.pictures if with_pictures or old.images else None
        # If nothing moved, the old numbers stay, and only the pictures are new.
        new = old if found.passed else baseline_of(old.scene, old.options, found.now.measurement)
        baselines.write(file.path, new, kept)
    return made


def create(
    path: Path,
    scene: str,
    case: Case,
    with_pictures: bool = False,
    progress: Progress | None = None,
) -> CheckRecord:
    """Measure a scene at a small size, and write or replace its baseline, which names it."""
    begin = perf_counter()
    case = made_small(case)
    measured = measure_scene(case.source, case.options, progress=progress)
    # The number of samples becomes an option: every later check takes as many.
    options = baselines.options_for(case.changed(spp=measured.spp).options.stated(), path)
    status: Literal["updated", "created"] = "updated" if path.exists() else "created"
    new = baseline_of(scene, options, measured.measurement)
    baselines.write(path, new, measured.pictures if with_pictures else None)
    return CheckRecord(
        baseline=path.as_posix(),
        scene=scene,
        status=status,
        seconds=round(perf_counter() - begin, 3),
        message=measured.caution,
    )


def _checked(file: BaselineFile, case: Case, level: float, progress: Progress | None) -> Check:
    set_variant(case.variant)
    return check(case.source, case.options, file.baseline.measured(), level, progress)


def _record(file: BaselineFile, status: Any, found: Check, begin: float) -> CheckRecord:
    now = versions()
    changed = {
        name: Change(before=old, after=now.get(name, "none"))
        for name, old in file.baseline.versions.items()
        if now.get(name) != old
    }
    metrics = found.before.metrics.items()
    after = found.now.measurement.metrics
    return CheckRecord(
        baseline=file.path.as_posix(),
        scene=file.baseline.scene,
        status=status,
        passed=status != "failed",
        seconds=round(perf_counter() - begin, 3),
        message=found.now.caution,
        tested=len(found.moves),
        significance=found.level,
        moved=found.moved,
        metrics={name: Change(before=old.value, after=after[name].value) for name, old in metrics},
        versions=changed or None,
    )


def _before(made: CheckRecord, before: baselines.Kept, after: baselines.Kept) -> Before:
    """Return the section of the page on what moved, with images before and now by their names."""
    shown = {}
    later = {name: averaged(after[name], old.shape) for name, old in before.items()}
    errors = {name: LEADING(later[name], old) for name, old in before.items()}
    # What moved most comes first.
    for name in sorted(errors, key=lambda name: -errors[name].mean()):
        caption = READERS.get(name, name)
        shown[f"{caption}, before"] = images.tonemap(before[name])
        shown[f"{caption}, now"] = images.tonemap(later[name])
        error = f"{caption}, {LEADING.label} between them, 0 to {LARGEST_ERROR:g}"
        shown[error] = images.error_map(errors[name], LARGEST_ERROR)
    return Before(
        check=made,
        pictures={name: images.webp(picture, lossless=True) for name, picture in shown.items()},
    )


def write_page(
    folder: Path, title: str, views: Sequence[SceneView] = (), moved: Sequence[Before] = ()
) -> Path:
    """Write the page of what moved, and its details, into a folder; return the page's path."""
    details = page.details(records=[view.record for view in views])
    results.write(folder / results.DETAILS, details)
    results.write(folder / results.PAGE, page.render(views, title, moved=moved))
    return folder / results.PAGE


# --- Pictures --------------------------------------------------------------------------------


def examine_pictures(
    path: Path, pattern: str, level: float, tolerance: Tolerance | None = None
) -> tuple[CheckRecord, Before | None]:
    """Check pictures that match a pattern against their baseline, for drift or by a tolerance."""
    begin = perf_counter()
    baseline, before = baselines.read_pictures(path)
    after, files = baselines.read_repeats(pattern, baseline.transfer, baseline.over)
    found = check_pictures(before, after, level)
    gate = None
    has_failed = bool(found.moved)
    if tolerance is not None:
        gate = picture_gate(before, after, tolerance.within, tolerance.bound)
        has_failed = gate.state != "pass"
    status = "failed" if has_failed else "passed"
    made = of_pictures(path, pattern, status=status, found=found, begin=begin, files=files)
    if gate is not None:
        made = structs.replace(made, gate=gate, message=gate.sentence)
    if not has_failed:
        return made, None
    return picture_section(made, before, found)


def picture_section(
    made: CheckRecord, before: Repeats, found: PictureCheck
) -> tuple[CheckRecord, Before]:
    """Return the record of pictures that failed, with the cause, and their section of the page."""
    causes = (found.cause(),) if found.moved else ()
    made = structs.replace(made, passed=False, causes=causes)
    old = {"picture": baselines.small(before.mean), "blocks": found.blocks.before}
    return made, _before(made, old, {"picture": found.after.mean, "blocks": found.blocks.after})


def update_pictures(
    path: Path,
    pattern: str,
    transfer: Any,
    over: str | None,
    level: float,
    progress: Progress | None = None,
) -> tuple[CheckRecord, None]:
    """Write the baseline of the pictures that match a pattern, unless nothing moved from it."""
    begin = perf_counter()
    known = baselines.picture_record(path) if path.exists() else None
    if known is not None:
        transfer = transfer or known.transfer
        over = over or known.over
    repeats, files = baselines.read_repeats(pattern, transfer, over)
    before = None
    if known is not None and (transfer, over) == (known.transfer, known.over):
        before = _comparable(path, known, repeats)
    found = None if before is None else check_pictures(before, repeats, level)
    status = "created" if known is None else "updated"
    if found is not None and not found.moved:
        status = "unchanged"
    else:
        baselines.write_pictures(path, repeats, transfer, over)
    found = found or check_pictures(repeats, repeats, level)
    made = of_pictures(path, pattern, status=status, found=found, begin=begin, files=files)
    return made, None


def _comparable(path: Path, known: PictureBaseline, repeats: Repeats) -> Repeats | None:
    """Return a baseline's repeats if others are as many and as large; None if it is damaged."""
    try:
        before = baselines.kept_repeats(path, known)
    except InputError:
        return None
    is_alike = before.count == repeats.count and before.mean.shape == repeats.mean.shape
    return before if is_alike else None


def of_pictures(
    path: Path,
    pattern: str,
    status: Any,
    found: PictureCheck,
    begin: float,
    files: PictureFiles | None = None,
) -> CheckRecord:
    """Return the record of a check of pictures that match a pattern, in ``files`` if in any."""
    changes = found.smallest_changes()
    return CheckRecord(
        baseline=path.as_posix(),
        scene=pattern,
        status=status,
        seconds=round(perf_counter() - begin, 3),
        message=_caught(changes, found.before),
        tested=found.picture.before.size + found.blocks.before.size,
        significance=found.level,
        moved=found.moved,
        smallest_changes=changes,
        picture=files,
    )


def _caught(changes: SmallestChanges, before: Repeats) -> str:
    """Return the sentence on what could not be seen, relative to the mean of the picture."""
    whole = max(before.mean.mean(), LINEAR_ROUNDING)
    picture = f"{100 * max(changes.mean) / whole:.2g} %"
    block = f"{100 * max(changes.block) / whole:.2g} %"
    noisiest = f"{100 * max(changes.noisiest) / whole:.2g} %"
    equal = " The repeats are equal: if their renderer is random, give each its own seed."
    return (
        f"caught in {100 * changes.power:g} % of cases: a change of the mean by {picture}, of a"
        f" block of {SIDE} x {SIDE} pixels by {block} of it, of the noisiest block by {noisiest};"
        f" smaller ones may be missed.{'' if before.variance.any() else equal}"
    )


# --- All baselines of a command --------------------------------------------------------------


def examine_all(
    pool: Pool,
    path: Path,
    significance: float,
    seed: int | None,
    folder: Path,
    patterns: Mapping[Path, str],
    tolerance: Tolerance | None = None,
) -> tuple[list[CheckRecord], list[SceneView], list[Before]]:
    """Check one baseline or a folder of them in a pool; the significance is shared.

    ``seed`` replaces the baselines' unless it is None; failures go to ``folder``; ``patterns``
    name the new pictures of baselines, which a ``tolerance`` judges in place of drift.
    """
    paths = sorted({*baselines.find(path), *patterns})
    level = level_of_each(significance, len(paths))
    calls = [
        (baseline, level, seed, folder / baseline.stem, patterns.get(baseline), tolerance)
        for baseline in paths
    ]
    found = _each(pool, examine_one, calls)
    scenes = [view for _, view in found if isinstance(view, SceneView)]
    return [made for made, _ in found], scenes, [v for _, v in found if isinstance(v, Before)]


def update_all(
    pool: Pool,
    path: Path,
    scenes: Sequence[str],
    with_pictures: bool,
    significance: float,
    options: Mapping[str, Any],
    patterns: Mapping[Path, str],
) -> list[CheckRecord]:
    """Write one baseline or several, except those with the same options of which nothing moved.

    Without ``scenes``, the files name them; ``options`` replace theirs. With ``patterns``, only
    baselines of pictures are written.
    """
    if patterns:
        how = options.get("transfer"), options.get("over")
        shots = [(baseline, word, *how, significance) for baseline, word in patterns.items()]
        return [made for made, _ in _each(pool, update_pictures, shots)]
    calls = [
        (baseline, scene, with_pictures, significance, options)
        for baseline, scene in _targets(path, scenes)
    ]
    return [made for made, _ in _each(pool, update_one, calls)]


def _each(
    pool: Pool, function: Judging, calls: Sequence[tuple[Any, ...]]
) -> list[tuple[CheckRecord, SceneView | Before | None]]:
    """Return the result of each baseline, in order; its path is the first argument."""
    results = {}
    tasks = [
        Task(
            name=call[0].name,
            function=function,
            arguments=call,
            tells=True,
            ends_process=baselines.may_run_script(call[0]),
        )
        for call in calls
    ]
    with progress.shown(pool, "baselines") as shown:
        for task, outcome in shown.each(tasks):
            path = task.arguments[0]
            error = outcome.exception()
            results[path] = (failed(path, error), None) if error else outcome.result()
    return [results[call[0]] for call in calls]


def failed(path: Path, error: BaseException) -> CheckRecord:
    """Return the result of a baseline that an exception kept from being judged."""
    kind = "" if isinstance(error, FotismosError) else f"{type(error).__name__}: "
    where = "" if str(error).startswith(str(path)) else f"{path}: "
    return CheckRecord(
        baseline=path.as_posix(),
        scene="",
        status="error",
        passed=False,
        seconds=0.0,
        message=f"{where}{kind}{error}",
    )


def examine_one(
    path: Path,
    level: float,
    seed: int | None,
    folder: Path,
    pattern: str | None,
    tolerance: Tolerance | None = None,
    progress: Progress | None = None,
) -> tuple[CheckRecord, SceneView | Before | None]:
    """Check one baseline, of a scene or of the pictures that match a pattern."""
    if pattern is not None:
        return examine_pictures(path, pattern, level, tolerance)
    file = baselines.read(path)
    return examine(file, file.open(seed), level, folder, progress)


def update_one(
    path: Path,
    scene: str | None,
    with_pictures: bool,
    significance: float,
    options: Mapping[str, Any],
    progress: Progress | None = None,
) -> tuple[CheckRecord, None]:
    """Write one baseline; ``scene`` is None if the file names it."""
    if with_pictures:
        baselines.require_own_pictures(path)
    options = baselines.options_for(options, path)
    if path.exists():
        file = baselines.read(path)
        old = file.baseline
        if scene is not None and baselines.scene_for(scene, path) != old.scene:
            raise InputError(
                f"{path}: this is the baseline of {old.scene}, not of {scene}. Give another file"
                f" for {scene}, or delete this one."
            )
        scene = baselines.scene_from(old.scene, path)
        options = dict(old.options) | options
        # With equal options only what moved is written; with others the old numbers mean nothing.
        if Options.of(options) == Options.of(old.options):
            return update(file, file.open(), significance, with_pictures, progress), None
        with_pictures = with_pictures or bool(old.images)
    assert scene is not None, "a missing baseline comes with its scene"
    case = open_case(scene, Options.of(baselines.options_from(options, path)))
    return create(
        path,
        baselines.scene_for(scene, path),
        case=case,
        with_pictures=with_pictures,
        progress=progress,
    ), None


def _targets(path: Path, scenes: Sequence[str]) -> list[tuple[Path, str | None]]:
    """Return ``(file, scene)`` of each baseline to write; without a scene, its file names it."""
    if path.suffix == ".json":
        if len(scenes) > 1:
            raise InputError(f"{path}: a baseline is of one --scene; give a folder for several.")
        if not scenes and not path.exists():
            raise InputError(f"{path}: there is no such baseline. Give its --scene.")
        return [(path, scenes[0] if scenes else None)]
    if scenes:
        named = {path / f"{baselines.name_of(scene)}.json": scene for scene in scenes}
        if len(named) < len(scenes):
            raise InputError(
                f"{', '.join(scenes)}: two scenes have one name. Give a file for each."
            )
        return list(named.items())
    return [(baseline, None) for baseline in baselines.find(path)]
