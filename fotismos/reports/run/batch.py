"""All scenes of a command: comparing them, writing their results and the page.

A scene that cannot be compared does not stop the others: the page names it with its error, and the
command ends with that error's exit code. Scenes are compared in separate processes, which one of
them may kill. The page grows with them.
"""

import os
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from shutil import get_terminal_size
from time import perf_counter
from typing import TYPE_CHECKING, Any

import click

from fotismos.comparisons.departure.criterion import LIMIT, checked_threshold
from fotismos.comparisons.names import is_script, picture_parts
from fotismos.comparisons.options import Options
from fotismos.comparisons.processes.pool import Pool, Task
from fotismos.heuristic.errors import FotismosError, InputError, InstallationError, OutputError
from fotismos.heuristic.program import LIBRARIES, versions
from fotismos.reference.records import Machine, to_json
from fotismos.reports import jobs, tables, verdict
from fotismos.reports.files import results
from fotismos.reports.files.results import FIGURES, START, TABLES, Failure, RunRecord
from fotismos.reports.jobs import Job, Terminal, command_line
from fotismos.reports.page import page
from fotismos.reports.page.page import PageScene
from fotismos.reports.page.scene_view import SceneView
from fotismos.reports.run import scene_files
from fotismos.reports.terminal import progress
from fotismos.reports.terminal.table import Table, printed, room
from fotismos.reports.terminal.words import as_typed, is_quiet, remark, tell, tell_where

if TYPE_CHECKING:  # a comparison has no hard cases
    from fotismos.comparisons.hard_cases import HardCases

GROWTH = 1.25
"""Factor by which a page grows before it is written again, so that the work is linear in scenes."""


@dataclass
class Batch:
    """The results so far, by the names ``targets`` of the scenes' folders, in order.

    At most the share ``bound`` of the pixels may differ by more than ``within``. ``stages`` is wall
    time in seconds. ``on_page`` is called with the page's path once it exists.
    """

    folder: Path
    targets: Sequence[str]
    on_page: Callable[[Path], object] | None
    command: str
    within: float
    bound: float = LIMIT
    libraries: Sequence[str] = LIBRARIES
    stages: defaultdict[str, float] = field(default_factory=lambda: defaultdict(float))
    views: dict[str, PageScene] = field(default_factory=dict)
    first_views: dict[str, PageScene] = field(default_factory=dict)
    errors: dict[str, FotismosError] = field(default_factory=dict)
    hard_cases: "HardCases | None" = None
    growth: int = 0
    next_page: float = 0.0

    @property
    def ordered(self) -> list[PageScene]:
        """The views in the order of the scenes; the first ones of scenes that are not done."""
        views = self.first_views | self.views
        return [views[target] for target in self.targets if target in views]

    @property
    def done(self) -> int:
        """The number of scenes that are over."""
        return len(self.views) + len(self.errors)

    def failures(self) -> list[Failure]:
        """The scenes that could not be compared, in order."""
        errors = self.errors
        return [
            Failure(scene=target, error=as_typed(str(errors[target])))
            for target in self.targets
            if target in errors
        ]

    def record(self) -> RunRecord:
        """The record of the run, with its stages until now."""
        # Stages are summed over processes, and may exceed the wall time.
        other = perf_counter() - START - sum(self.stages.values())
        return RunRecord(
            command=self.command,
            stages=dict(self.stages) | {"other": max(0.0, other)},
            failures=tuple(self.failures()),
            machine=Machine.here(),
            versions=versions(self.libraries),
        )

    def write_page(self, is_interrupted: bool = False, run: RunRecord | None = None) -> None:
        """Write the page and its details, at the end with the record of the run."""
        begin = perf_counter()
        path = self.folder / results.PAGE
        state = ""
        done = f"{self.done} of {len(self.targets)} scenes are done"
        is_growing = self.done < len(self.targets) and not is_interrupted
        if is_interrupted:
            state = f"Interrupted: {done}; the same command resumes the run."
        elif is_growing:
            state = f"In progress: {done}; the page reloads by itself."
        # Details first: the page links them. While it grows, the first ones are enough.
        if not is_growing or not (self.folder / results.DETAILS).exists():
            records = [view.record for view in self.ordered]
            details = page.details(self.hard_cases, run, records)
            results.write(self.folder / results.DETAILS, details)
        html = page.render(
            self.ordered,
            failures=self.failures(),
            state=state,
            threshold=self.within,
            reloads=is_growing,
        )
        results.write(path, html)
        self.stages["page"] += perf_counter() - begin
        if self.on_page:
            self.on_page(path)
            self.on_page = None

    def show(self, task: Task, view: SceneView) -> None:
        """Put the first view of a scene on the page, which is measured in part."""
        self.first_views[task.name] = self._drawn(task.name, view)
        self.grow_page()

    def _drawn(self, target: str, view: SceneView) -> PageScene:
        """Draw a scene for all pages of the run, in place of its first view."""
        self.first_views.pop(target, None)
        taken = {scene.id for scene in self.ordered}
        return page.drawn_scene(view, taken, self.within)

    def withdraw(self) -> None:
        """Delete a page that grew, if no scene was finished, and none failed among several."""
        has_failures = self.errors and len(self.targets) > 1
        if self.growth and not self.views and not has_failures:
            results.clear(self.folder, (results.PAGE, results.DETAILS))

    def take(self, target: str, outcome: Future[Any]) -> None:
        """Take the view of a scene, or its error, and show it on the page."""
        try:
            view, spent = outcome.result()
        except InstallationError:
            raise
        except FotismosError as error:
            self.first_views.pop(target, None)
            self.errors[target] = error
        else:
            view = scene_files.with_fit(view, self.folder / "fit" / target)
            self.views[target] = self._drawn(target, view)
            for stage, seconds in spent.items():
                self.stages[stage] += seconds
            remark(tables.details(view.record))
        self.grow_page()

    def grow_page(self) -> None:
        """Write the page of an unfinished run, unless it grew little since it was written."""
        self.growth += 1
        if self.done < len(self.targets) and self.growth >= self.next_page:
            with suppress(OutputError):  # the next scene tries again
                self.write_page()
                self.next_page = GROWTH * self.growth


