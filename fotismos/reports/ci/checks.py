"""Checking against baselines, and writing them: one, or all of a command."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from time import perf_counter
from typing import Any

from msgspec import structs
from PIL.Image import Image

from fotismos.comparisons.case import Case, open_case
from fotismos.comparisons.check.measured import (
    Measured,
    made_small,
    measure_scene,
    read_repeats,
)
from fotismos.comparisons.check.moved import LEVEL, Check, HalfCheck, check
from fotismos.comparisons.departure.blocks import averaged, shrunk
from fotismos.comparisons.departure.drift import LINEAR_ROUNDING, SIDE, level_of_each
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.options import Options
from fotismos.comparisons.processes.pool import Pool, Task
from fotismos.comparisons.records.check import (
    PICTURE,
    READERS,
    Change,
    CheckRecord,
    Tolerance,
)
from fotismos.heuristic.errors import FotismosError, InputError
from fotismos.heuristic.program import versions
from fotismos.reference.records import to_json
from fotismos.reference.rendering.passes import Progress
from fotismos.reports.ci import baselines, summary
from fotismos.reports.ci.baselines import BaselineFile
from fotismos.reports.files import images, results
from fotismos.reports.page.scene_view import Before
from fotismos.reports.page.templating import head, rendered
from fotismos.reports.terminal import progress

RECORD = "check.json"
PANELS = ("before", "now", LEADING.name)
"""The files of a failure: its record, and the endings of its pictures' names."""

LARGEST_ERROR = 2.0
"""ΔE2000 at which the map's colours end: changes are often hardly noticeable."""

LONGEST_SHOWN = 256
"""Pixels of the longer side of the pictures on the page."""

Asked = Any
"""What is asked, a :class:`fotismos.reports.commands.check.Check`, which imports this module."""

Outcome = tuple[CheckRecord, Before | None]
"""The result for a baseline, and its section of the page if it failed."""


# --- One baseline ----------------------------------------------------------------------------


def examine(
    file: BaselineFile,
    now: Measured,
    scene: str,
    level: float = LEVEL,
    folder: Path | None = None,
    tolerance: Tolerance | None = None,
) -> Outcome:
    """Compare what there is now with a baseline, for drift or by a tolerance.

    ``scene`` is the scene's name, or the pattern of pictures. ``level`` is the chance of an alarm
    though nothing changed. After a failure, pictures and ``check.json`` are written to ``folder``;
    else those of an earlier one are deleted.
    """
    begin = perf_counter()
    checked = check(file.halves, now, level)
    gate = None
    has_failed = bool(checked.moves)
    if tolerance is not None:
        record = checked.halves[0].comparison.record
        (gate,) = summary.gates([record], tolerance.bound, tolerance.within)
        has_failed = gate.state != "pass"
    result = _record(file, checked, scene=scene, status="failed" if has_failed else "passed")
    if gate is not None:
        sentence = summary.sentence(gate)
        result = structs.replace(result, gate=gate, headline=sentence, message=sentence)
    if has_failed:
        result = structs.replace(result, passed=False, causes=tuple(checked.causes()))
    result = structs.replace(result, seconds=round(now.seconds + perf_counter() - begin, 3))
    if folder is not None:
        names = [f"{half.name}-{panel}.png" for half in checked.halves for panel in PANELS]
        results.clear(folder, (RECORD, *names))
    if not has_failed:
        return result, None
    # The half that moved most comes first.
    halves = sorted(checked.halves, key=lambda half: -half.error.mean())
    panels = {half.name: _panels(half) for half in halves}
    if folder is not None:
        result = structs.replace(result, pictures=folder.as_posix())
        folder.parent.mkdir(parents=True, exist_ok=True)
        results.own(folder)
        for half, shown in panels.items():
            for panel, picture in zip(PANELS, shown.values(), strict=True):
                results.write(folder / f"{half}-{panel}.png", images.png(picture))
        results.write(folder / RECORD, to_json(result))
    pictures = {
        caption: images.webp(picture, lossless=True)
        for shown in panels.values()
        for caption, picture in shown.items()
    }
    return result, Before(check=result, pictures=pictures)


