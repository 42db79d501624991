"""The work of ``fotismos audit``."""

from pathlib import Path
from typing import Any

import click

from fotismos.comparisons.audit.checks import Audit, Kind, audit_with_subject, spheres
from fotismos.comparisons.case import RGB
from fotismos.comparisons.processes.pool import Pool, Task
from fotismos.heuristic import plugins
from fotismos.heuristic.heuristics import in_file
from fotismos.reference.records import to_json
from fotismos.reference.scene.graph import set_variant
from fotismos.reports.files.results import PAGE, hold_results
from fotismos.reports.jobs import command_line
from fotismos.reports.run import audit_files
from fotismos.reports.terminal.words import tell, tell_where


def run(
    pool: Pool, kind: Kind, name: str, parameters: dict[str, Any], output: Path, as_json: bool
) -> bool:
    """Audit a heuristic or BSDF, and print the table or record; return whether it has faults."""
    command = command_line()
    with hold_results(output / "audit", [_folder_of(name)], command) as (folder,):
        arguments = (kind, name, parameters, command, folder)
        record: Audit = pool.do(Task(name, audited, arguments))
    if as_json:
        click.echo(to_json(record), nl=False)
    else:
        tell(audit_files.lines(record))
        tell_where(folder / PAGE)
    return bool(record.faults)


def _folder_of(name: str) -> tuple[str, Path | None]:
    """Return a folder's name, one for each function, and the heuristic's file if it has one."""
    located = in_file(name)
    if located is None:
        return name, None
    file, function = located
    return "-".join(filter(None, (Path(file).stem, function))), Path(name)


def audited(kind: Kind, name: str, parameters: dict[str, Any], command: str, target: Path) -> Audit:
    """Audit a heuristic or a BSDF, and write the audit's files."""
    set_variant(RGB)
    plugins.register()
    record, subject = audit_with_subject(kind, name, parameters=parameters, command=command)
    shown = [curve.material for curve in record.curves if curve.lobes]
    audit_files.write(target, record, spheres(subject, shown))
    return record