Comparing = Callable[..., tuple[SceneView, dict[str, float]]]
"""A function that compares what a word names, and writes it to a place in a folder."""


Finish = Callable[[Path, Sequence[SceneView], Mapping[str, FotismosError]], int]
"""A function of the output folder, the views of compared scenes and the errors of the others.

It returns the exit code.
"""


@dataclass(frozen=True)
class Subjects:
    """What a command compares: words that name it, the name and file of each, and how.

    ``compare(word, folder, target, job, progress)`` returns the view and the seconds by stage.
    It calls ``progress`` with its stages, and with a first view once there are pictures.
    ``libraries`` are those that the results depend on.
    """

    words: tuple[str, ...]
    files: tuple[tuple[str, Path | None], ...]
    compare: Comparing
    libraries: Sequence[str] = LIBRARIES


def compare_all(
    pool: Pool,
    subjects: Subjects,
    job: Job,
    terminal: Terminal,
    hard_cases: Task | None = None,
    finish: Finish | None = None,
) -> int:
    """Compare subjects in a pool, and return the exit code.

    Writes the results of each, then the page and tables of all. The task ``hard_cases`` returns
    them for the details, and the seconds that it took. The gravest error is raised at last.
    """
    checked_threshold(job.within)
    # Before anything is written, since a placeholder may be unknown.
    words = subjects.words
    options_by_scene = dict(zip(words, _options_for(job.options, words), strict=True))
    command = command_line()
    with results.hold(terminal.output, command) as folder:
        targets = results.assigned(folder, subjects.files)
        _require_inputs_apart(job.options, [folder / target for target in targets])
        for name in (TABLES, FIGURES) if job.figures else (TABLES,):
            results.own(folder / name)
        batch = Batch(
            folder=folder,
            targets=targets,
            on_page=jobs.open_page if terminal.is_opened else None,
            command=command,
            within=job.within,
            bound=LIMIT if terminal.max_visible is None else terminal.max_visible,
            libraries=subjects.libraries,
        )
        batch.stages["start-up"] = perf_counter() - START
        tasks = [
            Task(
                name=target,
                function=subjects.compare,
                arguments=(word, folder, target, replace(job, options=options_by_scene[word])),
                tells=True,
                ends_process=is_script(word),
            )
            for target, word in zip(targets, words, strict=True)
        ]
        if hard_cases:
            tasks.append(hard_cases)
        try:
            with progress.shown(pool, "scenes") as shown:
                for task, outcome in shown.each(tasks, batch.show):
                    if task is hard_cases:
                        batch.hard_cases, batch.stages[task.name] = outcome.result()
                    else:
                        batch.take(task.name, outcome)
                        # In the order in which they ended: the last ones stay in sight.
                        ended = [*batch.views.values()][-get_terminal_size().lines :]
                        done = [view.record for view in ended]
                        columns = tables.scenes((), job.within).columns
                        shown.rows = [*printed(Table(columns, done), room())]
        except (KeyboardInterrupt, FotismosError):
            # Also if the hard cases fail, or nothing can be rendered: what is done is kept.
            # No process may write while the results are put together.
            pool.end()
            batch.first_views.clear()
            if batch.done:
                _write(batch, is_interrupted=True)
            raise
        finally:
            batch.withdraw()
        # A single scene that failed leaves no page.
        if batch.views or len(targets) > 1:
            _write(batch)
        code = finish(folder, batch.ordered, batch.errors) if finish else 0
    if batch.errors and len(targets) == 1:
        raise batch.errors.popitem()[1]
    if batch.errors:
        error = max(batch.errors.values(), key=lambda error: error.exit_code)
        count = f"{len(batch.errors)} of {len(targets)} scenes failed, "
        raise type(error)(f"{count}among them: {error}") from error
    return code


