"""Comparing scenes one after another, and writing their results and the page."""

from time import perf_counter

import click

from reports import jobs

START = perf_counter()


def run(names, folder, rendering, equations=(), verifications=(), with_hard_cases=False):
    """Compare scenes and write the results of each, then the page of all."""
    jobs.check_installation()
    from comparisons import hard_record
    from comparisons.compare import compare
    from reference.scene import set_variant
    from reports import hard_cases, output, progress

    folder = output.prepare(folder)
    wanted = [jobs.job(name, rendering) for name in names]
    views = {}
    with progress.shown() as bar:
        for source, chosen in wanted:
            start_up = perf_counter() - START if not views else 0.0
            set_variant(chosen["variant"])
            result = compare(
                source, jobs.options(chosen), bar.of(source.name), jobs.command(source, chosen)
            )
            begin = perf_counter()
            name = output.folder_name(source.name, views)
            views[name] = output.write_scene(folder, name, result)
            stages = result.data["time"]["stages"]
            stages |= {"start-up": start_up, "files": perf_counter() - begin}
    begin = perf_counter()
    shown = hard_cases.view(hard_record.collect()) if with_hard_cases else None
    output.write_page(
        folder,
        list(views.values()),
        equations=equations,
        verifications=verifications,
        hard_cases=shown,
    )
    share = (perf_counter() - begin) / len(views)
    for name, view in views.items():
        view["record"]["time"]["stages"]["page"] = share
        output.rewrite_record(folder, name, view["record"])
    for line in progress.summary(view["record"] for view in views.values()):
        click.echo(line)
    click.echo(f"\n{folder / 'index.html'}")
