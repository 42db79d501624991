"""Comparing scenes one after another, and writing their results and the page.

A scene that cannot be compared does not keep the others from it: the page names it with its error,
and the command ends with that error's exit code.
"""

from time import perf_counter

from heuristic.errors import FotismosError
from reports import jobs, terminal

START = perf_counter()


def run(
    names, folder, rendering, equations=(), verifications=(), with_hard_cases=False, figures=False
):
    """Compare scenes and write the results of each, then the page and the tables of all."""
    jobs.check_installation()
    from comparisons.compare import compare
    from comparisons.hard import record
    from reference.scene import set_variant
    from reports import figures as prints
    from reports import hard_cases, output, passes, progress, tables

    folder = output.prepare(folder)
    wanted = [jobs.job(name, rendering) for name in names]
    views, failures = {}, {}
    with progress.shown() as bar:
        for source, chosen in wanted:
            start_up = perf_counter() - START if not views else 0.0
            set_variant(chosen["variant"])
            name = output.folder_name(source.name, views)
            options = jobs.options(chosen)
            kept = passes.of_scene(folder, name, source, options, chosen["variant"])
            try:
                result = compare(
                    source, options, bar.of(source.name), jobs.command(source, chosen), kept
                )
            except FotismosError as error:
                if len(wanted) == 1:
                    raise
                failures[source.name] = error
                continue
            begin = perf_counter()
            views[name] = output.write_scene(folder, name, result)
            if figures:
                prints.write_scene(folder / output.FIGURES, name, result)
            terminal.remark(progress.details(result.data))
            kept.remove()
            stages = result.data["time"]["stages"]
            stages |= {"start-up": start_up, "files": perf_counter() - begin}
    begin = perf_counter()
    shown = hard_cases.view(record.collect()) if with_hard_cases else None
    output.write_page(
        folder,
        list(views.values()),
        equations=equations,
        verifications=verifications,
        hard_cases=shown,
        failures=[(name, str(error)) for name, error in failures.items()],
    )
    share = (perf_counter() - begin) / max(len(views), 1)
    for name, view in views.items():
        view["record"]["time"]["stages"]["page"] = share
        output.rewrite_record(folder, name, view["record"])
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