def _options_for(whole: Options, scenes: Sequence[str]) -> list[Options]:
    """Return the options for each scene: with values only for the placeholders that it has."""
    if len(scenes) == 1 or not whole.define:
        return [whole] * len(scenes)
    from fotismos.reference.scene.source import placeholders  # loaded late: it loads Mitsuba

    known = (placeholders(Path(scene)) for scene in scenes)
    by_scene = [
        {key: value for key, value in whole.define.items() if key in names} for names in known
    ]
    if unused := set(whole.define) - {key for defined in by_scene for key in defined}:
        raise InputError(
            f"-D {', '.join(sorted(unused))}: no scene has such a placeholder. Write $name into a"
            " scene file, or leave the option out."
        )
    return [whole.changed(define=define) for define in by_scene]


def _require_inputs_apart(options: Options, places: Sequence[Path]) -> None:
    """Refuse pictures in a folder whose files are about to be replaced."""
    for word in options.picture_files:
        path, _ = picture_parts(word)
        # Not by `resolve`, which fails for links that go round.
        folder = Path(os.path.realpath(path)).parent
        if folder in [target.resolve() for target in places]:
            raise InputError(
                f"{path}: this picture is in the folder of the results, and would be replaced by"
                " them. Choose another output folder with -o."
            )


def _write(batch: Batch, is_interrupted: bool = False) -> None:
    """Write the page, record and tables of all scenes as far as possible, and print the results."""
    views = batch.ordered
    folder = batch.folder
    records = [view.record for view in views]
    run = batch.record()
    errors = []
    steps: list[Callable[[], object]] = [
        lambda: batch.write_page(is_interrupted, run),
        # A new record, which has the time that the page just took.
        lambda: results.write(folder / results.RUN, to_json(batch.record())),
    ]
    if views:
        steps.append(lambda: tables.write(folder / results.TABLES, records))
    for step in steps:
        try:
            step()
        except OutputError as error:
            errors.append(error)
    if errors:
        raise errors[0]
    if views:
        tell(tables.summary(records, batch.within))
        tell(["", verdict.headline(records, batch.within)])
        sentences = [
            verdict.most_missing(records, batch.within),
            verdict.costs(records, batch.within),
            verdict.savings(records),
        ]
        tell(filter(None, sentences))
        views.sort(key=lambda view: tables.extent(view.record, batch.within), reverse=True)
        tell(verdict.advice([view.studied for view in views[: page.WORST]], batch.within))
    if is_quiet() and records and records[0].pairing is None:
        click.echo(tables.line_of_pictures(records[0], batch.within, batch.bound))
    else:
        tell_where(folder / results.PAGE)
