"""How often marks are wrong and how many differences they find, on scenes of skewed noise.

As many runs as ``--rounds`` says, of disjoint groups of independent passes. Wrong is any mark where
the test image is the mean of all other passes; the rate that is stated is 5 %. Found is the share
of the pixels whose departure of the heuristic exceeds a ΔE2000 of 3.
"""

from rich.console import Console
from rich.table import Table

import heuristic

from heuristic import backend  # isort: skip  it finds LLVM first

import mitsuba as mi
import numpy as np
from scipy import stats

from comparisons.departure.marks import LEVEL, MARKED, UNDETERMINED
from tests import noisy


def run(rounds):
    """Measure, print a table, and return the numbers."""
    backend.check()
    mi.set_variant("llvm_ad_rgb")
    heuristic.register()
    rows = [_row(*case, rounds) for case in noisy.RUNS]
    table = Table(*rows[0], title="Marks of significance")
    for row in rows:
        table.add_row(*(f"{v:.3g}" if isinstance(v, float) else str(v) for v in row.values()))
    Console().print(table)
    return rows


def _row(name, samples, passes, rounds):
    pool = noisy.render(name, samples, rounds * passes)
    wrong, undetermined = 0, []
    for own, truth in pool.runs(passes):
        marks = noisy.found(truth - own, truth, pool.counted)[pool.counted]
        wrong += int((marks == MARKED).any())
        undetermined.append((marks == UNDETERMINED).mean())
    return {
        "scene": name,
        "passes": f"{passes} x {samples}",
        "runs": rounds,
        "wrong": wrong,
        "chance at 5 %": float(stats.binomtest(wrong, rounds, LEVEL, "greater").pvalue),
        "undetermined": float(np.mean(undetermined)),
        "found": noisy.power(pool, passes),
    }
