"""Where the time of a report goes, by stage, and that of starting, by the package imported."""

import json
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

from rich.console import Console
from rich.table import Table

LARGEST = 12
"""Rows of a table."""

SMALL = "compare", "lambert-sphere", "--resolution", "16x16", "--spp", "4"


def run(rounds):
    """Print a table of each, and return the seconds; one run shows the large shares."""
    with tempfile.TemporaryDirectory() as folder:
        _fotismos("report", "--quick", "-o", folder)
        stages = json.loads((Path(folder) / "run.json").read_text("utf-8"))["stages"]
        printed = _fotismos(*SMALL, "-o", f"{folder}/small", options=("-X", "importtime"))
    found = {"report --quick": stages, "imports": _imports(printed)}
    for name, seconds in found.items():
        whole, table = sum(seconds.values()), Table(name, "seconds", "share")
        for key, value in Counter(seconds).most_common(LARGEST):
            table.add_row(key, f"{value:.2f}", f"{value / whole:.0%}")
        Console().print(table)
    return found


def _imports(printed):
    """Return ``{package: seconds}`` from lines ``import time: self | cumulative | module``."""
    seconds = Counter()
    for line in printed.splitlines():
        if line.startswith("import time:") and "self [us]" not in line:
            own, _, module = line.removeprefix("import time:").split("|")
            seconds[module.strip().split(".")[0]] += int(own) / 1e6
    return dict(seconds)


def _fotismos(*arguments, options=()):
    """Run a command, and return what it prints to standard error."""
    command = [sys.executable, *options, "-P", "-m", "fotismos.reports", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode not in (0, 1):  # 1: a check failed
        raise SystemExit(done.stderr)
    return done.stderr
