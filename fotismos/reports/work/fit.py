"""The work of ``fotismos fit``."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from fotismos.comparisons.case import open_case
from fotismos.comparisons.fit.fit import fit
from fotismos.comparisons.names import with_files
from fotismos.comparisons.options import Options
from fotismos.comparisons.processes.pool import Pool
from fotismos.comparisons.records.fit import FitRecord
from fotismos.heuristic.materials import FORMS
from fotismos.reference.records import plain
from fotismos.reports.files.results import PAGE
from fotismos.reports.run import fit_files
from fotismos.reports.terminal.words import tell, tell_where
from fotismos.reports.work.folders import results_of


def run(
    pool: Pool,
    scenes: Sequence[str],
    output: Path,
    options: Options,
    loss: str,
    form: str,
    as_json: bool,
) -> None:
    """Fit each scene, and print the tables or the records."""
    arguments = (with_files(options), loss, form)
    records = results_of(pool, output / "fit", scenes=scenes, work=fitted, arguments=arguments)
    if as_json:
        click.echo(json.dumps(plain([*records.values()]), indent=2, ensure_ascii=False))
        return
    for record in records.values():
        tell(fit_files.lines(record))
    folder, *others = records
    tell_where(folder.parent if others else folder / PAGE)


def fitted(
    name: str, options: Options, loss: str, form: str, target: Path, progress: Any
) -> FitRecord:
    """Fit the heuristic to a scene, and write the fit's files."""
    case = open_case(name, options)
    command = case.command("fit", loss=loss, form=form)
    forms = FORMS if form == "all" else (form,)
    result = fit(case.source, case.options, loss, forms, progress, command)
    fit_files.write(target, result)
    return result.record
