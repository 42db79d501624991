"""Comparing scenes one after another, and writing their results and the page.

A scene that cannot be compared does not keep the others from it: the page names it with its error,
and the command ends with that error's exit code. Scenes are compared in a process apart, which one
of them may kill.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from comparisons.processes.pool import Pool
from comparisons.processes.worker import Task
from heuristic.errors import FotismosError, InstallationError
from reports import jobs
from reports.run import single
from reports.run.single import Wanted
from reports.terminal import verbosity

if TYPE_CHECKING:
    from reports.run.stages import Run

More = Callable[[Pool, "Run"], dict[str, Any]]


def run(
    names: Iterable[str], folder: Path, wanted: Wanted, pool: Pool, more: More | None = None
) -> None:
    """Compare scenes, and write the results of each, then page and tables of all.

    Parameters
    ----------
    names
        Of built-in scenes, files and folders.
    folder
        For the results.
    wanted
        What of each scene.
    pool
        Where they are compared; it is ended.
    more
        Does what else the page shows in the pool, counts its time, and returns it in a dictionary.

    Raises
    ------
    FotismosError
        The gravest of the errors that kept a scene from being compared.
    """
    with pool as pool:
        pool.start()
        from reports.files import ownership
        from reports.run import output, stages
        from reports.run.places import places

        scenes = jobs.expand(names, wanted.with_scripts)
        requests = dict(zip(scenes, jobs.requests(wanted.request, scenes), strict=True))
        command = jobs.command_line()
        with output.held(folder, command) as folder:
            found = places(folder, scenes)
            output.require_free(folder, found, wanted.figures)
            record = stages.Run(command)
            shown = more(pool, record) if more else {}
            views, failures = {}, {}
            try:
                _compare(pool, record, found, folder, wanted, requests, views, failures)
            except KeyboardInterrupt:
                pool.end()  # before its half written files are cleared away
                ownership.recover(folder)
                if views or failures:
                    _write(record, folder, found, views, failures, wanted.figures, shown)
                raise
            _write(record, folder, found, views, failures, wanted.figures, shown)
    if failures:
        error = max(failures.values(), key=lambda error: error.exit_code)
        count = f"{len(failures)} of {len(found)} scenes failed, "
        raise type(error)(f"{count}among them: {error}") from error


def _verdict(views):
    """Return the lines that say what was found."""
    from reports import verdict

    found = [verdict.finding(v.record, v.cost.record if v.cost else None) for v in views]
    return ["", *verdict.sentences(found), *verdict.advice(found)]


def _compare(pool, record, places, folder, wanted, requests, views, failures):
    """Collect the views of the scenes that are compared, and the errors of the others."""
    from comparisons.case import name_of
    from reports.terminal import carrier_lines, progress

    alone = len(places) == 1
    with progress.shown() as bar:
        tasks = (
            Task(
                place,
                single.compare,
                (name, folder, place, replace(wanted, request=requests[name])),
                bar.of(name_of(name)),
            )
            for place, name in places.items()
        )
        for task, outcome in pool.each(tasks):
            try:
                view, spent = outcome.result()
            except InstallationError:
                raise
            except FotismosError as error:
                if alone:
                    raise
                failures[task.name] = error
                continue
            views[task.name] = view
            for stage, seconds in spent.seconds.items():
                record.add(stage, seconds)
            verbosity.remark([*progress.details(view.record), *carrier_lines.lines(view.record)])


def _write(run, folder, places, views, failures, with_figures, shown):
    """Write what is about all scenes, in the order of their places, and say what came of them."""
    from reports.run import output
    from reports.run.stages import Failure
    from reports.terminal import carrier_lines, progress, tables

    # Of several processes the one with the shorter scene is ready first.
    views = [views[place] for place in places if place in views]
    failed = [place for place in places if place in failures]
    run.failures = [Failure(scene=place, error=str(failures[place])) for place in failed]
    run.begin_page()
    records = [view.record for view in views]
    steps = [
        lambda: output.write_page(folder, views, failures=run.failures, run=run, **shown),
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
