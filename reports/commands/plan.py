"""``fotismos plan``: which effects a scene calls for."""

import click

from reports import jobs


@click.command()
@jobs.scene_argument
@jobs.json_option
@click.option("--verify", is_flag=True, help="Render as planned and with everything, and compare.")
@jobs.rendering_options
@jobs.scene_options
def plan(scene, as_json, verify, **rendering):
    """Say which effects a scene calls for, by which rule, and what will be simulated.

    \b
    Examples:
      fotismos plan cornell-box
      fotismos plan --verify fig-8-9 --resolution 128x128
    """  # noqa: D301 click reads the \b as: keep these lines
    jobs.make_ready()
    from comparisons.case import open_case
    from comparisons.records import to_json
    from reports.terminal import plan_lines, progress

    case = open_case(scene, jobs.request(rendering))
    if verify:
        from comparisons import verification

        with progress.shown() as bar:
            found = verification.verify(case.source, case.options, bar.of(case.name))
        lines = plan_lines.verification_lines([found])
    else:
        from comparisons.compare import prepare

        ready = prepare(case.source, case.options)
        found = plan_lines.report(case.name, ready, case.variant)
        lines = plan_lines.lines(found)
    if as_json:
        lines = [to_json(found).rstrip()]
    for line in lines:
        click.echo(line)
