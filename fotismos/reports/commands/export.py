"""``fotismos export``: a scene for another program."""

from pathlib import Path
from typing import Any

from fotismos.reports import jobs


@jobs.command()
@jobs.scene_argument
@jobs.output_option("out", "export/SCENE")
@jobs.timeout_option
@jobs.options_of_scenes(without=("spp", "seed", "pixels_per_degree"))
@jobs.verbosity_options
def export(scene: str, output: Path, timeout: float, **rendering: Any) -> None:
    """Write a scene for another program to render, for `compare --image`.

    Writes to OUTPUT/export/SCENE: the camera as matrices of Mitsuba and OpenGL, geometry as glTF,
    lights and materials as paired, the surface in each pixel as EXR, and a README on conventions.

    \b
    Examples:
      fotismos export cornell-box
      fotismos export my_scene.xml --resolution 640x480 -o for_my_engine
    """  # noqa: D301 click reads the \b as: keep these lines
    options = jobs.chosen_options(rendering)
    jobs.work("export", jobs.pool(timeout), scene=scene, output=output, options=options)
