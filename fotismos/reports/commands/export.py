"""``fotismos export``: a scene for another program."""

from pathlib import Path

from fotismos.reports.command import OnScene
from fotismos.reports.jobs import Terminal
from fotismos.reports.terminal.words import tell_where


class Export(OnScene, frozen=True):
    """Write a scene for another program to render, for `compare --image`.

    Writes to OUTPUT/export/SCENE: the camera as matrices of Mitsuba and OpenGL, geometry as glTF,
    lights and materials as paired, the surface in each pixel as EXR, and a README on conventions.

    Examples
    --------
      fotismos export cornell-box
      fotismos export my_scene.xml --resolution 640x480 -o for_my_engine
    """

    argument = "SCENE"
    below = "export/SCENE"
    options_shown = (
        "variant", "heuristic_variant", "resolution", "heuristic", "interpolation", "tessellation",
        "vertex_weights", "everything", "pairing", "allow_empty", "define", "sensor",
        "output", "quiet", "verbose", "timeout",
    )  # fmt: skip

    def run(self, terminal: Terminal) -> int:
        """Export the scene."""
        with terminal.processes() as pool:
            from fotismos.reports.run import folders  # loaded late

            below = terminal.output / "export"
            (folder,) = folders.results_of(pool, below, [self.scene], self._exported)
        tell_where(folder)
        return 0

    def _exported(self, scene: str, target: Path, progress: object) -> None:
        """Write the files that another program needs to render a scene."""
        from fotismos.comparisons.case import open_case  # loaded late, in a worker
        from fotismos.comparisons.plain_scene import plain_scene  # as late
        from fotismos.reports.files import export_files  # as late

        case = open_case(scene, self.options)
        found = plain_scene(case.source, case.options)
        export_files.write(target, found, case.command(image="YOURS.exr"))
