"""Two pictures of a command: compared and written."""

from pathlib import Path
from time import perf_counter
from typing import Any

from fotismos.comparisons.compare import finish, look
from fotismos.comparisons.names import picture_parts
from fotismos.comparisons.options import Options
from fotismos.comparisons.pictures import two_pictures
from fotismos.comparisons.steps import steps
from fotismos.heuristic.program import PICTURE_LIBRARIES
from fotismos.reports.jobs import Job
from fotismos.reports.page.scene_view import SceneView
from fotismos.reports.run import scene_files
from fotismos.reports.run.batch import Subjects


def subjects(options: Options) -> Subjects:
    """Return what a command compares: two pictures, named after the first one."""
    path, _ = picture_parts(options.image[0])
    return Subjects(
        words=(path.stem,),
        files=((path.stem, path),),
        compare=compared,
        libraries=PICTURE_LIBRARIES,
    )


def compared(
    word: str, folder: Path, target: str, job: Job, progress: Any
) -> tuple[SceneView, dict[str, float]]:
    """Compare the pictures of a job, and write their files to ``folder/target``.

    The page shows them before the slow part.
    """
    begin = perf_counter()
    halves = two_pictures(job.options, word)
    first = look(halves, job.options.command("compare", ""))
    view = scene_files.view_of(first)
    seconds = {"pictures": perf_counter() - begin}
    progress(view)
    begin = perf_counter()
    comparison = finish(first, halves, steps(why=False))
    seconds["pictures"] += perf_counter() - begin
    begin = perf_counter()
    view = scene_files.write(folder, target, comparison, first=view, with_figures=job.figures)
    return view, seconds | {"files": perf_counter() - begin}
