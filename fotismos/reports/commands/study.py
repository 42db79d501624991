"""``fotismos study``: how the error behaves over a space of scenes."""

from pathlib import Path

from fotismos.reports.command import PROCESSES, Command
from fotismos.reports.jobs import Terminal


class Study(Command, frozen=True):
    """Compare over a grid or a Sobol design of scenes: one dataset, and maps.

    FILE.toml says which parameters of which scenes vary. Writes a page, NAME.parquet, and figures,
    among them pictures over the parameters, to OUTPUT/study/NAME. Finished points are kept: the
    same command resumes a study that ended early.

    Examples
    --------
      fotismos study studies/phong-roughplastic.toml
      fotismos study my_study.toml --workers 4
      fotismos study my_study.toml --scheduler tcp://head:8786 -o results
    """

    argument = "FILE.toml"
    below = "study/NAME"
    options_shown = ("output", "quiet", "verbose", PROCESSES)

    file: Path

    def run(self, terminal: Terminal) -> int:
        """Render the points of the study, and write its dataset and figures."""
        # One process lists the points, since scenes are read for that; then others render.
        alone = Terminal(timeout=terminal.timeout)
        with alone.processes() as pool:
            from fotismos.reports.run import study  # loaded late

            study.show(pool, self.file, terminal)
        return 0