def update(
    path: Path,
    scene: str | None,
    options: Mapping[str, Any],
    now: Measured,
    word: str,
    level: float = LEVEL,
    file: BaselineFile | None = None,
) -> CheckRecord:
    """Write a baseline of what there is now, unless nothing moved from that in its ``file``.

    ``scene`` is None of pictures, and ``word`` the pattern of their files. Without a file, or if it
    kept something else, what it held does not count.
    """
    begin = perf_counter()
    old = path.with_suffix(baselines.OLD_SUFFIX)
    is_old = old.exists()
    target = path.with_suffix(baselines.SUFFIX)
    status = "updated" if is_old or target.exists() else "created"
    new = BaselineFile.of(target, scene, options, now)
    # What cannot be compared is replaced, and nothing moved since.
    before = file if file is not None and _are_comparable(file, now) else new
    checked = check(before.halves, now, level)
    if before is new or checked.moves:
        baselines.write(new)
    else:
        status = "unchanged"
    result = _record(before, checked, scene=word, status=status)
    if is_old:
        replaced = (
            f"{old.name} of fotismos 0.4 could not be compared: {target.name}, in its place, begins"
            " with what there is today."
        )
        result = structs.replace(result, message=" ".join(filter(None, (replaced, result.message))))
    return structs.replace(result, seconds=round(now.seconds + perf_counter() - begin, 3))


def update_scene(
    path: Path,
    scene: str,
    case: Case,
    level: float = LEVEL,
    file: BaselineFile | None = None,
    progress: Progress | None = None,
) -> CheckRecord:
    """Write the baseline of a scene, as :func:`update` does.

    Unless its ``file`` has the same options, it is rendered at a small size, which is kept.
    """
    if file is not None:
        now = file.rendered(case, progress)
        return update(path, scene, file.baseline.options, now, scene, level, file)
    case = made_small(case)
    now = measure_scene(case.source, case.options, progress=progress)
    # The number of samples becomes an option: every later check takes as many.
    options = baselines.options_for(case.changed(spp=now.spp).options.stated(), path)
    return update(path, scene, options, now, scene, level)


def _are_comparable(known: BaselineFile, now: Measured) -> bool:
    """Return whether a baseline's passes are as many and as large as those of now."""
    return all(
        len(known.halves[name].files) == len(half.files) and known.halves[name].size == half.size
        for name, half in now.halves.items()
    )


def _record(file: BaselineFile, checked: Check, scene: str, status: Any) -> CheckRecord:
    now = versions()
    changed = {
        name: Change(before=old, after=now.get(name, "none"))
        for name, old in file.baseline.versions.items()
        if now.get(name) != old
    }
    before = checked.now.metrics(file.halves)
    after = checked.now.metrics(checked.now.halves)
    metrics = None
    if before is not None and after is not None:
        metrics = {name: Change(before=before[name], after=after[name]) for name in after}
    half = checked.halves[0]
    is_picture = half.name == PICTURE
    picture = checked.now.halves[PICTURE].record() if is_picture else None
    return CheckRecord(
        baseline=file.path.as_posix(),
        scene=scene,
        status=status,
        seconds=0.0,
        message=_caught(half) if is_picture else checked.now.caution,
        headline=checked.headline(),
        tested=checked.tested,
        significance=checked.level,
        moved=checked.moves,
        metrics=metrics,
        versions=changed or None,
        smallest_changes={half.name: half.smallest_changes() for half in checked.halves},
        picture=picture,
    )


def _caught(half: HalfCheck) -> str:
    """Return the sentence on what could not be seen, relative to the mean of the picture."""
    changes = half.smallest_changes()
    whole = max(half.before.mean.mean(), LINEAR_ROUNDING)
    picture = f"{100 * max(changes.mean) / whole:.2g} %"
    block = f"{100 * max(changes.block) / whole:.2g} %"
    noisiest = f"{100 * max(changes.noisiest) / whole:.2g} %"
    equal = " The repeats are equal: if their renderer is random, give each its own seed."
    return (
        f"caught in {100 * changes.power:g} % of cases: a change of the mean by {picture}, of a"
        f" block of {SIDE} x {SIDE} pixels by {block} of it, of the noisiest block by {noisiest};"
        f" smaller ones may be missed.{'' if half.before.variance.any() else equal}"
    )


