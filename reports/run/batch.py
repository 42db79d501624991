"""Comparing scenes one after another, and writing their results and the page.

A scene that cannot be compared does not stop the others: the page names it with its error, and the
command ends with that error's exit code. Scenes are compared in a separate process, which one of
them may kill. The page is written with the first picture, and again as the run continues.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from comparisons.processes.pool import Pool
from comparisons.processes.worker import Task
from heuristic.errors import FotismosError, InstallationError, LostProcessError
from reports import jobs
from reports.run import single
from reports.run.single import Wanted
from reports.terminal import verbosity

if TYPE_CHECKING:
    from reports.page.scene_view import SceneView
    from reports.run.growing import Growing
    from reports.run.stages import Run
    from reports.terminal.progress import Bar

Calls = Mapping[str, tuple[str, Path, str, Wanted]]
"""The arguments of :func:`reports.run.single.compare` for each place."""

SKETCH, WHOLE, MORE = 1.0, 8.0, 1.0
"""Relative times of a sketch, a scene and a further task, to estimate the time left."""


@dataclass(frozen=True)
class More:
    """Further content of a page: the tasks that make it, begun while the last scenes are rendered.

    ``tasks`` return a result and the seconds that it took, which count towards ``stage``;
    ``shown`` makes the page's content of the results by the tasks' names.
    """

    stage: str
    tasks: Sequence[Task]
    shown: Callable[[Mapping[str, Any]], dict[str, Any]]


def run(
    names: Iterable[str],
    folder: Path,
    wanted: Wanted,
    pool: Pool,
    more: More | None = None,
    seen: Callable[[Path], object] = lambda _: None,
    judge: Callable[[Path, Sequence[SceneView]], None] | None = None,
) -> None:
    """Compare scenes, and write the results of each, then the page and tables of all.

    Parameters
    ----------
    names
        Built-in scenes, files and folders.
    folder
        For the results.
    wanted
        What to do with each scene.
    pool
        Processes that compare the scenes; it is ended.
    more
        Further content of the page.
    seen
        Called with the page's path once the page exists.
    judge
        Called at the end with the output folder and the views of the compared scenes.

    Raises
    ------
    FotismosError
        The gravest error among scenes that could not be compared.
    """
    with pool as pool:
        pool.start()
        from reports.files import ownership
        from reports.run import output, stages
        from reports.run.growing import Growing
        from reports.run.places import places
        from reports.terminal import progress

        scenes = jobs.expand(names, wanted.with_scripts)
        requests = dict(zip(scenes, jobs.requests(wanted.request, scenes), strict=True))
        command = jobs.command_line()
        with output.held(folder, command) as folder:
            found = places(folder, scenes)
            output.require_free(folder, found, wanted.figures)
            record = stages.Run(command)
            growing = Growing(folder, found, seen)
            each = {
                place: (name, folder, place, replace(wanted, request=requests[name]))
                for place, name in found.items()
            }
            shown, error = {}, None
            total = (SKETCH * wanted.sketched + WHOLE) * len(found)
            total += MORE * len(more.tasks) if more else 0.0
            try:
                with progress.shown(total=total) as bar:
                    if wanted.sketched:
                        with record.timing("first pictures"):
                            _sketch(pool, growing, each, bar)
                    others = _compare(pool, record, growing, each, bar, more)
                    if more and growing.views:
                        shown = _further(more, record, others)
            except KeyboardInterrupt:
                pool.end()  # before clearing away its half written files
                ownership.recover(folder)
                if growing.has_begun:
                    _write(record, growing, wanted.figures, shown, is_interrupted=True)
                raise
            except FotismosError as raised:
                if not growing.views:
                    raise
                error = raised
            _write(record, growing, wanted.figures, shown)
            if judge is not None:
                judge(folder, [growing.views[place] for place in found if place in growing.views])
    if error:
        raise error
    if growing.failures:
        error = max(growing.failures.values(), key=lambda error: error.exit_code)
        count = f"{len(growing.failures)} of {len(found)} scenes failed, "
        raise type(error)(f"{count}among them: {error}") from error


def _verdict(views: Sequence[SceneView]) -> list[str]:
    """Return the lines of the verdict and its advice."""
    from reports import verdict

    found = [verdict.finding(v.record, v.cost.record if v.cost else None) for v in views]
    return ["", *verdict.sentences(found), *verdict.advice(found)]


def _tasks(function: Callable[..., object], each: Calls, bar: Bar) -> Iterator[Task]:
    from comparisons.case import name_of

    return (
        Task(place, function, words, bar.of(name_of(words[0]))) for place, words in each.items()
    )


def _sketch(pool: Pool, growing: Growing, each: Calls, bar: Bar) -> None:
    """Collect coarse views of the scenes, or the final views of finished ones."""
    bar.begin("first pictures", len(each), SKETCH)
    for task, outcome in pool.each(_tasks(single.sketch, each, bar)):
        try:
            view = outcome.result()
        except LostProcessError as error:  # it would be lost again
            growing.failures[task.name] = error
        except FotismosError:
            continue  # the full size may succeed
        else:
            (growing.coarse if view.is_coarse else growing.views)[task.name] = view
        finally:
            bar.over(task.progress)
        growing.offer()


def _compare(
    pool: Pool, record: Run, growing: Growing, each: Calls, bar: Bar, more: More | None
) -> dict[str, Future[Any]]:
    """Collect the views of the scenes that are compared, and the errors of the others.

    Returns the outcomes of further tasks.
    """
    from reports.terminal import carrier_lines, progress

    further = {task.name: task for task in more.tasks} if more else {}
    others: dict[str, Future[Any]] = {}
    left = {p: w for p, w in each.items() if p not in growing.views and p not in growing.failures}
    bar.begin("scenes", len(left), WHOLE, skipped=len(each) - len(left))
    if more and not left:
        bar.begin(more.stage, len(further), MORE)
    for task, outcome in pool.each(chain(_tasks(single.compare, left, bar), further.values())):
        if further.get(task.name) is task:
            others[task.name] = outcome
            bar.over(None, None if growing.is_whole else MORE)
            continue
        try:
            view, spent = outcome.result()
        except InstallationError:
            raise
        except FotismosError as error:
            if len(each) == 1:
                raise
            growing.failures[task.name] = error
            growing.coarse.pop(task.name, None)
            continue
        finally:
            bar.over(task.progress)
        growing.views[task.name] = view
        for stage, seconds in spent.seconds.items():
            record.add(stage, seconds)
        verbosity.remark([*progress.details(view.record), *carrier_lines.lines(view.record)])
        growing.offer(at_once=bool(more) and growing.is_whole)
        if more and growing.is_whole:
            bar.begin(more.stage, len(further) - len(others), MORE)
    return others


def _further(more: More, record: Run, outcomes: Mapping[str, Future[Any]]) -> dict[str, Any]:
    """Return the page's content of further tasks, and count their time."""
    found = {}
    for name, outcome in outcomes.items():
        found[name], seconds = outcome.result()
        record.add(more.stage, seconds)
    return more.shown(found)


def _write(
    run: Run,
    growing: Growing,
    with_figures: bool,
    shown: dict[str, Any],
    is_interrupted: bool = False,
) -> None:
    """Write the page, record and tables of all scenes, and report the results."""
    from reports.run import output
    from reports.terminal import carrier_lines, progress, tables

    folder, run.failures = growing.folder, growing.failed()
    run.begin_page()
    views = [view for view in growing.shown() if not view.is_coarse]
    records = [view.record for view in views]
    making = growing.making(is_interrupted) if is_interrupted or not growing.is_whole else None
    steps = [
        lambda: growing.write(failures=run.failures, run=run, making=making, **shown),
        lambda: output.write_run(folder, run.record()),
    ]
    if views:
        steps.append(lambda: tables.write(folder / output.TABLES, records))
        steps.append(lambda: carrier_lines.write(folder / output.TABLES, records))
    if views and with_figures:
        from reports.charts import figures

        steps.append(lambda: figures.write_run(folder / output.FIGURES, records))
    output.as_far_as_possible(*steps)
    if views:
        verbosity.tell(progress.summary(records))
        verbosity.tell(_verdict(views))
    verbosity.tell_where(folder / "index.html")
