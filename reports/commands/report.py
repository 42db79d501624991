"""``fotismos report``: all built-in scenes in one report."""

from dataclasses import replace

import click

from comparisons.processes.worker import Task
from reports import jobs
from reports.run import batch, tasks
from reports.terminal import verbosity

VERIFIED_AT = (96, 96)
"""Resolution at which a report verifies its plans."""


@click.command()
@jobs.output_option("out/report")
@jobs.figures_option
@jobs.fresh_option
@jobs.timeout_option
@jobs.workers_option
@jobs.scheduler_option
@jobs.rendering_options
@verbosity.quiet_option
@verbosity.verbose_option
def report(output, figures, fresh, timeout, workers, scheduler, **rendering):
    """Compare all built-in scenes, price their effects, and write one report.

    Writes what `compare` does, and in the page the plans verified, the hard cases and the
    index of equations.

    \b
    Examples:
      fotismos report
      fotismos report --resolution 128x128 -o small --figures
    """  # noqa: D301 click reads the \b as: keep these lines
    from comparisons.gallery.builtin import SCENES

    request = jobs.request(rendering)

    def more(pool, run):
        from heuristic import equations

        with run.timing("verification"):
            verifications = [] if request.everything else _verified(pool, SCENES, request)
        with run.timing("hard cases"):
            cases = pool.do(Task("hard cases", tasks.hard_cases, ()))
        return {
            "verifications": verifications,
            "hard_cases": cases,
            "equations": equations.index(),
        }

    wanted = batch.Wanted(request, figures, with_cost=True, fresh=fresh)
    batch.run(tuple(SCENES), output, wanted, jobs.pool(timeout, workers, scheduler), more)


def _verified(pool, names, request):
    """Hold the plan of each scene against everything simulated, at a small size."""
    from comparisons.check.moved import level_of_each
    from comparisons.verification import LEVEL
    from reports.terminal import progress

    small = replace(request, resolution=VERIFIED_AT, spp=None)
    level = level_of_each(LEVEL, len(names))
    with progress.shown() as bar:
        wanted = [Task(name, tasks.verified, (name, small, level), bar.of(name)) for name in names]
        return [outcome.result() for _, outcome in pool.each(wanted)]
