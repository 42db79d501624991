"""Comparing scenes one after another, and writing their results and the page.

A scene that cannot be compared does not keep the others from it: the page names it with its error,
and the command ends with that error's exit code. Several scenes are compared in a process apart,
which one of them may kill; a single one is compared in this process.
"""

import shlex
import sys

from comparisons.pool import Pool, Task
from heuristic.errors import FotismosError
from reports import jobs
from reports.run import single
from reports.run.single import Wanted
from reports.run.stages import Failure, Run
from reports.terminal import verbosity


def start():
    """Load what renders, and begin the record of a run.

    Raises
    ------
    InstallationError
        When LLVM cannot be used.
    """
    single.load()
    return Run(shlex.join(["fotismos", *sys.argv[1:]]))


def finish(run, names, folder, wanted: Wanted, **shown):
    """Compare the scenes of a run, and write the results of each, then page and tables of all.

    ``shown`` is what else the page shows.
    """
    from reports.run import output
    from reports.run.places import places

    scenes = jobs.expand(names)
    with output.held(folder, run.command) as folder:
        found = places(folder, scenes)
        output.require_free(folder, found, wanted.figures)
        views, failures = {}, {}
        try:
            _compare(run, found, folder, wanted, views, failures)
        except KeyboardInterrupt:
            if views or failures:
                _write(run, folder, views, failures, wanted.figures, shown)
            raise
        _write(run, folder, views, failures, wanted.figures, shown)
    if failures:
        error = max(failures.values(), key=lambda error: error.exit_code)
        count = f"{len(failures)} of {len(found)} scenes failed, "
        raise type(error)(f"{count}among them: {error}") from error


def _compare(run, places, folder, wanted, views, failures):
    """Collect the views of the scenes that are compared, and the errors of the others."""
    from comparisons.case import name_of
    from reports.terminal import progress

    alone = len(places) == 1
    with progress.shown() as bar, Pool(0 if alone else 1, single.load) as pool:
        tasks = (
            Task(place, single.compare, (name, folder, place, wanted), bar.of(name_of(name)))
            for place, name in places.items()
        )
        for task, outcome in pool.each(tasks):
            try:
                view, spent = outcome.result()
            except FotismosError as error:
                if alone:
                    raise
                failures[task.name] = error
                continue
            views[task.name] = view
            for stage, seconds in spent.seconds.items():
                run.add(stage, seconds)
            verbosity.remark(progress.details(view.record))


def _write(run, folder, views, failures, with_figures, shown):
    """Write what is about all scenes, and say what came of them."""
    from reports.run import output
    from reports.terminal import progress, tables

    run.failures = [Failure(scene=n, error=str(error)) for n, error in failures.items()]
    run.begin_page()
    records = [view.record for view in views.values()]
    steps = [
        lambda: output.write_page(
            folder, list(views.values()), failures=run.failures, run=run, **shown
        ),
        lambda: output.write_run(folder, run.record()),
    ]
    if views:
        steps.append(lambda: tables.write(folder / output.TABLES, records))
    if views and with_figures:
        from reports.charts import figures

        steps.append(lambda: figures.write_run(folder / output.FIGURES, records))
    output.as_far_as_possible(*steps)
    if views:
        verbosity.tell(progress.summary(records))
    verbosity.tell_where(folder / "index.html")
