"""The work of ``fotismos compare`` and ``fotismos report``."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

from fotismos.comparisons.names import picture_parts, with_files
from fotismos.comparisons.options import Options
from fotismos.comparisons.processes.pool import Pool, Task, Turn
from fotismos.heuristic.errors import FotismosError
from fotismos.reports.files import results
from fotismos.reports.jobs import Job, open_page
from fotismos.reports.page.scene_view import SceneView
from fotismos.reports.run import batch
from fotismos.reports.terminal.words import echo, is_quiet

if TYPE_CHECKING:  # only a report has hard cases
    from fotismos.comparisons.hard_cases import HardCases


def run(
    pool: Pool,
    scenes: Sequence[str],
    output: Path,
    job: Job,
    max_visible: float | None,
    junit: Path | None,
    summary_file: Path | None,
    is_opened: bool,
    with_hard_cases: bool = False,
) -> int:
    """Compare scenes or pictures, print the gates, write files for CI, return the exit code."""
    on_page = open_page if is_opened else None
    options = with_files(job.options)
    job = replace(job, options=options)
    subjects = _subjects(scenes, options)
    if max_visible is None and junit is None and summary_file is None:
        cases = Task("hard cases", hard_cases, (output,)) if with_hard_cases else None
        batch.run(pool, subjects, output, job, cases, on_page)
        return 0
    from fotismos.reports.ci import summary  # loaded late: most comparisons need no CI

    shader = job.options.heuristic.partition(":")[0]  # FILE:NAME, or a name alone
    pictures = [picture_parts(word)[0] for word in options.picture_files]
    summary.require_free(junit, summary_file, [*scenes, shader, *pictures])
    code = 0

    def finish(
        folder: Path, views: Sequence[SceneView], errors: Mapping[str, FotismosError]
    ) -> None:
        nonlocal code
        summary.require_free(junit, summary_file, [])  # nor what this command wrote
        studied = [view.studied for view in views]
        gates = summary.gates([record for record, _ in studied], max_visible, job.within)
        code = int(any(gate.state != "pass" for gate in gates))
        for line in summary.gate_lines(gates) if gates else ():
            if code or not is_quiet():  # the reason of a failure is never lost
                echo(line, err=is_quiet())
        summary.write_junit(junit, lambda: summary.junit_of_gates(gates, errors))
        page = str(folder / "index.html") if views else ""
        summary.append(
            summary_file,
            lambda: summary.of_comparison(
                studied, gates, errors=errors, page=page, threshold=job.within
            ),
        )

    batch.run(pool, subjects, output, job, on_page=on_page, finish=finish)
    return code


def _subjects(scenes: Sequence[str], options: Options) -> batch.Subjects:
    """Return what is compared: scenes, or two pictures without one."""
    if scenes:
        from fotismos.reports.run import scene  # loaded late: two pictures need no Mitsuba

        return scene.subjects(scenes)
    from fotismos.reports.run import pictures  # loaded late: most comparisons are of scenes

    return pictures.subjects(options)


def hard_cases(folder: Path) -> "tuple[HardCases, float]":
    """Evaluate the hard cases; return them, and the seconds that it took in its turn."""
    from fotismos.comparisons.hard_cases import collect  # loaded late: only for a report

    with Turn(folder, folder / results.TABLES):
        begin = perf_counter()
        return collect(), perf_counter() - begin
