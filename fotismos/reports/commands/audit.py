"""``fotismos audit``: properties of a heuristic or a BSDF, before any scene."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import click

from fotismos.comparisons.options import option
from fotismos.comparisons.processes.pool import Task
from fotismos.reports.command import Command
from fotismos.reports.jobs import Terminal, command_line
from fotismos.reports.terminal.parsing import parameter


class Audit(Command, frozen=True):
    """Check a shading model or a BSDF: energy, reciprocity, continuity, gradients.

    Evaluates it on white materials for all directions, and prints a table of checks with the worst
    case of each. Writes a page (index.html), audit.json with all numbers, and audit.svg, the lobes,
    to OUTPUT/audit/NAME.
    Textbook shading fails most of the checks: the exit code is 1 only if a value is NaN, infinite
    or negative.

    Examples
    --------
      fotismos audit --heuristic blinn
      fotismos audit --heuristic my_shader.py:toon
      fotismos audit --heuristic my_shader.py --as ggx
      fotismos audit --bsdf roughdielectric -p alpha=0.1
      fotismos audit --bsdf my_bsdf.py:my_name
    """

    below = "audit/NAME"
    options_shown = (
        "heuristic", "bsdf", "parameters", "like",
        "output", "quiet", "verbose", "as_json", "timeout",
    )  # fmt: skip

    heuristic: Annotated[
        str | None, option("What `compare --heuristic` takes.", metavar="NAME|FILE.py[:FUNCTION]")
    ] = None
    bsdf: Annotated[
        str | None,
        option(
            "A BSDF plugin of Mitsuba, or one that a file registers.", metavar="TYPE|FILE.py:NAME"
        ),
    ] = None
    parameters: Annotated[
        Mapping[str, Any],
        option(
            "A parameter of the model or the BSDF; may be repeated.",
            names=("-p",),
            metavar="NAME=VALUE",
            type=parameter,
        ),
    ] = {}

    like: Annotated[
        Literal["ggx", "beckmann", "blinn", "phong", "lambert", "oren-nayar"] | None,
        option("Compare its lobe with this closed form, by the light's angle.", names=("--as",)),
    ] = None

    def run(self, terminal: Terminal) -> int:
        """Audit it, print the table or the record; 1 if there are faults."""
        if bool(self.heuristic) == bool(self.bsdf):
            raise click.UsageError("give one of --heuristic and --bsdf.")
        kind = "heuristic" if self.heuristic else "bsdf"
        name = self.heuristic or self.bsdf or ""
        command = command_line()
        with terminal.processes() as pool:
            from fotismos.reports.files import results  # loaded late
            from fotismos.reports.run import audit_files  # loaded late

            folder = terminal.output / "audit"
            with results.hold_results(folder, [_folder_of(name)], command) as (target,):
                arguments = (kind, name, self.parameters, command, target, self.like)
                record = pool.do(Task(name, audit_files.audited, arguments))
        terminal.show(record, audit_files.lines(record), target / results.PAGE)
        return int(bool(record.faults))


def _folder_of(name: str) -> tuple[str, Path | None]:
    """Return a folder's name, one for each function, and the heuristic's file if it has one."""
    from fotismos.heuristic.heuristics import in_file  # loaded late: help needs no Mitsuba

    located = in_file(name)
    if located is None:
        return name, None
    file, function = located
    return "-".join(filter(None, (Path(file).stem, function))), Path(name)
