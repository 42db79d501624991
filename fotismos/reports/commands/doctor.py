"""``fotismos doctor``: whether fotismos works here."""

import click

from fotismos.heuristic import llvm
from fotismos.reports.command import Command
from fotismos.reports.jobs import Terminal

TIMEOUT_S = 300
"""Seconds for a test rendering, which takes about ten if no kernel is compiled yet."""


class Doctor(Command, frozen=True):
    """Check the installation: versions, LLVM, OpenGL, a rendering in each variant, metrics.

    Examples
    --------
      fotismos doctor
    """

    def run(self, terminal: Terminal) -> int:
        """Print the lines on the installation."""
        with Terminal(timeout=TIMEOUT_S).processes() as pool:
            from fotismos.reports.run import doctor  # loaded late

            for line in doctor.examine(pool, llvm.VARIANTS):
                click.echo(line)
        return 0
