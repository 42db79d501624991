"""``fotismos compare``: how far textbook shading is from physics."""

import click

from reports import batch, jobs


@click.command()
@click.argument("scenes", nargs=-1, required=True, metavar="SCENE...")
@jobs.output_option("out")
@jobs.rendering_options
@jobs.scene_options
def compare(scenes, output, **rendering):
    """Say how far textbook shading is from physics, where, and whether that is more than noise.

    SCENE is a built-in name (`fotismos scenes`) or a Mitsuba file (.xml). Writes OUTPUT/index.html
    and, for each scene, comparison.json, comparison.exr and pictures.

    \b
    Examples:
      fotismos compare fig-8-9
      fotismos compare my_scene.xml cornell-box --resolution 640x480 -o results
      fotismos compare my_scene.xml -D roughness=0.2 --sensor 1
    """  # noqa: D301 click reads the \b as: keep these lines
    batch.run(scenes, output, rendering)
