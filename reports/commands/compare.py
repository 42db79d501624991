"""``fotismos compare``: how far textbook shading is from physics."""

from pathlib import Path
from typing import Any

import click

from reports import jobs, opening
from reports.ci import asked
from reports.run import batch
from reports.terminal import verbosity


@click.command()
@jobs.scenes_argument
@jobs.output_option("out")
@jobs.figures_option
@jobs.fresh_option
@jobs.scripts_option
@jobs.timeout_option
@jobs.workers_option
@jobs.scheduler_option
@jobs.rendering_options
@click.option(
    "--image",
    multiple=True,
    metavar="FILE",
    help="A picture of the scene, .exr (FILE.exr:LAYER) or .png, that replaces the heuristic half;"
    " several are repeats, which show its noise.",
)
@click.option(
    "--transfer",
    type=click.Choice(["linear", "srgb"]),
    help="Transfer function of the picture. [default: linear for .exr]",
)
@verbosity.quiet_option
@verbosity.verbose_option
@click.option(
    "--noise",
    type=float,
    metavar="DE",
    help="Continue until 95 % of pixels have noise under this ΔE2000, up to --spp samples per"
    " pixel. [default limit: 4096]",
)
@jobs.scene_options
@click.option(
    "--why/--no-why",
    "with_cost",
    default=True,
    help="Find causes and remedies, at a small size; of a picture, only what it is nearest to."
    " [default: why]",
)
@opening.option
@click.option("--cost", is_flag=True, hidden=True, help="The same as --why.")
@asked.with_options(*asked.bounds, *asked.files)
@click.pass_context
def compare(
    context: click.Context,
    scenes: tuple[str, ...],
    output: Path,
    figures: bool,
    fresh: bool,
    with_cost: bool,
    cost: bool,
    scripts: bool,
    timeout: float,
    workers: int,
    scheduler: str | None,
    is_opened: bool,
    max_mean: float | None,
    max_visible: float | None,
    junit: Path | None,
    summary: Path | None,
    link: str | None,
    **rendering: Any,
) -> None:
    """Measure how far textbook shading is from physics, where, and whether it is more than noise.

    SCENE is a built-in name (`fotismos scenes`), a Mitsuba file (.xml), a Python file (.py) in
    which `scene` is a dictionary or returns one, or a folder: the Mitsuba files in it and its
    subfolders that no other file includes. Python files in a folder are code, and run only with
    --scripts. Writes OUTPUT/index.html and tables of all scenes, and for each scene
    comparison.json, comparison.exr and pictures. If one scene fails, the others are still
    compared. An interrupted run keeps its finished scenes and passes: the same command resumes it,
    and gives the same image.

    \b
    Examples:
      fotismos compare fig-8-9
      fotismos compare my_scene.xml cornell-box --resolution 640x480 -o results
      fotismos compare cornell-box --noise 0.5 --spp 2048
      fotismos compare fig-8-8a fig-8-9 --figures -q
      fotismos compare my_scene.xml -D roughness=0.2 --sensor 1
      fotismos compare plastic-spheres --no-why
      fotismos compare my_scenes/
      fotismos compare my_scene.xml --heuristic my_shader.py
      fotismos compare my_scene.xml --image theirs.exr
      fotismos compare my_scenes/ --max-visible 5% --summary summary.md
    """  # noqa: D301 click reads the \b as: keep these lines
    jobs.require_known(scenes)
    if rendering["image"] and len(scenes) > 1:
        raise click.UsageError("--image goes with one scene.")
    request = jobs.request(rendering)
    with_cost |= cost
    wanted = batch.Wanted(request, figures, with_cost=with_cost, fresh=fresh, with_scripts=scripts)
    words = {"max_mean": max_mean, "max_visible": max_visible, "junit": junit}
    judge = asked.Judge(words | {"summary": summary, "link": link})
    rendered = jobs.pool(timeout, workers, scheduler)
    batch.run(scenes, output, wanted, rendered, seen=opening.seen(is_opened), judge=judge)
    context.exit(judge.exit_code)
