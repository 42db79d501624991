"""All baselines of one command: checked, or written."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from comparisons.case import Request, open_case
from comparisons.check.moved import level_of_each
from comparisons.compare import Progress
from comparisons.gallery.builtin import SCENES
from comparisons.processes.pool import Pool
from comparisons.processes.worker import Task
from heuristic.errors import InputError
from reports.ci import baselines, checks
from reports.ci.baselines import BaselineFile
from reports.ci.checks import Result
from reports.terminal import progress


def examine(
    pool: Pool, path: Path, significance: float, seed: int | None, folder: Path
) -> list[Result]:
    """Check one baseline or a folder of them in a pool; the significance is shared.

    ``seed`` replaces the baselines' unless it is None; ``folder`` is for pictures of failures.

    Raises
    ------
    InputError
        If there is no baseline.
    """
    paths = baselines.find(path)
    level = level_of_each(significance, len(paths))
    given = [(one, level, seed, folder / one.stem) for one in paths]
    return _each(pool, examine_one, given)


def _each(
    pool: Pool, function: Callable[..., Result], given: Sequence[tuple[Any, ...]]
) -> list[Result]:
    """Return the result of each baseline, in order; ``given`` has the arguments, its path first."""
    paths = [arguments[0] for arguments in given]
    with progress.shown() as bar:
        tasks = [Task(each[0].name, function, each, bar.of(each[0].stem)) for each in given]
        found = {}
        for task, outcome in pool.each(tasks):
            path = task.arguments[0]
            error = outcome.exception()
            found[path] = checks.failed(path, error) if error else outcome.result()
    return [found[path] for path in paths]


def examine_one(
    path: Path, level: float, seed: int | None, folder: Path, progress: Progress | None = None
) -> Result:
    """Check one baseline; the result, which can be pickled, reports any exception.

    Parameters
    ----------
    level
        Chance of an alarm though nothing changed, for this baseline alone.
    seed
        Replaces the baseline's, unless it is None.
    folder
        For the pictures of a failure.
    progress
        See :func:`comparisons.compare.compare`.
    """
    return checks.guarded(_examine, path, level, seed, folder, progress)


def _examine(
    path: Path, level: float, seed: int | None, folder: Path, progress: Progress | None
) -> Result:
    file = baselines.read(path)
    return checks.examine(file, file.open(seed), level, folder, progress)


def update(
    pool: Pool,
    path: Path,
    scenes: Sequence[str],
    images: bool,
    significance: float,
    given: Mapping[str, Any],
) -> list[Result]:
    """Write one baseline or several, except those with the same options of which nothing moved.

    Parameters
    ----------
    scenes
        The baselines' scenes; if empty, those that the files name.
    images
        Keep small pictures next to the baselines.
    given
        Options, which replace the baselines'.

    Raises
    ------
    InputError
        If two baselines would have one name, or one has no scene.
    """
    targets = _targets(path, scenes)
    return _each(
        pool, update_one, [(one, scene, images, significance, given) for one, scene in targets]
    )


def update_one(
    path: Path,
    scene: str | None,
    images: bool,
    significance: float,
    given: Mapping[str, Any],
    progress: Progress | None = None,
) -> Result:
    """Write one baseline, see :func:`update`; ``scene`` is None if the file names it."""
    return checks.guarded(_update, path, scene, images, significance, given, progress)


def _update(
    path: Path,
    scene: str | None,
    images: bool,
    significance: float,
    given: Mapping[str, Any],
    progress: Progress | None,
) -> Result:
    file, given = _readable(path, scene), baselines.options_for(given, path)
    if file is not None:
        old = file.baseline
        if scene is None or baselines.scene_for(scene, path) == old.scene:
            scene, given = baselines.scene_from(old.scene, path), dict(old.options) | given
            if Request.of(given).stated() == old.options:
                return checks.update(file, file.open(), significance, images, progress)
        else:
            raise InputError(
                f"{path}: this is the baseline of {old.scene}, not of {scene}. Give another file"
                f" for {scene}, or delete this one."
            )
        images = images or bool(old.images)
    assert scene is not None, "a baseline that cannot be read comes with its scene"
    case = open_case(scene, Request.of(baselines.options_from(given, path)))
    named = baselines.scene_for(scene, path)
    return checks.create(path, named, case, images, progress)


def _readable(path: Path, scene: str | None) -> BaselineFile | None:
    """Read a baseline; None if it is missing, or broken while its scene is given.

    Raises
    ------
    InputError
        For a broken one without a scene, and for a file that never was a baseline.
    """
    if not path.exists():
        return None
    try:
        return baselines.read(path)
    except InputError as error:
        if scene is None or not path.is_file():
            raise
        if not baselines.was_ours(path):
            raise InputError(
                f"{path}: this file is not a baseline, and is not overwritten. Give another one."
            ) from error
        return None


def _targets(path: Path, scenes: Sequence[str]) -> list[tuple[Path, str | None]]:
    """Return ``(file, scene)`` of each baseline to write; without a scene, its file names it."""
    if path.suffix == ".json":
        if len(scenes) > 1:
            raise InputError(f"{path}: a baseline is of one --scene; give a folder for several.")
        if not scenes and not path.exists():
            if path.stem not in SCENES:
                raise InputError(f"{path}: there is no such baseline. Give its --scene.")
            scenes = (path.stem,)
        return [(path, scenes[0] if scenes else None)]
    if scenes:
        named = {path / f"{baselines.name_of(scene)}.json": scene for scene in scenes}
        if len(named) < len(scenes):
            raise InputError(
                f"{', '.join(scenes)}: two scenes have one name. Give a file for each."
            )
        return list(named.items())
    return [(one, None) for one in baselines.find(path)]
