"""``fotismos audit``: properties of a heuristic or a BSDF, before any scene."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fotismos.comparisons.processes.pool import Task
from fotismos.reports import jobs
from fotismos.reports.terminal.words import tell, tell_where

if TYPE_CHECKING:
    from fotismos.comparisons.audit.checks import Audit, Kind


def _parameter(text: str) -> tuple[str, float | bool | str]:
    """Parse ``NAME=VALUE``: a number, ``true`` or ``false``, or else a word."""
    name, separator, value = text.partition("=")
    if not (separator and name and value):
        raise click.BadParameter(f"{text!r} is not a parameter; write it like alpha=0.1.")
    try:
        return name, float(value)
    except ValueError:
        return name, {"true": True, "false": False}.get(value, value)


@jobs.command()
@click.option("--heuristic", metavar="NAME|FILE.py[:FUNCTION]",
              help="What `compare --heuristic` takes.")  # fmt: skip
@click.option("--bsdf", metavar="TYPE|FILE.py:NAME",
              help="A BSDF plugin of Mitsuba, or one that a file registers.")  # fmt: skip
@click.option("-p", "parameters", type=_parameter, multiple=True, metavar="NAME=VALUE",
              help="A parameter of the heuristic or the BSDF; may be repeated.")  # fmt: skip
@jobs.output_option("out", "audit/NAME")
@jobs.timeout_option
@jobs.verbosity_options
@jobs.json_option
def audit(
    heuristic: str | None,
    bsdf: str | None,
    parameters: tuple[tuple[str, float | bool | str], ...],
    output: Path,
    timeout: float,
    as_json: bool,
) -> None:
    """Check a heuristic or BSDF: energy, reciprocity, continuity, gradients.

    Evaluates it on white materials for all directions, and prints a table of checks with the worst
    case of each. Writes a page (index.html), audit.json with all numbers, and audit.svg, the lobes,
    to OUTPUT/audit/NAME.
    Textbook shading fails most of the checks: the exit code is 1 only if a value is NaN, infinite
    or negative.

    \b
    Examples:
      fotismos audit --heuristic blinn
      fotismos audit --heuristic my_shader.py:toon
      fotismos audit --bsdf roughdielectric -p alpha=0.1
      fotismos audit --bsdf my_bsdf.py:my_name
    """  # noqa: D301 click reads the \b as: keep these lines
    name = heuristic or bsdf
    if not name or (heuristic and bsdf):
        raise click.UsageError("give one of --heuristic and --bsdf.")
    kind = "heuristic" if heuristic else "bsdf"
    with jobs.pool(timeout) as pool:
        pool.start()
        from fotismos.reference.records import to_json
        from fotismos.reports.files.results import PAGE, hold_results
        from fotismos.reports.run import audit_files

        command = jobs.command_line()
        with hold_results(output / "audit", [_folder_of(name)], command) as (folder,):
            arguments = (kind, name, dict(parameters), command, folder)
            record = pool.do(Task(name, audited, arguments))
    if as_json:
        click.echo(to_json(record), nl=False)
    else:
        tell(audit_files.lines(record))
        tell_where(folder / PAGE)
    if record.faults:
        click.get_current_context().exit(1)


def _folder_of(name: str) -> tuple[str, Path | None]:
    """Return a folder's name, one for each function, and the heuristic's file if it has one."""
    from fotismos.heuristic.heuristics import in_file

    if (located := in_file(name)) is None:
        return name, None
    file = Path(located[0])
    function = located[1]
    return "-".join(filter(None, (file.stem, function))), Path(name)


def audited(kind: Kind, name: str, parameters: dict[str, Any], command: str, target: Path) -> Audit:
    """Audit a heuristic or a BSDF, and write the audit's files."""
    from fotismos.comparisons.audit.checks import audit
    from fotismos.comparisons.case import RGB
    from fotismos.heuristic import plugins
    from fotismos.reference.scene.graph import set_variant
    from fotismos.reports.run import audit_files

    set_variant(RGB)
    plugins.register()
    record = audit(kind, name, parameters, command)
    audit_files.write(target, record)
    return record