def _panels(half: HalfCheck) -> dict[str, Image]:
    """Return the pictures of a half by their captions: before, now, and the map of the change."""
    shape = shrunk(half.before.mean.shape[:2], LONGEST_SHOWN)
    subject = READERS[half.name]
    change = f"{subject}, what moved: {LEADING.label}, 0 to {LARGEST_ERROR:g}"
    return {
        f"{subject}, before": images.tonemap(averaged(half.before.mean, shape)),
        f"{subject}, now": images.tonemap(averaged(half.after.mean, shape)),
        change: images.error_map(half.error, LARGEST_ERROR),
    }


# --- The page --------------------------------------------------------------------------------


def write_page(folder: Path, sections: Sequence[Before], outcome: str = "") -> Path:
    """Write the page of what moved into a folder; return its path.

    ``outcome`` says how many baselines were checked.
    """
    first = sections[0]
    others = len(sections) - 1
    title = first.check.headline
    title = f"{first.check.name}: {title}; and {others} more" if others else title
    html = rendered(
        "check_page.html.j2",
        title=title,
        outcome=outcome,
        head=head("check", None),
        sections=sections,
    )
    results.write(folder / results.PAGE, html)
    return folder / results.PAGE


# --- All baselines of a command --------------------------------------------------------------


def examine_all(pool: Pool, asked: Asked, folder: Path) -> list[Outcome]:
    """Check the baselines of a command in a pool; they share its significance.

    Failures go to ``folder``.
    """
    paths = sorted({*baselines.find(asked.baseline), *asked.patterns})
    level = level_of_each(asked.significance, len(paths))
    calls = [(path, asked, level, folder / path.stem) for path in paths]
    return _outcomes(pool, examine_one, calls)


def update_all(pool: Pool, asked: Asked) -> list[Outcome]:
    """Write the baselines of a command, except those of which nothing moved."""
    paths = asked.patterns or asked.scene_words or baselines.find(asked.baseline)
    return _outcomes(pool, update_one, [(path, asked) for path in paths])


def _outcomes(
    pool: Pool, function: Callable[..., Outcome], calls: Sequence[tuple[Any, ...]]
) -> list[Outcome]:
    """Return the result of each baseline, in order; its path is the first argument."""
    outcomes = {}
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
            outcomes[path] = (failed(path, error), None) if error else outcome.result()
    return [outcomes[call[0]] for call in calls]


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
    path: Path, asked: Asked, level: float, folder: Path, progress: Progress | None = None
) -> Outcome:
    """Check one baseline, of a scene or of the pictures that match a pattern."""
    file = baselines.read(path)
    pattern = asked.patterns.get(path)
    baselines.require_kind(path, file.baseline.scene, pattern)
    if pattern is not None:
        now = read_repeats(pattern, Options.of(file.baseline.options))
        return examine(file, now, pattern, level, folder, tolerance=asked.tolerance)
    now = file.rendered(file.open(asked.changes.get("seed")), progress)
    return examine(file, now, str(file.baseline.scene), level, folder)


def update_one(path: Path, asked: Asked, progress: Progress | None = None) -> Outcome:
    """Write one baseline, of a scene or of the pictures that match a pattern."""
    pattern = asked.patterns.get(path)
    word = asked.scene_words.get(path)
    options = baselines.options_for(asked.changes, path)
    level = asked.significance
    known = baselines.known(path) if path.exists() else None
    if known is not None:
        baselines.require_kind(path, known.scene, pattern)
        options = dict(known.options) | options
    file = known.file if known and Options.of(options) == Options.of(known.options) else None
    if pattern is not None:
        now = read_repeats(pattern, Options.of(options))
        return update(path, None, options, now, pattern, level, file), None
    if known is not None:
        if word is not None and baselines.scene_for(word, path) != known.scene:
            raise InputError(
                f"{path}: this is the baseline of {known.scene}, not of {word}. Give another file"
                f" for {word}, or delete this one."
            )
        word = baselines.scene_from(str(known.scene), path)
    assert word is not None, "a missing baseline comes with its scene"
    case = open_case(word, Options.of(baselines.options_from(options, path)))
    scene = baselines.scene_for(word, path)
    return update_scene(path, scene, case, level, file, progress), None
