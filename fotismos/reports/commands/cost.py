"""``fotismos cost``: what each step of accuracy costs in time."""

from pathlib import Path
from typing import Any

import click

from fotismos.comparisons.cost.timed_pictures import EngineTimes
from fotismos.comparisons.departure.criterion import TOLERANCE
from fotismos.comparisons.processes.pool import Pool
from fotismos.heuristic.errors import InputError
from fotismos.reports import jobs


@jobs.command()
@jobs.scene_or_pictures_argument
@jobs.output_option("out", "cost/SCENE")
@jobs.timeout_option
@jobs.options_of_scenes(resolution="the film's, reduced to a width of 128", spp="up to 64")
@jobs.verbosity_options
@click.option("--rounds", type=click.IntRange(2), help="Timed repeats of each method. [default: 7]")
@click.option("--at", type=jobs.resolution, metavar="WxH", help="Predict the times at this size.")
@click.option("--measure", "is_measured", is_flag=True, help="With --at: measure at it, too.")
@click.option(
    "--picture",
    "pictures",
    multiple=True,
    metavar="'NAME @ TIME=PATTERN'",
    help="A setting of another renderer: its picture and the time of it, such as 'PCSS low @"
    " 6.3ms=low_*.exr'. Several files are repeats, which show its noise.",
)
@click.option("--machine", metavar="TEXT", help="The machine that took these times.")
@click.option(
    "--kernel-time", metavar="TIME", help="What the textbook kernel takes there, for ratios."
)
@jobs.picture_options
@jobs.option("tone_map")
@jobs.within_option
@jobs.json_option
def cost(
    scene: str | None,
    output: Path,
    rounds: int | None,
    at: tuple[int, int] | None,
    is_measured: bool,
    pictures: tuple[str, ...],
    machine: str | None,
    kernel_time: str | None,
    within: float,
    as_json: bool,
    timeout: float,
    **rendering: Any,
) -> None:
    """Measure what each step of accuracy costs in time, and which effect is worth paying for.

    Renders with methods from flat shading to all effects, at several sample counts each, and
    attributes error and time to each effect in which textbook shading differs. Writes a page,
    cost.json, cost.svg and pictures to OUTPUT/cost/SCENE. Without --resolution the film is reduced
    to a width of 128 pixels; --spp gives the largest count of samples per pixel, 64 if omitted.

    With --picture, settings of another renderer have a front of their own: their times are given.
    The size of the pictures becomes that of the study. Without SCENE, nothing is rendered: pictures
    of --reference judge the settings.

    \b
    Examples:
      fotismos cost cornell-box
      fotismos cost my_scene.xml --resolution 256x256 --rounds 11
      fotismos cost cornell-box --at 1920x1080
      fotismos cost hall.xml --picture 'PCSS low @ 6.3ms=low_*.exr' --machine 'RTX 3060'
      fotismos cost --reference 'truth_*.exr' --picture 'SSAO @ 1.2ms=ssao_*.exr'
    """  # noqa: D301 click reads the \b as: keep these lines
    if is_measured and at is None:
        raise InputError("--measure needs a size: give one with --at, such as --at 1920x1080.")
    engine = EngineTimes.of(pictures, machine, kernel_time)
    if engine is None:
        jobs.refuse_reading(rendering, "--picture")
    if scene is None and not (rendering["reference"] and engine):
        raise click.UsageError(
            "Missing argument 'SCENE': give a scene, or pictures, --reference and --picture."
        )
    if scene is not None and within != TOLERANCE:
        raise InputError("--within: it judges pictures without a scene. Omit it, or the scene.")
    jobs.work(
        "cost",
        Pool(0) if scene is None else jobs.pool(timeout),  # pictures run no user's code
        scene=scene,
        output=output,
        options=jobs.chosen_options(rendering),
        rounds=rounds,
        at=at,
        is_measured=is_measured,
        engine=engine,
        within=within,
        as_json=as_json,
    )
