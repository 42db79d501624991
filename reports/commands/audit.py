"""``fotismos audit``: what holds of a heuristic or a BSDF, before any scene."""

from pathlib import Path

import click

from comparisons.processes.worker import Task
from reports import jobs
from reports.run import tasks
from reports.terminal import verbosity


def _parameter(text):
    """Parse ``NAME=VALUE``; a value that is not a number or truth stays a word."""
    name, separator, value = text.partition("=")
    if not (separator and name and value):
        raise click.BadParameter(f"{text!r} is no parameter; write it like alpha=0.1.")
    try:
        return name, float(value)
    except ValueError:
        return name, {"true": True, "false": False}.get(value, value)


@click.command()
@click.option("--heuristic", metavar="NAME|FILE.py[:FUNCTION]",
              help="What `compare --heuristic` takes.")  # fmt: skip
@click.option("--bsdf", metavar="TYPE", help="A BSDF plugin of Mitsuba's, such as roughplastic.")
@click.option("-p", "parameters", type=_parameter, multiple=True, metavar="NAME=VALUE",
              help="A parameter of the heuristic or the BSDF; may be repeated.")  # fmt: skip
@jobs.output_option("out")
@jobs.timeout_option
@verbosity.quiet_option
@verbosity.verbose_option
@jobs.json_option
def audit(heuristic, bsdf, parameters, output, timeout, as_json):
    """Say what holds of a way to shade: energy, reciprocity, continuity, gradients.

    Asks it about white materials from all directions, and prints a table of checks with the worst
    case of each. Writes audit.json and audit.svg, the albedo over angles, to OUTPUT/audit/NAME.
    Textbook shading breaks most of the checks: the exit code is 1 only where a value is NaN,
    infinite or negative.

    \b
    Examples:
      fotismos audit --heuristic blinn
      fotismos audit --heuristic my_shader.py:toon
      fotismos audit --bsdf roughplastic -p alpha=0.1
    """  # noqa: D301 click reads the \b as: keep these lines
    if (heuristic is None) == (bsdf is None):
        raise click.UsageError("give what to audit: --heuristic or --bsdf, one of them.")
    kind, name = ("heuristic", heuristic) if bsdf is None else ("bsdf", bsdf)
    with jobs.pool(timeout) as pool:
        pool.start()
        from comparisons.records import to_json
        from reports.run.output import below, held, require_free_folders
        from reports.run.places import assigned
        from reports.terminal import audit_lines

        command = jobs.command_line()
        with held(output, command) as held_folder:
            folder = below(held_folder, "audit")
            (place,) = assigned(folder, [_wanted(name)])
            require_free_folders(folder, place)
            words = (kind, name, dict(parameters), command, folder / place)
            record = pool.do(Task(name, tasks.audited, words))
    if as_json:
        click.echo(to_json(record), nl=False)
    else:
        verbosity.tell(audit_lines.lines(record))
        verbosity.tell_where(folder / place / "audit.svg")
    if not record.is_defined:
        click.get_current_context().exit(1)


def _wanted(name: str) -> tuple[str, Path | None]:
    """Return the name of a folder, and the file of a heuristic in one: one for each function."""
    from heuristic.heuristics import in_file

    if (found := in_file(name)) is None:
        return name, None
    file, function = Path(found[0]), found[1]
    return "-".join(filter(None, (file.stem, function))), Path(name)
