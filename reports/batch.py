"""Comparing scenes one after another, and writing their results and the page.

A scene that cannot be compared does not keep the others from it: the page names it with its error,
and the command ends with that error's exit code.
"""

import shlex
import sys
from time import perf_counter

from heuristic.errors import FotismosError
from reports import jobs, terminal
from reports.run import Run


def start():
    """Load what renders, and begin the record of a run.

    Raises
    ------
    InstallationError
        When LLVM cannot be used.
    """
    jobs.check_installation()
    import comparisons.compare  # noqa: F401  part of start-up

    return Run(shlex.join(["fotismos", *sys.argv[1:]]))


def run(names, folder, rendering, figures=False, with_cost=False):
    """Compare scenes and write the results of each, then the page and the tables of all."""
    finish(start(), names, folder, rendering, figures, with_cost)


def finish(
    run, names, folder, rendering, figures=False, with_cost=False, with_hard_cases=False, **shown
):
    """Do the same for a run that has begun; ``shown`` is what else the page shows."""
    from reports import figures as prints
    from reports import hard_cases, output, progress, tables

    folder = output.prepare(folder)
    wanted = [jobs.job(name, rendering) for name in names]
    views, failures = {}, {}
    with progress.shown() as bar:
        for source, chosen in wanted:
            name = output.folder_name(source.name, views)
            try:
                views[name] = _scene(run, folder, name, source, chosen, figures, with_cost, bar)
            except FotismosError as error:
                if len(wanted) == 1:
                    raise
                failures[source.name] = error
    if with_hard_cases:
        from comparisons.hard import record

        with run.timing("hard cases"):
            shown["hard_cases"] = hard_cases.view(record.collect())
    run.begin_page()
    output.write_page(
        folder,
        list(views.values()),
        failures=[(name, str(error)) for name, error in failures.items()],
        run=run,
        **shown,
    )
    output.write_run(folder, run.data())
    if views:
        records = [view["record"] for view in views.values()]
        tables.write(folder / output.TABLES, records)
        if figures:
            prints.write_run(folder / output.FIGURES, records)
        terminal.tell(progress.summary(records))
    terminal.tell_where(folder / "index.html")
    if failures:
        name, error = next(iter(failures.items()))
        count = f"{len(failures)} of {len(wanted)} scenes failed, "
        raise type(error)(f"{count}the first of them {name}: {error}") from error


def _scene(run, folder, name, source, chosen, figures, with_cost, bar):
    """Compare one scene, write its files, and return what the page needs of it."""
    from comparisons.compare import compare
    from reference.scene import set_variant
    from reports import figures as prints
    from reports import output, passes, progress

    set_variant(chosen["variant"])
    options, advance = jobs.options(chosen), bar.of(source.name)
    kept = passes.of_scene(folder, name, source, options, chosen["variant"])
    begin = perf_counter()
    result = compare(source, options, advance, jobs.command(source, chosen), kept)
    run.compared(result.data, perf_counter() - begin)
    study = None
    if with_cost:
        with run.timing("cost"):
            study = _cost(source, chosen, options, advance, result.data)
    with run.timing("files"):
        view = output.write_scene(folder, name, result, study)
        if figures:
            prints.write_scene(folder / output.FIGURES, name, result)
    terminal.remark(progress.details(result.data))
    kept.remove()
    return view


def _cost(source, chosen, options, progress, data):
    """Study what accuracy costs, and name the effects that dominate the comparison's regions."""
    from comparisons.cost.dominance import in_region
    from comparisons.cost.run import quick

    study = quick(source, options, progress, jobs.command(source, chosen) + " --cost")
    for region in data["regions"]:
        effect = in_region(region, data["resolution"], study.effects)
        if effect is not None:
            region["effect"] = effect
    return study
