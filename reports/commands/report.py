"""``fotismos report``: all built-in scenes in one report."""

from dataclasses import replace

import click

from reports import jobs
from reports.run import batch
from reports.terminal import verbosity

VERIFIED_AT = (96, 96)
"""Resolution at which a report verifies its plans."""


@click.command()
@jobs.output_option("out/report")
@jobs.figures_option
@jobs.fresh_option
@jobs.rendering_options
@verbosity.quiet_option
@verbosity.verbose_option
def report(output, figures, fresh, **rendering):
    """Compare all built-in scenes, price their effects, and write one report.

    Writes what `compare --cost` does, and in the page the plans verified, the hard cases and the
    index of equations.

    \b
    Examples:
      fotismos report
      fotismos report --resolution 128x128 -o small --figures
    """  # noqa: D301 click reads the \b as: keep these lines
    from comparisons.gallery.builtin import SCENES
    from heuristic import equations

    names = tuple(SCENES)
    run = batch.start()
    request = jobs.request(rendering)
    import mitsuba as mi

    from comparisons.case import RGB
    from comparisons.hard import collection
    from reference.scene.graph import set_variant

    # Of these scenes its warnings are known: RGB cannot hold a spectral lamp, said at each loading.
    mi.set_log_level(mi.LogLevel.Error)
    with run.timing("verification"):
        verifications = [] if request.everything else _verify(names, request)
    with run.timing("hard cases"):
        set_variant(RGB)
        hard_cases = collection.collect()
    batch.finish(
        run,
        names,
        output,
        batch.Wanted(request, figures, with_cost=True, fresh=fresh),
        hard_cases=hard_cases,
        equations=equations.index(),
        verifications=verifications,
    )


def _verify(names, request):
    """Hold the plan of each scene against everything simulated, at a small size."""
    from comparisons.case import open_case
    from comparisons.check.moved import level_of_each
    from comparisons.verification import LEVEL, verify
    from reports.terminal import progress

    level = level_of_each(LEVEL, len(names))
    with progress.shown() as bar:
        results = []
        for name in names:
            case = open_case(name, replace(request, resolution=VERIFIED_AT, spp=None))
            results.append(verify(case.source, case.options, bar.of(case.name), level))
    return results
