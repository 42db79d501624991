"""``fotismos compare``: how far textbook shading is from physics."""

from pathlib import Path
from typing import Any

import click

from fotismos.comparisons.names import PICTURES
from fotismos.comparisons.processes.pool import Pool
from fotismos.reports import jobs


@jobs.command()
@jobs.scenes_or_pictures_argument
@jobs.output_option("out")
@jobs.figures_option
@jobs.fresh_option
@jobs.process_options
@jobs.scene_options
@jobs.option("image")
@jobs.picture_options
@jobs.option("tone_map")
@jobs.verbosity_options
@jobs.option("noise")
@jobs.option("colour_science")
@click.option(
    "--why/--no-why",
    "with_causes",
    default=True,
    help="Find which effects are missing, at a small size; not for pictures. [default: why]",
)
@jobs.open_option
@jobs.within_option
@click.option(
    "--max-visible",
    type=jobs.percentage,
    metavar="P%",
    help="Exit code 1 unless at most this share of each scene's pixels differs visibly.",
)
@jobs.ci_options
@click.pass_context
def compare(
    context: click.Context,
    /,
    scenes: tuple[str, ...],
    output: Path,
    figures: bool,
    fresh: bool,
    with_causes: bool,
    timeout: float,
    workers: int | None,
    scheduler: str | None,
    is_opened: bool,
    within: float,
    max_visible: float | None,
    junit: Path | None,
    summary: Path | None,
    **rendering: Any,
) -> None:
    """Measure how far textbook shading is from physics, where, and whether it is more than noise.

    SCENE is a built-in name (`fotismos scenes`), a Mitsuba file (.xml), or a Python file (.py) in
    which `scene` is a dictionary, or a function that returns one. Pictures of other renderers may
    replace either half; with both, no scene is needed.

    Writes OUTPUT/index.html and tables of all scenes, and for each scene comparison.json,
    comparison.exr and pictures. If one scene fails, the others are still compared. An interrupted
    run keeps its finished scenes: the same command resumes it.

    \b
    Examples:
      fotismos compare fig-8-9
      fotismos compare my_scene.xml cornell-box --resolution 640x480 -o results
      fotismos compare cornell-box --noise 0.5 --spp 2048
      fotismos compare fig-8-8a fig-8-9 --figures -q
      fotismos compare my_scene.xml -D roughness=0.2 --sensor 1
      fotismos compare plastic-spheres --no-why
      fotismos compare my_scenes/*.xml
      fotismos compare my_scene.xml --heuristic my_shader.py
      fotismos compare my_scene.xml --image theirs.exr
      fotismos compare my_scene.xml --reference 'cycles_*.exr'
      fotismos compare --reference 'theirs_*.exr' --image 'mine_*.exr' --max-visible 5%
      fotismos compare my_scenes/*.xml --max-visible 5% --summary summary.md
    """  # noqa: D301 click reads the \b as: keep these lines
    if not (rendering["image"] or rendering["reference"]):
        jobs.refuse_reading(rendering, "--image or --reference")
    are_pictures = bool(rendering["image"] and rendering["reference"])
    if not scenes and not are_pictures:
        raise click.UsageError(
            "Missing argument 'SCENE...': give a scene, or two pictures, --reference and --image."
        )
    for option in ("image", "reference"):
        if rendering[option] and len(scenes) > 1:
            are_files = any(Path(word).suffix.lower() in PICTURES for word in scenes)
            if are_files:
                raise click.UsageError(f"Put a pattern in quotes: --{option} 'name_*.exr'.")
            raise click.UsageError(f"--{option} goes with one scene.")
    if scenes:
        processes = jobs.pool(timeout, len(scenes), workers=workers, scheduler=scheduler)
    else:
        processes = Pool(0)  # two pictures run no user's code
    code = jobs.work(
        "compare",
        processes,
        scenes=scenes,
        output=output,
        job=jobs.Job(
            options=jobs.chosen_options(rendering),
            figures=figures,
            with_causes=with_causes,
            fresh=fresh,
            within=within,
        ),
        max_visible=max_visible,
        junit=junit,
        summary_file=summary,
        is_opened=is_opened,
    )
    context.exit(code)
