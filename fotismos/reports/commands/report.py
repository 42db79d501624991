"""``fotismos report``: all built-in scenes in one report."""

from typing import Annotated

import click

from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.comparisons.options import option
from fotismos.comparisons.processes.pool import Task
from fotismos.reports.command import PROCESSES, RENDERING, WithOptions
from fotismos.reports.jobs import Job, Terminal

QUICK = {"resolution": (64, 64), "spp": 16}
"""The defaults of ``--quick``."""

PATIENCE = 4
"""How many times the samples an undecided scene of ``--quick`` takes, at most."""


class Report(WithOptions, frozen=True):
    """Compare all built-in scenes, attribute their errors to effects, and write one report.

    Writes the files of `compare`; the page also has the hard cases, and grows with the scenes.

    Examples
    --------
      fotismos report
      fotismos report --cost cornell-box
      fotismos report --quick --open
      fotismos report --resolution 128x128 -o small --figures
    """

    output_folder = "out/report"
    options_shown = (
        "quick", "ladders", RENDERING, "colour_science",
        "output", "figures", "fresh", "quiet", "verbose", "is_opened", "within", PROCESSES,
    )  # fmt: skip

    quick: Annotated[bool, option("Everything at a small size, in about a minute.")] = False
    ladders: Annotated[
        tuple[str, ...],
        option(
            "Measure the error and time of methods in a scene, too; repeat it for more scenes.",
            names=("--cost",),
            metavar="SCENE",
            type=click.Choice(list(SCENES)),
        ),
    ] = ()

    def run(self, terminal: Terminal) -> int:
        """Compare the built-in scenes and the hard cases."""
        options = self.options
        if self.quick:
            small = {name: getattr(self, name) or value for name, value in QUICK.items()}
            options = options.changed(**small)
        job = Job(
            options=options,
            figures=terminal.figures,
            with_causes=True,
            fresh=terminal.fresh,
            within=terminal.within,
            ladders=frozenset(self.ladders),
            patience=PATIENCE if self.quick and self.spp is None else 1,
        )
        with terminal.processes(len(SCENES)) as pool:
            from fotismos.reports.run import batch, scene  # loaded late

            cases = Task(
                name="hard cases",
                function=scene.hard_cases,
                arguments=(),
                is_counted=False,
            )
            return batch.compare_all(pool, scene.subjects(tuple(SCENES)), job, terminal, cases)
