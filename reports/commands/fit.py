"""``fotismos fit``: the best heuristic parameters, and the error that remains."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fotismos.reports import jobs
from fotismos.reports.terminal.words import tell, tell_where

if TYPE_CHECKING:
    from fotismos.comparisons.fit.fit_record import FitRecord
    from fotismos.comparisons.options import Options


@jobs.command()
@jobs.scenes_argument
@jobs.output_option("out", "fit/SCENE")
@click.option(
    "--loss",
    default="perceptual",
    show_default=True,
    type=click.Choice(["perceptual", "linear"]),
    help="Loss to minimise: the mean colour difference in CAM16-UCS, or the mean square of the"
    " difference in linear RGB.",
)
@click.option(
    "--form",
    default="all",
    show_default=True,
    type=click.Choice(["phong", "blinn", "all"]),
    help="Form of the lobe, with and without normalisation.",
)
@jobs.json_option
@jobs.timeout_option
@jobs.options_of_scenes(resolution="96x96", spp="64")
@jobs.verbosity_options
def fit(
    scenes: tuple[str, ...],
    output: Path,
    loss: str,
    form: str,
    as_json: bool,
    timeout: float,
    **settings: Any,
) -> None:
    """Find the heuristic parameters nearest to the reference, and the error that remains.

    The loss that the best parameters remove is the parameter error. The rest is the model error,
    which no parameters remove. Writes a page (before, reference, after, error left) and fit.json to
    OUTPUT/fit/SCENE. By default it renders 96x96 pixels with 64 samples each.

    \b
    Examples:
      fotismos fit fig-8-9
      fotismos fit my_scene.xml --loss linear --form phong
    """  # noqa: D301 click reads the \b as: keep these lines
    choices = {"loss": loss, "form": form}
    records = jobs.results_of(
        output, "fit", timeout, scenes, fitted, jobs.request(settings), choices
    )
    from fotismos.reference.records import plain
    from fotismos.reports.files.results import PAGE
    from fotismos.reports.run import fit_files

    if as_json:
        click.echo(json.dumps(plain([*records.values()]), indent=2, ensure_ascii=False))
        return
    for record in records.values():
        tell(fit_files.lines(record))
    folder, *others = records
    tell_where(folder.parent if others else folder / PAGE)


def fitted(
    name: str, request: Options, settings: dict[str, str], target: Path, progress: Any
) -> FitRecord:
    """Fit the heuristic to a scene, and write the fit's files; ``settings`` are the command's."""
    from fotismos.comparisons.case import open_case
    from fotismos.comparisons.fit.fit import fit
    from fotismos.heuristic.materials import FORMS
    from fotismos.reports.run import fit_files

    case = open_case(name, request)
    command = case.command("fit", **settings)
    forms = FORMS if settings["form"] == "all" else (settings["form"],)
    result = fit(case.source, case.options, settings["loss"], forms, progress, command)
    fit_files.write(target, result)
    return result.record
