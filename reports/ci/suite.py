"""All baselines of one command: checked, or written."""

from comparisons.case import Request, open_case
from comparisons.check.moved import level_of_each
from comparisons.gallery.builtin import SCENES
from comparisons.processes.pool import Pool
from comparisons.processes.worker import Task
from heuristic.errors import InputError
from reports.ci import baselines, checks
from reports.terminal import progress


def examine(pool: Pool, path, significance, seed, folder):
    """Check one baseline or a folder of them in a pool; the significance is shared.

    ``seed`` replaces the baselines' own unless it is None; ``folder`` is for pictures of failures.

    Raises
    ------
    InputError
        When there is no baseline.
    """
    paths = baselines.find(path)
    level = level_of_each(significance, len(paths))
    given = [(one, level, seed, folder / one.stem) for one in paths]
    return _each(pool, examine_one, given)


def _each(pool, function, given):
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


def examine_one(path, level, seed, folder, progress=None):
    """Check one baseline; whatever fails is told in its result, which can be pickled.

    Parameters
    ----------
    level
        Chance of an alarm though nothing changed, of this baseline alone.
    seed
        In place of the baseline's own, unless it is None.
    folder
        For the pictures of a failure.
    progress
        As of :func:`comparisons.compare.compare`.

    Returns
    -------
    reports.ci.checks.Result
    """
    return checks.guarded(_examine, path, level, seed, folder, progress)


def _examine(path, level, seed, folder, progress):
    file = baselines.read(path)
    return checks.examine(file, file.open(seed), level, folder, progress)


def update(pool: Pool, path, scenes, images, significance, given):
    """Write one baseline or several, unless they are there with the same options and nothing moved.

    Parameters
    ----------
    scenes
        Those that the baselines are to be of; where there are none, the files say it.
    images
        Keep small pictures beside the baselines.
    given
        Options by name, which replace those of the baselines.

    Raises
    ------
    InputError
        When a baseline cannot be told from another, or has no scene.
    """
    targets = _targets(path, scenes)
    return _each(
        pool, update_one, [(one, scene, images, significance, given) for one, scene in targets]
    )


def update_one(path, scene, images, significance, given, progress=None):
    """Write one baseline, as :func:`update`; ``scene`` is None where the file says it."""
    return checks.guarded(_update, path, scene, images, significance, given, progress)


def _update(path, scene, images, significance, given, progress):
    file, given = _readable(path, scene), baselines.options_for(given, path)
    if file is not None:
        old = file.baseline
        if scene is None or baselines.scene_for(scene, path) == old.scene:
            scene, given = baselines.scene_from(old.scene, path), dict(old.options) | given
            if Request.of(given).stated() == old.options:
                return checks.update(file, file.open(), significance, images, progress)
        else:
            raise InputError(
                f"{path}: this is the baseline of {old.scene}, not of {scene}. Name another file"
                " for this scene, or delete that one."
            )
        images = images or bool(old.images)
    case = open_case(scene, Request.of(baselines.options_from(given, path)))
    named = baselines.scene_for(scene, path)
    return checks.create(path, named, case, images, progress)


def _readable(path, scene):
    """Read a baseline; None where it is missing, or broken while its scene is given.

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
                f"{path}: this file is not a baseline, and is left as it is. Name another one."
            ) from error
        return None


def _targets(path, scenes):
    """Return ``(file, scene)`` of the baselines to write; without a scene, the file knows it."""
    if path.suffix == ".json":
        if len(scenes) > 1:
            raise InputError(f"{path}: one baseline is of one --scene; name a folder for several.")
        if not scenes and not path.exists():
            if path.stem not in SCENES:
                raise InputError(f"{path}: there is no such baseline. Name its --scene.")
            scenes = (path.stem,)
        return [(path, scenes[0] if scenes else None)]
    if scenes:
        named = {path / f"{baselines.name_of(scene)}.json": scene for scene in scenes}
        if len(named) < len(scenes):
            raise InputError(f"{', '.join(scenes)}: two have one name. Name a file for each.")
        return list(named.items())
    return [(one, None) for one in baselines.find(path)]
