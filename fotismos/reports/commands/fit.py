"""``fotismos fit``: the best heuristic parameters, and the error that remains."""

from pathlib import Path
from typing import Any

import click

from fotismos.reports import jobs


@jobs.command()
@jobs.scenes_argument
@jobs.output_option("out", "fit/SCENE")
@click.option(
    "--loss",
    default="perceptual",
    show_default=True,
    type=click.Choice(["perceptual", "linear"]),
    help="Loss to minimise: the mean colour difference in CAM16-UCS, or the mean square of the"
    " error in linear RGB.",
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
@jobs.picture_options
@jobs.verbosity_options
def fit(
    scenes: tuple[str, ...],
    output: Path,
    loss: str,
    form: str,
    as_json: bool,
    timeout: float,
    **rendering: Any,
) -> None:
    """Find the textbook parameters nearest to the physical picture, and the error that is left.

    The part of the error that the best parameters remove is the parameter error. The rest is the
    model error, which no parameters remove. Writes a page (physical, before, after, and the errors)
    and fit.json to OUTPUT/fit/SCENE. By default it renders 96x96 pixels with 64 samples each. With
    pictures of another renderer as the reference, it has their size.

    \b
    Examples:
      fotismos fit fig-8-9
      fotismos fit my_scene.xml --loss linear --form phong
      fotismos fit my_scene.xml --reference 'theirs_*.exr'
    """  # noqa: D301 click reads the \b as: keep these lines
    if not rendering["reference"]:
        jobs.refuse_reading(rendering, "--reference")
    jobs.work(
        "fit",
        jobs.pool(timeout),
        scenes=scenes,
        output=output,
        options=jobs.chosen_options(rendering),
        loss=loss,
        form=form,
        as_json=as_json,
    )
