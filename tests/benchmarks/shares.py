"""The share of a comparison's CPU time that its metrics and its files take, by size.

Medians of at most five rounds, with the usual samples and with few, without causes. Kernels are
compiled before.
"""

import os
import tempfile
from contextlib import ExitStack
from pathlib import Path
from statistics import median
from unittest.mock import patch

from rich.console import Console
from rich.table import Table

SCENES = ("cornell-box", "fig-8-9")
SIZES = (128, 512, 1024)
SAMPLES = (None, 4)
"""None for the plan's own number."""

CLOCKS = ("comparisons.compare.perf_counter", "reference.rendering.renderer.perf_counter")
METRICS = ("metrics",)


def cpu_seconds():
    """Return what this process has used so far, in user and system mode."""
    used = os.times()
    return used.user + used.system


def run(rounds):
    """Measure, print a table, and return the numbers."""
    for name in SCENES:
        _once(name, 32, 4)
    rows = [
        _row(name, size, samples, min(rounds, 5))
        for name in SCENES
        for samples in SAMPLES
        for size in SIZES
    ]
    table = Table(*rows[0], title="CPU seconds of comparisons")
    for row in rows:
        table.add_row(*(f"{v:.3g}" if isinstance(v, float) else str(v) for v in row.values()))
    Console().print(table)
    return rows


def _row(name, size, samples, rounds):
    found = [_once(name, size, samples) for _ in range(rounds)]
    middle = {key: median(each[key] for each in found) for key in found[0]}
    share = (middle["metrics"] + middle["files"]) / middle["whole"]
    return {"scene": name, "size": size, "samples": samples or "usual", **middle, "share": share}


def _once(name, size, samples):
    from comparisons.case import open_case
    from comparisons.compare import compare
    from comparisons.options import Options
    from reports.run import scene

    request = Options.of({"resolution": (size, size), "spp": samples})
    with ExitStack() as stack:
        for clock in CLOCKS:
            stack.enter_context(patch(clock, cpu_seconds))
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        begin = cpu_seconds()
        case = open_case(name, request)
        made = compare(case.source, case.options)
        compared = cpu_seconds()
        scene.write(folder, name, made)
        end = cpu_seconds()
    time = made.record.time
    return {
        "rendering": time.heuristic.total_s + time.reference.total_s,
        "metrics": sum(time.stages[stage] for stage in METRICS),
        "files": end - compared,
        "whole": end - begin,
    }
