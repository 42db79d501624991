"""``fotismos compare``: how far textbook shading is from physics."""

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
    help="A picture of the scene, .exr (FILE.exr:LAYER) or .png, in place of the heuristic half;"
    " several are repeats, from which their noise is known.",
)
@click.option(
    "--transfer",
    type=click.Choice(["linear", "srgb"]),
    help="What the values of the picture are. [default: linear for .exr]",
)
@verbosity.quiet_option
@verbosity.verbose_option
@click.option(
    "--noise",
    type=float,
    metavar="DE",
    help="Go on until 95 % of pixels have noise under this ΔE2000; --spp is then the most samples"
    " per pixel. [default limit: 4096]",
)
@jobs.scene_options
@click.option(
    "--why/--no-why",
    "with_cost",
    default=None,
    help="Find causes and remedies, in a small size; not of a picture. [default: why]",
)
@opening.option
@click.option("--cost", is_flag=True, hidden=True, help="The same as --why.")
@asked.with_options(*asked.bounds, *asked.files)
@click.pass_context
def compare(
    context,
    scenes,
    output,
    figures,
    fresh,
    with_cost,
    cost,
    scripts,
    timeout,
    workers,
    scheduler,
    is_opened,
    max_mean,
    max_visible,
    junit,
    summary,
    link,
    **rendering,
):
    """Say how far textbook shading is from physics, where, and whether that is more than noise.

    SCENE is a built-in name (`fotismos scenes`), a Mitsuba file (.xml), a Python file (.py) in
    which `scene` is a dictionary or returns one, or a folder: the Mitsuba files in it and its
    subfolders that others do not include. Python files in a folder are code, and run only with
    --scripts. Writes OUTPUT/index.html and tables of all scenes, and for each scene
    comparison.json, comparison.exr and pictures. Of several scenes, one that fails keeps no other
    from being compared. An interrupted run keeps its finished scenes and its passes: the same
    command goes on where it stopped, to the same image.

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
    has_image, is_asked = bool(rendering["image"]), with_cost or cost
    if has_image and (len(scenes) > 1 or is_asked):
        raise click.UsageError("--image goes with one scene, and without --why.")
    with_cost = is_asked or (with_cost is None and not has_image)
    request = jobs.request(rendering)
    wanted = batch.Wanted(request, figures, with_cost=with_cost, fresh=fresh, with_scripts=scripts)
    words = {"max_mean": max_mean, "max_visible": max_visible, "junit": junit}
    judge = asked.Judge(words | {"summary": summary, "link": link})
    rendered = jobs.pool(timeout, workers, scheduler)
    batch.run(scenes, output, wanted, rendered, seen=opening.seen(is_opened), judge=judge)
    context.exit(judge.exit_code)
