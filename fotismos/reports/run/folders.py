"""Scenes whose results go to a folder each, such as ``OUTPUT/cost/SCENE``."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from fotismos.comparisons.names import file_of, is_script, name_of
from fotismos.comparisons.processes.pool import Pool, Task
from fotismos.reports.files import results
from fotismos.reports.jobs import command_line
from fotismos.reports.terminal import progress


def results_of(
    pool: Pool,
    folder: Path,
    scenes: Sequence[str],
    work: Callable[..., Any],
    files: Sequence[Path] = (),
) -> dict[Path, Any]:
    """Return what ``work(scene, folder, progress)`` returns for each scene, by folder.

    The scenes' folders are below ``folder``. With ``files``, which are pictures, ``scenes`` are
    only names.
    """
    subjects: list[tuple[str, Path | None]] = list(zip(scenes, files, strict=False))
    if not files:
        subjects = [(name_of(scene), file_of(scene)) for scene in scenes]
    with (
        results.hold_results(folder, subjects, command_line()) as places,
        progress.shown(pool, "scenes") as shown,
    ):
        tasks = [
            Task(
                name=target.name,
                function=work,
                arguments=(scene, target),
                tells=True,
                ends_process=not files and is_script(scene),
            )
            for target, scene in zip(places, scenes, strict=True)
        ]
        return {folder / task.name: done.result() for task, done in shown.each(tasks)}
