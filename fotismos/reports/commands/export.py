"""``fotismos export``: a scene for another program."""

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
            from fotismos.reports.files import export_files  # loaded late
            from fotismos.reports.run import folders

            (folder,) = folders.results_of(
                pool,
                terminal.output / "export",
                scenes=[self.scene],
                work=export_files.exported,
                arguments=[self.options],
            )
        tell_where(folder)
        return 0
