"""Comparing scenes one after another, and writing their results and the page.

A scene that cannot be compared does not stop the others: the page names it with its error, and the
command ends with that error's exit code. Scenes are compared in a separate process, which one of
them may kill. The page is written with the first picture, and again as the run continues.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
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

More = Callable[[Pool, "Run", "Bar"], dict[str, Any]]
Calls = Mapping[str, tuple[str, Path, str, Wanted]]
"""The arguments of :func:`reports.run.single.compare` for each place."""

SKETCH, WHOLE, MORE = 1.0, 8.0, 3.0
"""Relative times that a scene takes in each part of a run, to estimate the time left."""


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
        Makes further content of the page in the pool, counts its time, and returns the content.
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
            weight = SKETCH * wanted.sketched + WHOLE + MORE * bool(more)
            try:
                with progress.shown(total=weight * len(found)) as bar:
                    if wanted.sketched:
                        with record.timing("first pictures"):
                            _sketch(pool, growing, each, bar)
                    _compare(pool, record, growing, each, bar)
                    if more and growing.views:
                        growing.offer(at_once=True)
                        shown = more(pool, record, bar)
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


def _compare(pool: Pool, record: Run, growing: Growing, each: Calls, bar: Bar) -> None:
    """Collect the views of the scenes that are compared, and the errors of the others."""
    from reports.terminal import carrier_lines, progress

    left = {p: w for p, w in each.items() if p not in growing.views and p not in growing.failures}
    bar.begin("scenes", len(left), WHOLE, skipped=len(each) - len(left))
    for task, outcome in pool.each(_tasks(single.compare, left, bar)):
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
        growing.offer()


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
