"""``fotismos export``: a scene for another program."""

from pathlib import Path
from typing import Any

from fotismos.comparisons.options import Options
from fotismos.reports import jobs
from fotismos.reports.terminal.words import tell_where


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
    request = jobs.request(rendering)
    (folder,) = jobs.results_of(output, "export", timeout, [scene], exported, request)
    tell_where(folder)


def exported(name: str, request: Options, target: Path, progress: Any) -> None:
    """Write the files that another program needs to render a scene."""
    from fotismos.comparisons.case import open_case
    from fotismos.comparisons.plain_scene import plain_scene
    from fotismos.reports.files import export_files

    case = open_case(name, request)
    scene = plain_scene(case.source, case.options)
    export_files.write(target, scene, case.command(image="YOURS.exr"))
