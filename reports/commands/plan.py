"""``fotismos plan``: which effects a scene calls for."""

import click

from comparisons.processes.worker import Task
from reports import jobs
from reports.run import tasks
from reports.terminal import verbosity


@click.command()
@jobs.scene_argument
@jobs.json_option
@click.option("--verify", is_flag=True, help="Render as planned and with everything, and compare.")
@jobs.timeout_option
@jobs.rendering_options
@jobs.scene_options
@verbosity.verbose_option
def plan(scene, as_json, verify, timeout, **rendering):
    """Say which effects a scene calls for, by which rule, and what will be simulated.

    \b
    Examples:
      fotismos plan cornell-box
      fotismos plan --verify fig-8-9 --resolution 128x128
    """  # noqa: D301 click reads the \b as: keep these lines
    jobs.require_known([scene])
    with jobs.pool(timeout) as pool:
        pool.start()
        from comparisons.records import to_json
        from reports.terminal import plan_lines, progress

        request = jobs.request(rendering)
        if verify:
            with progress.shown() as bar:
                task = Task(scene, tasks.verified, (scene, request, None), bar.of(scene))
                found = pool.do(task)
            lines = plan_lines.verification_lines([found])
        else:
            found = pool.do(Task(scene, tasks.planned, (scene, request)))
            lines = plan_lines.lines(found)
    if as_json:
        lines = [to_json(found).rstrip()]
    for line in lines:
        click.echo(line)
