"""Runs commands of fotismos, as users do."""

import os
import subprocess
import sys

from docs.figures.from_tests import ROOT


def run(*words: str) -> None:
    """Run a command, which calls itself ``./run`` in what it writes."""
    shown_as = os.environ | {"FOTISMOS_PROGRAM": "./run"}
    command = (sys.executable, "-P", "-m", "fotismos.reports", *words)
    subprocess.run(command, cwd=ROOT, env=shown_as, check=True)
