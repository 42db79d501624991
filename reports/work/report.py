"""The work of ``fotismos report``."""

from pathlib import Path
from time import perf_counter

from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.comparisons.hard_cases import HardCases, collect
from fotismos.comparisons.processes.pool import Pool, Task, Turn
from fotismos.reports.files import results
from fotismos.reports.jobs import Job, open_page
from fotismos.reports.run import batch, scene


def run(pool: Pool, output: Path, job: Job, is_opened: bool) -> None:
    """Compare all built-in scenes, and evaluate the hard cases."""
    cases = Task("hard cases", hard_cases, (output,))
    on_page = open_page if is_opened else None
    batch.run(pool, scene.subjects(tuple(SCENES)), output, job, cases, on_page)


def hard_cases(folder: Path) -> tuple[HardCases, float]:
    """Evaluate the hard cases; return them, and the seconds that it took in its turn."""
    with Turn(folder, folder / results.TABLES):
        begin = perf_counter()
        return collect(), perf_counter() - begin
